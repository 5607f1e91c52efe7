--- history.lua: what supervisors read: one entry per scored generation. All of it stays readable
--- except traces and the genomes of older generations: an old entry builds its robots on demand
--- from its population file, which stays in memory only where the run has no folder.

local host = require "limax.host"
local run_files = require "limax.settings.run_files"

local history = {}

--- Number of generations whose genomes stay in memory: as many as the paper's supervisor sees.
history.genomes_kept = 3

--- A generation that has been scored, as supervisors and prompts see it; the fields of its line in
--- metrics.jsonl, and more.
---@class limax.generation
---@field repetition integer 1, 2, ...
---@field generation integer 0, 1, ...
---@field population limax.population.scored its robots; genomes for the last three generations
---@field parameters table<string, number> that it was bred with
---@field materials table that it was made of, as a material file holds them
---@field ledger { supervisor: string, source?: string, reason?: string, entries: table[] } how it
--- got its parameters: its line in ledger.jsonl
---@field best number the champion's fitness
---@field best_standard? number the same under the first materials; absent if it ends badly there
---@field mean number of the scored robots' fitness; likewise the next three
---@field median number
---@field worst number
---@field quantiles table<string, number> q10, q25, q50, q75, q90
---@field measures? table<string, table> of each number that the fitness names: champion, mean,
--- least, most
---@field diversity { all: table, top: table } hamming, genotype, distinct, robots, material_shares
---@field failed { invalid: integer, diverged: integer, fitness: integer } robots without a score
---@field coarse integer robots of which a mass moved farther than a tenth of an edge in one step
---@field scored integer robots with a score
---@field evaluations integer robots that were simulated
---@field supervisor_failed? boolean true where the supervisor failed: fallback, or no change
---@field champion { id: integer, index: integer, hash: string } the best robot

-- entry -> population rebuilt from its text, until it is collected
local rebuilt = setmetatable({}, { __mode = "kv" })

--- One line per robot.
function history.encode(records)
  local lines = {}
  for i, record in ipairs(records) do lines[i] = host.json.encode(record) .. "\n" end
  return table.concat(lines)
end

--- An entry: the fields of the generation's metrics line, its ledger record and materials, and
--- `.population`, either in memory or rebuilt from `text()` by `build(records)` on demand.
---@param parts table metrics, ledger, materials, text, build; population while it is in memory
---@return limax.generation
function history.entry(parts)
  -- not `parts` itself, which would keep every population in memory
  local entry, text, build = {}, parts.text, parts.build
  for name, value in pairs(parts.metrics) do
    if name ~= "schema" then entry[name] = value end
  end
  entry.ledger, entry.materials, entry.population = parts.ledger, parts.materials, parts.population
  return setmetatable(entry, { __index = function(self, key)
    if key ~= "population" then return nil end
    local population = rebuilt[self]
    if not population then
      population = build(run_files.robots(text(), "generation " .. entry.generation))
      rebuilt[self] = population
    end
    return population
  end })
end

-- Drops the population of an entry.
local function drop(entry)
  local population = entry and rawget(entry, "population")
  if not population then return end
  entry.population = nil
  population.engine:free()
end

--- Drops the population of the generation that is now too old for its genomes to be kept.
---@param list table[]
function history.forget(list) drop(list[#list - history.genomes_kept]) end

--- Drops all populations of a repetition that has ended.
---@param list table[]
function history.release(list)
  for k = math.max(1, #list - history.genomes_kept), #list do drop(list[k]) end
end

return history
