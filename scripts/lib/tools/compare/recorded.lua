--- recorded.lua: outcomes of `limax compare --outcome` that the metrics of a run's last generation
--- record: nothing is simulated again.

local failure = require "limax.base.failure"
local flat = require "limax.base.flat"

local recorded = {}

-- The setting on which the numbers of an archive depend.
local function archive_of(config) return config.archive end

-- The settings on which a hypervolume depends.
local function front_of(config)
  local found = {}
  for _, part in ipairs { config.archive or false, config.survival or false } do
    if type(part) == "table" then
      found.objectives = found.objectives or part.objectives
      found.reference = found.reference or part.reference
    end
  end
  return found
end

local GRID = 'an archive with cells: archive = { "grid", descriptors = ... } or "cvt"'

---@class limax.compare.recorded
---@field text string for tables
---@field of fun(line: table): number|nil of a line of metrics
---@field needs string what gives it
---@field same nil|fun(config: table): any must be equal in all runs

---@type table<string, limax.compare.recorded>
recorded.entries = {
  archive_best = { text = "best fitness in the archive of the last generation",
    of = function(line) return line.archive and line.archive.best end, needs = "an archive" },
  coverage = { text = "coverage of the archive of the last generation (share of its cells)",
    of = function(line) return line.archive and line.archive.coverage end, needs = GRID,
    same = archive_of },
  qd_score = { text = "QD score of the archive of the last generation (sum of the fitness over "
    .. "its cells)", of = function(line) return line.archive and line.archive.qd_score end,
    needs = GRID, same = archive_of },
  hypervolume = { text = "hypervolume of the Pareto front of the last generation",
    of = function(line) return line.front and line.front.hypervolume end, same = front_of,
    needs = 'objectives with a reference point: survival = { "nsga2", objectives = ..., '
      .. "reference = ... }" },
}

-- Refuses numbers that depend on different settings: they cannot be compared.
local function check_same(name, first, run)
  local same, found = recorded.entries[name].same, {}
  for k, each in ipairs { first, run } do
    found[k] = flat.add(same(each.config), "", {}, flat.text)
  end
  local differs = flat.differences(found[1], found[2])[1]
  if differs then
    failure.raise(2, ("%s and %s cannot be compared by %s: it depends on %s, which is %s and %s")
      :format(first.path, run.path, name, differs.path, differs.before, differs.now))
  end
end

--- The outcome of each run.
---@param name string of an entry
function recorded.measure(list, name)
  local entry, values = recorded.entries[name], {}
  for _, run in ipairs(list) do
    values[run] = entry.of(run.lines[#run.lines])
    if not values[run] then
      failure.raise(2, ("%s has no %s: it needs %s"):format(run.path, name, entry.needs))
    end
    if entry.same then check_same(name, list[1], run) end
  end
  return values
end

return recorded
