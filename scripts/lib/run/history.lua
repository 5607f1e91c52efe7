--- history.lua: the history that supervisors read: one entry per scored generation, without its
--- traces. The robots of older generations are read when they are needed, and in a run without a
--- folder they have no genomes.

local history = {}

--- Number of generations whose genomes stay in memory: as many as the paper's supervisor sees.
history.genomes_kept = 3

--- A generation that has been scored, as supervisors and prompts see it; the fields of its line in
--- metrics.jsonl, and more.
---@class limax.generation
---@fields history generation

---@class limax.ledger.line how a generation got its parameters
---@fields ledger

---@class limax.spread of a number over the scored robots that have it
---@fields spread

---@class limax.history.entries makes the entries of a run
---@field class table metatable of the entries
local Entries = {}
Entries.__index = Entries

--- Makes the entries of a run, whose populations are read when they are no longer in memory.
---@param read fun(entry: limax.generation): limax.population.scored
function history.entries(read)
  -- by entry, until they are collected
  local populations, class = setmetatable({}, { __mode = "kv" }), {}
  function class.__index(entry, key)
    if key ~= "population" then return nil end
    populations[entry] = populations[entry] or read(entry)
    return populations[entry]
  end
  return setmetatable({ class = class }, Entries)
end

-- Drops the population of an entry.
local function drop(entry)
  local population = entry and rawget(entry, "population")
  if not population then return end
  entry.population = nil
  local own, whole, fetched = rawget(population, "own"), rawget(population, "engine"),
    rawget(population, "fetched")
  if own then own:free() end
  if whole and whole ~= own then whole:free() end
  if fetched then fetched.engine:free() end
end

--- Adds the entry of the newest generation. Drops the population that is now too old.
---@param line table of metrics.jsonl
function Entries:add(list, line, ledger, materials)
  local entry = {}
  for name, value in pairs(line) do
    if name ~= "schema" then entry[name] = value end
  end
  entry.ledger, entry.materials = ledger, materials
  list[#list + 1] = setmetatable(entry, self.class)
  drop(list[#list - history.genomes_kept])
  return entry
end

--- Drops all populations of a repetition that has ended.
function history.release(list)
  for k = math.max(1, #list - history.genomes_kept), #list do drop(list[k]) end
end

return history
