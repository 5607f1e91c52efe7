--- whole_runs.lua: an experiment whose numbers change if anything of a run is lost, and whether two
--- run folders have the same bytes.

local host = require "limax.host"
local source = require "limax.base.source"

local whole_runs = {}

-- Its supervisor reads bodies and genomes of earlier generations and sets materials, fitness and
-- supervisor read a state, parents are of an archive, islands draw where robots go, and some robots
-- fail in the fitness.
local EXPERIMENT = [[
local limax = require "limax"

local function supervisor(history, random, _, state)
  local now, old = history[#history], history[math.max(1, #history - 2)]
  local shift = 0.02 * (old.population[1].body.mass / now.population[1].body.mass - 1)
    + 0.01 * old.population[2].genome[3] + 0.001 * history[1].population[3].body.voxels
    + 0.02 * (random:uniform() - 0.5)
  state.shifts[#state.shifts + 1] = shift
  return { mutation_scale = 0.1 + shift + 1e-4 * state.survived,
    materials = { bone = { stiffness = (#history % 4 == 0 and 1.02 or 0.99) * 1e4 } } },
    ("shift %.17g"):format(shift)
end

return limax.experiment {
  name = "tiny", lattice = { 3, 3, 3 }, population = 12, generations = GENERATIONS,
  repetitions = REPETITIONS, simulation = { duration = 0.5, settle = 0.1 },
  state = function() return { survived = 0, shifts = {} } end,
  archive = { "novelty", descriptors = { "voxel_share", "muscle_share" }, k = 3, add = 2 },
  survival = function(robots, _, state)
    state.survived = state.survived + 1
    return { robots.ranked[1] }, robots.archive
  end,
  islands = { count = 4, every = 2, migrants = 1, topology = "random" },
  fitness = function(robot, state)
    if robot.generation > 0 and robot.id % 33 == 18 then return 0 / 0 end
    return robot:distance() + 1e-6 * #state.shifts,
      { robot.body.mass, robot:speed(), way = robot:distance() }
  end,
  selection = "rank", supervisor = supervisor, supervision = { materials = true },
}
]]

--- The text of its script.
function whole_runs.experiment(generations, repetitions)
  return (EXPERIMENT:gsub("GENERATIONS", generations):gsub("REPETITIONS", repetitions))
end

-- Files that hold clocks, or how a run got there.
local SKIPPED = { ["journal.jsonl"] = true, ["timing.jsonl"] = true, ["config.json"] = true,
  scripts = true, ["champion.svg"] = true, ["config-2.json"] = true, ["scripts-2"] = true }

--- All other files below a run folder, sorted.
---@param below? string only those below this folder of it, which begins with "/"
---@return string[] paths below the folder, each begins with "/"
function whole_runs.files(folder, below, list)
  list = list or {}
  for _, name in ipairs(host.file.list(folder .. (below or "")) or {}) do
    local path = (below or "") .. "/" .. name
    local is_folder = host.file.exists(folder .. path) == "folder"
    if is_folder and not SKIPPED[name] then whole_runs.files(folder, path, list) end
    if not is_folder and not SKIPPED[name] then list[#list + 1] = path end
  end
  return list
end

--- Checks that a run folder has the bytes of another.
function whole_runs.same(t, got, expected)
  local paths = whole_runs.files(expected)
  t:equal(whole_runs.files(got), paths)
  for _, path in ipairs(paths) do
    t:ok(source.read(got .. path) == source.read(expected .. path),
      ("%s%s differs from that of %s"):format(got, path, expected))
  end
end

return whole_runs
