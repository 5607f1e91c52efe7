--- tune.lua: `limax bench accuracy --tune`: the longest step at which an experiment is accurate.
--- Scores some bodies of its first generation, and champions, at twice the script's own step, at
--- that step and at shorter ones, against an eighth of it in double. SI units.

local engine = require "limax.engine"
local failure = require "limax.base.failure"
local generations = require "limax.evolution.generation"
local host = require "limax.host"
local ranking = require "limax.tools.bench.accuracy.ranking"
local robot_rows = require "limax.robot.rows"
local rescore = require "limax.evolution.rescore"
local robot_file = require "limax.robot.robot_file"
local script = require "limax.base.script"
local settings = require "limax.settings.settings"
local terminal = require "limax.base.terminal"
local walkers = require "limax.tools.bench.accuracy.walkers"

local tune = {}

tune.COLUMNS = { "setting", "share", "time_step", "bound_fraction", "time_step_most", "robots",
  "failed", "tau", "overlap", "distance_error", "distance_error_relative", "elite_regret",
  "relative_price", "fits" }

-- valid bodies of the first generation, and the robots among which they are searched
local BODIES, SEARCHED = 12, 36

-- shares of the script's own step, which is the second; and the reference's
local SHARES, OWN, REFERENCE = { 2, 1, 1 / 2, 1 / 4 }, 2, 1 / 8

-- largest elite regret of a step that fits, if twice the chaos floor's is not more
local REGRET = 0.05

-- largest share of a body's own limit: the hard cases hold up to it
local MOST_OF_BOUND = 0.99

-- s of wall time of one round of one setting
local ROUND = 0.1

-- A champion, which must have the experiment's lattice.
local function champion(path, lattice, materials)
  local description = robot_file.read(path)
  local own, wanted = table.concat(description.lattice, "x"), table.concat(lattice, "x")
  if own ~= wanted then
    failure.raise(2, ("--champion %s: its lattice is %s, the experiment's is %s"):format(path, own,
      wanted))
  end
  return robot_file.build(description, materials)
end

-- The bodies to try as one population of the experiment's materials: the first valid ones, then
-- the champions.
local function gather(experiment, champions, device)
  local first = walkers.random(experiment:override { "generations=1", "repetitions=1",
    "population=" .. math.min(experiment.config.population, SEARCHED) }, device)
  local config, sources = first.world.config, {}
  for i = 1, #first do
    if #sources < BODIES and first.engine:body(i).status == "valid" then
      sources[#sources + 1] = { first.engine, i }
    end
  end
  if #sources + #champions < 2 then
    failure.raise(1, ("--tune: %d of the first %d bodies can be simulated; two are needed to be "
      .. "ranked"):format(#sources, #first))
  end
  for _, path in ipairs(champions) do
    sources[#sources + 1] = { champion(path, config.lattice, first.materials), 1 }
  end
  local together = engine.population { lattice = config.lattice, count = #sources }
  for k, each in ipairs(sources) do
    together:set_body(k, each[1]:voxels(each[2]), each[1]:weights(each[2]))
  end
  together:check(first.materials, { require_muscle = config.genome.require_muscle })
  local all = first.world:rows(0, nil, #sources)
  for k = 1, #sources do all[k].id, all[k].origin = k, "initial" end
  robot_rows.describe(all, together, first.materials)
  return generations.new(first.world, { engine = together, materials = first.materials,
    generation = 0, parameters = config.breeding, rows = all })
end

-- The experiment's setting with its step at a share.
local function at_share(simulation, share, rate)
  local setting = { integrator = simulation.integrator, precision = simulation.precision }
  if type(simulation.time_step) == "number" then
    local steps = math.max(1, math.floor(1 / (rate * simulation.time_step * share) + 0.5))
    setting.time_step = 1 / (rate * steps)
    return setting
  end
  setting.time_step, setting.bound = "auto", simulation.bound
  -- a script's own share may be larger
  local own = simulation.bound_fraction
  setting.bound_fraction = math.min(math.max(own, MOST_OF_BOUND), own * share)
  setting.time_step_most = simulation.time_step_most * share
  return setting
end

-- The reference, and its chaos floor: a step changed by one part in 1e4, or by the least that whole
-- samples allow.
local function references(simulation, rate, longest)
  local fine = at_share(simulation, REFERENCE, rate)
  local near
  if type(fine.time_step) == "number" then
    near = { integrator = fine.integrator, time_step = ranking.perturbed(fine.time_step, rate) }
  else
    -- the share that adds one step to each sample interval at the longest step
    local part = math.max(1e-4, longest * REFERENCE * rate)
    near = at_share(simulation, REFERENCE * (1 - part), rate)
  end
  fine.precision, near.precision = "double", "double"
  return fine, near
end

local function longest_step(scores)
  local longest = 0
  for _, time_step in pairs(scores.time_step) do longest = math.max(longest, time_step) end
  return longest
end

-- The lines to write into the script.
local function advice(row, simulation)
  if type(simulation.time_step) == "number" then
    return ("simulation = { time_step = %.9g }"):format(row.time_step)
  end
  local cap = row.time_step_most > 0 and (", time_step_most = %.9g"):format(row.time_step_most)
    or ""
  local bound = simulation.bound and ("bound = %q, "):format(simulation.bound) or ""
  return ("simulation = { time_step = \"auto\", %sbound_fraction = %.9g%s }"):format(bound,
    row.bound_fraction, cap)
end

--- The longest step that fits, as do all shorter ones; nil if none does.
---@param rows table[] longest step first, with `elite_regret` and `failed`
---@param floor number|nil elite regret of the chaos floor
---@param failed integer robots that fail at the reference
---@return table|nil row
---@return number limit of the elite regret
function tune.choose(rows, floor, failed)
  local limit, found = math.max(REGRET, 2 * (floor or 0)), nil
  for k = #rows, 1, -1 do
    local row = rows[k]
    row.fits = row.elite_regret ~= nil and row.elite_regret <= limit and row.failed <= failed
    if not row.fits then break end
    found = row
  end
  return found, limit
end

-- Rows of all shares, longest step first, the chaos floor's, and the robots that fail at the
-- reference.
local function measure(robots, how)
  local simulation = robots.world.config.simulation
  local rate = settings.base_rate(robots.world.config.record)
  local list, scores, rows = {}, {}, {}
  for k, share in ipairs(SHARES) do list[k] = at_share(simulation, share, rate) end
  local prices = walkers.prices(robots, list, ROUND)
  for k, setting in ipairs(list) do
    host.raise_if_interrupted()
    scores[k] = rescore.population(robots, setting)
  end
  local fine, near = references(simulation, rate, longest_step(scores[OWN]))
  how.say(("%d bodies against an eighth of the step, in double"):format(#robots))
  local reference = rescore.population(robots, fine)
  local function row_of(name, share, setting, cheap)
    local row = ranking.compare(reference, cheap, #robots)
    row.setting, row.share, row.robots, row.failed = name, share, #robots, cheap.failed
    row.time_step, row.bound_fraction = longest_step(cheap), setting.bound_fraction
    row.time_step_most = setting.time_step_most
    return row
  end
  for k, share in ipairs(SHARES) do
    local name = k == OWN and "the script's own step" or ("%g of the script's step"):format(share)
    if share > 1 and list[k].bound_fraction == MOST_OF_BOUND then
      name = ("%g of the bound"):format(MOST_OF_BOUND)
    end
    rows[k] = row_of(name, share, list[k], scores[k])
    rows[k].relative_price = prices[k] and prices[OWN] and prices[k] / prices[OWN]
  end
  local floor = row_of("chaos floor", REFERENCE, near, rescore.population(robots, near))
  return rows, floor, reference.failed
end

local TABLE = { { "step", "setting" }, { "longest, s", "time_step" }, { "failed" }, { "tau" },
  { "elite regret", function(row)
    return row.elite_regret and ("%.1f %%"):format(100 * row.elite_regret)
  end },
  { "distance, mm", function(row) return row.distance_error and 1e3 * row.distance_error end },
  { "price", "relative_price" } }

--- Tries an experiment's steps and prints what to write into its script.
---@param how { tune: string, champion: string[]|nil, device: limax.device,
--- say: fun(text: string) }
function tune.run(how)
  local experiment = script.run(how.tune)
  if not require("limax.experiment.experiment").is(experiment) then
    failure.raise(2, ("--tune %s: it returns no experiment"):format(how.tune))
  end
  local robots = gather(experiment, how.champion or {}, how.device)
  local rows, floor, failed = measure(robots, how)
  local found, limit = tune.choose(rows, floor.elite_regret, failed)
  rows[#rows + 1] = floor
  how.say("\n" .. terminal.rows(TABLE, rows, terminal.style {}) .. "\n")
  if found then
    how.say(("the elite regret stays below %.1f %% up to %s. Write into %s:\n  %s"):format(
      100 * limit, found.setting, how.tune, advice(found, experiment.config.simulation)))
  else
    how.say(("no step of these keeps the elite regret below %.1f %%: the scene needs a shorter one "
      .. "than a quarter of its own"):format(100 * limit))
  end
  return { columns = tune.COLUMNS, rows = rows }
end

return tune
