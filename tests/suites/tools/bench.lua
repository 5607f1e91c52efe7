--- bench.lua: `limax bench`: the rows of each bench, as a table, CSV and JSON.

local agreement = require "limax.tools.bench.agreement"
local bodies = require "limax.tools.bench.bodies"
local context = require "limax.tools.bench.hard_cases.context"
local engine = require "limax.engine"
local host = require "limax.host"
local process = require "support.process"
local source = require "limax.base.source"
local trial = require "support.trial"

local suite = require("limax.test").suite "limax bench"

-- Runs a bench: its rows, its CSV and its output agree.
local function bench(t, words)
  local folder = t:folder()
  local all = { "bench", unpack(words) }
  for _, word in ipairs { "--json", "rows.json", "--csv", "rows.csv" } do all[#all + 1] = word end
  local done = process.completes(t, folder, all)
  local result = assert(host.json.decode(source.read(folder .. "/rows.json"), "rows.json"))
  t:equal({ result.schema, result.bench }, { "limax.bench/1", words[1] })
  local lines = {}
  for line in source.read(folder .. "/rows.csv"):gmatch "[^\n]+" do lines[#lines + 1] = line end
  t:equal({ lines[1], #lines - 1 }, { table.concat(result.columns, ","), #result.rows })
  local columns = {}
  for _, column in ipairs(result.columns) do columns[column] = true end
  for _, row in ipairs(result.rows) do
    for name in pairs(row) do t:ok(columns[name], name .. " is in a row and has no column") end
  end
  return result.rows, done.stdout
end

local function row_of(t, rows, fields)
  for _, row in ipairs(rows) do
    local fits = true
    for name, value in pairs(fields) do fits = fits and row[name] == value end
    if fits then return row end
  end
  t:ok(false, "no row has " .. host.json.encode(fields))
end

suite:test("throughput of the CPU", { limit = 300 }, function(t)
  local rows, output = bench(t, { "throughput", "--device", "cpu", "--threads", "2",
    "--seconds", "0.01" })
  t:ok(output:find("checked: every precision", 1, true), output)
  for _, precision in ipairs { "single", "compensated", "double" } do
    local row = row_of(t, rows, { precision = precision, integrator = "leapfrog", threads = 1,
      robots = 1, effects = "all" })
    t:ok(row.springs_per_second > 1e5, precision)
  end
end)

suite:test("effects: each one, all but each, and all", { limit = 60 }, function(t)
  local rows = bench(t, { "effects", "--device", "cpu", "--seconds", "0.01" })
  t:equal(#rows, 2 + 2 * (#engine.effects() - 1))
  t:near(rows[1].relative_to_springs, 1)
  t:equal(rows[#rows].effects, "all")
  t:near(rows[#rows].relative_to_all, 1)
  -- friction needs the ground
  local both = row_of(t, rows, { effects = "ground, friction" })
  t:near(both.relative_to_springs, both.seconds_per_step / rows[1].seconds_per_step)
  row_of(t, rows, { effects = "all but ground, friction" })
end)

suite:test("throughput and effects of a GPU", { devices = "cuda", tags = "full" }, function(t)
  local rows, output = bench(t, { "throughput", "--device", "cuda", "--seconds", "0.01" })
  trial.contains(t, output, "every precision is where the CPU is")
  local row = row_of(t, rows, { lattice = "5x5x5", robots = 132, precision = "compensated" })
  t:ok(row.springs_per_second > 1e8 and row.registers > 0 and row.instructions > 0)
  t:near(row.robot_seconds_per_second, row.robots * 1e-4 / row.seconds_per_step)
  row_of(t, rows, { lattice = "50x50x50", robots = 1 })
  rows = bench(t, { "effects", "--device", "cuda", "--seconds", "0.01" })
  t:ok(rows[1].instructions < rows[#rows].instructions, "effects add no instructions")
end)

suite:test("refuses what it cannot measure", function(t)
  for _, bad in ipairs {
    { { "effect" }, 'unknown bench "effect"; did you mean "effects"?', 2 },
    { { "effects", "--device", "cuda" }, "device 'cuda': ", 1 },
    { { "effects", "--duration", "5" }, "--duration belongs to limax bench accuracy", 2 },
  } do
    local done = process.ends(t:folder(), { "bench", unpack(bad[1]) },
      { before = "CUDA_VISIBLE_DEVICES=" })
    t:equal(done.status, bad[3])
    t:ok(done.stderr:find(bad[2], 1, true), done.stderr)
    t:equal(select(2, done.stderr:gsub("\n", "")), 1)
  end
end)

suite:test("a device agrees with itself, and tolerances detect another law", function(t)
  t:equal(agreement.check(engine.materials "paper", engine.device "cpu", { { 2, 2, 2 } },
    { "single", "double" }), 0)
  t:ok(agreement.tolerance("single", bodies.ALL) < 1e-3)
  t:ok(agreement.tolerance("double", bodies.ALL) < 1e-12)
end)

suite:test("hard cases: invariants detect divergence and energy from nowhere", function(t)
  local c = context.new { device = engine.device "cpu", integrator = "leapfrog",
    precision = "double" }
  t:raises("robot 1 diverged (speed)", function()
    c:run { lattice = { 1, 1, 1 }, velocity = { 2000, 0, 0 } }
  end)
  t:raises("should have diverged", function()
    c:run { lattice = { 1, 1, 1 }, diverges = { "speed" } }
  end)
  -- a step beyond the bound
  t:raises("energy of a passive scene rises", function()
    c:run { lattice = { 3, 3, 3 }, time_step = 2e-3, duration = 0.03, max_speed = 1e30,
      max_stretch = 1e15, center = false, place = function(_, velocities)
        for i = 1, #velocities do velocities[i] = { math.sin(9 * i), 0, math.cos(7 * i) } end
      end }
  end)
end)

suite:test("work_precision: the error in the air falls with the square of the step", function(t)
  local result = require("limax.tools.bench.work_precision").run {
    device = engine.device "cpu", say = function() end }
  local errors = {}
  for _, row in ipairs(result.rows) do
    t:ok(row.status == "done" and row.error and row.seconds_per_second > 0 or row.reason
      or row.status == "diverged", row.scene)
    if row.scene == "muscles in the air" and row.integrator == "leapfrog"
      and row.precision == "double" and not row.tier then
      errors[row.time_step] = row.error
    end
  end
  t:near(errors[2e-4] / errors[1e-4], 4, { rtol = 0.1 })
end)

return suite
