--- history.lua: the history that supervisors read: one entry per scored generation, without its
--- traces, and in a run without a folder without the genomes of older generations. A run with a
--- folder keeps few fields of old entries in memory and reads the others on demand, so that the
--- time of a generation does not grow with their number.

local history = {}

--- Number of generations whose genomes stay in memory: as many as the paper's supervisor sees.
history.genomes_kept = 3

--- Number of newest generations whose entries stay in memory, except their robots. The entry of the
--- first generation also stays.
history.whole_kept = 1000

--- Is the entry of this generation too old to be whole in memory, when `last` is the newest?
function history.is_old(generation, last)
  return generation > 0 and last - generation >= history.whole_kept
end

-- Fields of older generations that stay in memory.
local ALWAYS_KEPT = { repetition = true, generation = true, best = true, best_standard = true,
  mean = true, evaluations = true, parameters = true, supervisor_failed = true }

--- A generation that has been scored, as supervisors and prompts see it; the fields of its line in
--- metrics.jsonl, and more.
---@class limax.generation
---@fields history generation

---@class limax.ledger.line how a generation got its parameters
---@fields ledger

---@class limax.spread of a number over the scored robots that have it
---@fields spread

---@class limax.history.source reads what is not in memory
---@field on_disk fun(): boolean can it read the fields of an entry?
---@field fields fun(generation: integer): table of an entry
---@field population fun(entry: limax.generation): limax.population.scored

---@class limax.history.entries makes the entries of a run
---@field source limax.history.source
---@field class table metatable of the entries
local Entries = {}
Entries.__index = Entries

-- Sets the fields of an old entry that stay in memory.
local function keep(entry, from)
  for name in pairs(ALWAYS_KEPT) do rawset(entry, name, rawget(from, name)) end
  return entry
end

local function weak() return setmetatable({}, { __mode = "kv" }) end

---@param source limax.history.source
---@return limax.history.entries
function history.entries(source)
  -- by entry, until they are collected
  local populations, fields, class = weak(), weak(), {}
  function class.__index(entry, key)
    if key == "population" then
      local population = populations[entry] or source.population(entry)
      populations[entry] = population
      return population
    end
    local is_whole, is_known = rawget(entry, "ledger"), rawget(entry, "parameters")
    if is_whole or is_known and ALWAYS_KEPT[key] then return nil end
    local read = fields[entry] or source.fields(entry.generation)
    fields[entry] = read
    return keep(entry, read) and read[key]
  end
  return setmetatable({ source = source, class = class }, Entries)
end

-- Drops the population of an entry.
local function drop(entry)
  local population = entry and rawget(entry, "population")
  if not population then return end
  entry.population = nil
  population.engine:free()
end

local function equal(a, b)
  for name, value in pairs(a) do
    if b[name] ~= value then return false end
  end
  return true
end

-- Drops what is in memory of an entry that is now old.
local function shrink(self, list, k)
  local entry, before = keep({}, list[k]), list[k - 1]
  -- one table for all generations with the same parameters
  if equal(before.parameters, entry.parameters) then entry.parameters = before.parameters end
  list[k] = setmetatable(entry, self.class)
end

--- Adds the entry of an old generation that the folder holds.
---@param list limax.generation[]
function Entries:add_unread(list)
  list[#list + 1] = setmetatable({ generation = #list }, self.class)
end

--- Adds the entry of the newest generation. Drops what is now too old to stay in memory.
---@param list limax.generation[]
---@param line table of metrics.jsonl
---@param ledger table
---@param materials table
---@return limax.generation
function Entries:add(list, line, ledger, materials)
  local entry = {}
  for name, value in pairs(line) do
    if name ~= "schema" then entry[name] = value end
  end
  entry.ledger, entry.materials = ledger, materials
  list[#list + 1] = setmetatable(entry, self.class)
  drop(list[#list - history.genomes_kept])
  local k = #list - history.whole_kept
  if k > 1 and self.source.on_disk() and rawget(list[k], "ledger") then
    shrink(self, list, k)
  end
  return entry
end

--- Drops all populations of a repetition that has ended.
---@param list table[]
function history.release(list)
  for k = math.max(1, #list - history.genomes_kept), #list do drop(list[k]) end
end

return history
