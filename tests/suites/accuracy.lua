--- accuracy.lua: what `limax bench accuracy` says of rankings, steps and tiers, held against
--- examples worked out by hand, and its files against what must be in them.

local engine = require "limax.engine"
local ranking = require "limax.statistics.ranking"
local work_precision = require "limax.bench.accuracy.work_precision"

local suite = require("limax.test").suite "accuracy"

local function silent() end

suite:test("Kendall's tau, against pairs counted one by one", function(t)
  local function tau(a, b) return ranking.kendall_tau(a, b, 4) end
  t:equal(tau({ 1, 2, 3, 4 }, { 10, 20, 30, 40 }), 1)
  t:equal(tau({ 1, 2, 3, 4 }, { 4, 3, 2, 1 }), -1)
  -- of the six pairs the pair (2, 3) alone is in the other order: (5 - 1) / 6
  t:near(tau({ 1, 2, 3, 4 }, { 1, 3, 2, 4 }), 4 / 6)
  -- b ties 2 and 3: five pairs are told apart in both, all in the same order: 5 / sqrt(6 x 5)
  t:near(tau({ 1, 2, 3, 4 }, { 1, 2, 2, 4 }), 5 / math.sqrt(30))
  -- one that failed ranks last, two that failed are equal
  t:equal(tau({ 1, 2, 3, 4 }, { nil, 2, 3, 4 }), 1)
  t:near(tau({ 1, 2, 3, 4 }, { nil, nil, 3, 4 }), 5 / math.sqrt(30))
  t:equal(tau({ 1, 1, 1, 1 }, { 1, 2, 3, 4 }), nil)
  -- every order of four: the mean over all of them is 0
  local sum = 0
  for a = 1, 4 do
    for b = 1, 4 do
      for c = 1, 4 do
        local d = 10 - a - b - c
        if a ~= b and b ~= c and a ~= c and d ~= a and d ~= b and d ~= c then
          sum = sum + tau({ 1, 2, 3, 4 }, { a, b, c, d })
        end
      end
    end
  end
  t:near(sum, 0, { atol = 1e-12 })
end)

suite:test("elites, overlap and elite regret, by hand", function(t)
  local reference = { 5, 1, 4, 2, 3, 0, 0, 0, 0, 0 }
  t:equal(ranking.elites(reference, 10, 0.3), { 1, 3, 5 })
  t:equal(ranking.elites({ 1, 1, nil, 2 }, 4, 0.5), { 4, 1 })
  t:equal(ranking.elites({ 1, 2 }, 2, 0.1), { 2 })
  t:equal(ranking.elites({}, 3, 0.3), {})
  -- the cheap scores take robots 1, 3 and 4 for 1, 3 and 5: 12 becomes 11
  local cheap = { 9, 0, 8, 7, 6, 0, 0, 0, 0, 0 }
  t:near(ranking.overlap(reference, cheap, 10, 0.3), 2 / 3)
  t:near(ranking.elite_regret(reference, cheap, 10, 0.3), 1 / 12)
  t:equal(ranking.elite_regret(reference, reference, 10, 0.3), 0)
  -- only one is left standing: the places that stay empty count as the worst robot, 0
  t:near(ranking.elite_regret(reference, { nil, nil, 3 }, 10, 0.3), 8 / 12)
  -- one that fails under the reference counts as its worst, 1
  t:near(ranking.elite_regret({ 4, nil, 1, 2 }, { 3, 4, 1, 2 }, 4, 0.25), 3 / 4)
  -- scores below zero: 1 of 2 is lost
  t:near(ranking.elite_regret({ -2, -3 }, { 1, 2 }, 2, 0.5), 0.5)
  t:equal(ranking.elite_regret({ 0, 0 }, { 1, 2 }, 2, 0.5), nil)
  local mean, relative = ranking.mean_error({ 1, 2, nil, 3 }, { 1.5, 2, 9, 2 }, 4)
  t:near(mean, 0.5)
  t:near(relative, 1.5 / 6)
end)

local TINY = { lattice = { 2, 2, 2 }, duration = 0.1, reference = 1e-5,
  steps = { 5e-3, 1e-3, 5e-4, 2.5e-4 }, effort = { seconds = 0, runs = 2 } }

suite:test("a tiny work-precision run: errors fall with the step, failures stay", function(t)
  local result = work_precision.run { device = engine.device("cpu", { threads = 1 }), size = TINY,
    scenes = { "free" }, say = silent }
  local errors = {}
  for _, row in ipairs(result.rows) do
    if row.integrator ~= "rk4" and row.precision == "double" then
      errors[row.integrator] = errors[row.integrator] or {}
      errors[row.integrator][row.time_step] = row
    end
  end
  local euler, leapfrog = errors.symplectic_euler, errors.leapfrog
  -- far above the bound of any body: kept as a failure, without an error
  t:equal({ euler[5e-3].status, euler[5e-3].error }, { "diverged" })
  -- first order halves it, second order quarters it
  t:near(euler[5e-4].error / euler[2.5e-4].error, 2, { rtol = 0.1 })
  t:near(leapfrog[5e-4].error / leapfrog[2.5e-4].error, 4, { rtol = 0.1 })
  t:ok(leapfrog[5e-4].seconds_per_second > 0 and leapfrog[5e-4].runs == 2)
  t:ok(leapfrog[5e-4].reference_error < 1e-2 * leapfrog[2.5e-4].error)
end)

return suite
