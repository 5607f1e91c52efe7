--- bench.lua: the benches measure what they say, and write the same rows as a table, CSV and JSON.

local agreement = require "limax.tools.bench.agreement"
local bodies = require "limax.tools.bench.bodies"
local engine = require "limax.engine"
local hashes = require "limax.tools.bench.hashes"
local host = require "limax.host"
local process = require "support.process"
local source = require "limax.base.source"

local suite = require("limax.test").suite "limax bench"

-- Runs a bench; its rows, the lines of its CSV and its output.
local function bench(t, words, before)
  local folder = t:folder()
  local all = { "bench", unpack(words) }
  for _, word in ipairs { "--seconds", "0.01", "--json", "rows.json", "--csv", "rows.csv" } do
    all[#all + 1] = word
  end
  local done = process.completes(t, folder, all, { before = before })
  local result = assert(host.json.decode(source.read(folder .. "/rows.json"), "rows.json"))
  t:equal(result.schema, "limax.bench/1")
  local lines = {}
  for line in source.read(folder .. "/rows.csv"):gmatch "[^\n]+" do lines[#lines + 1] = line end
  t:equal(lines[1], table.concat(result.columns, ","))
  t:equal(#lines - 1, #result.rows)
  local known = {}
  for _, column in ipairs(result.columns) do known[column] = true end
  for _, row in ipairs(result.rows) do
    for name in pairs(row) do t:ok(known[name], name .. " is in a row and no column") end
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
  local rows, said = bench(t, { "throughput", "--device", "cpu", "--threads", "2" })
  t:ok(said:find("checked: every precision", 1, true), said)
  for _, precision in ipairs { "single", "compensated", "mixed", "double" } do
    local row = row_of(t, rows, { precision = precision, integrator = "leapfrog", threads = 1,
      robots = 1, effects = "all" })
    t:ok(row.springs_per_second > 1e5, precision)
  end
  t:ok(row_of(t, rows, { effects = "limax run walk.lua" }).seconds_per_generation > 0)
end)

suite:test("effects, each alone, all but each, and all", { limit = 60 }, function(t)
  local rows = bench(t, { "effects", "--device", "cpu" })
  -- springs alone and all; friction needs the ground, so that all but the ground has neither
  t:equal(#rows, 2 + 2 * (#engine.effects() - 1))
  t:near(rows[1].relative_to_springs, 1)
  t:equal(rows[#rows].effects, "all")
  t:near(rows[#rows].relative_to_all, 1)
  local alone = row_of(t, rows, { effects = "ground, friction" })
  t:near(alone.relative_to_springs, alone.seconds_per_step / rows[1].seconds_per_step)
  row_of(t, rows, { effects = "all but ground, friction" })
  row_of(t, rows, { effects = "gravity" })
end)

suite:test("throughput and effects of a GPU", { devices = { "cuda" }, tags = "full" },
  function(t)
    local rows, said = bench(t, { "throughput", "--device", "cuda" })
    t:ok(said:find("every precision is where the CPU is", 1, true), said)
    t:ok(said:find("7.89e+09", 1, true), said)
    local row = row_of(t, rows, { lattice = "5x5x5", robots = 132, precision = "compensated" })
    t:ok(row.springs_per_second > 1e8 and row.registers > 0 and row.instructions > 0)
    t:near(row.robot_seconds_per_second, row.robots * 1e-4 / row.seconds_per_step)
    row_of(t, rows, { lattice = "50x50x50", robots = 1 })
    rows = bench(t, { "effects", "--device", "cuda" })
    local springs, all = rows[1], rows[#rows]
    t:ok(springs.instructions < all.instructions, "all effects take no more instructions")
  end)

suite:test("what cannot be measured is refused", function(t)
  local function refused(words, text, status)
    local done = process.ends(t:folder(), { "bench", unpack(words) },
      { before = "CUDA_VISIBLE_DEVICES=" })
    t:equal(done.status, status)
    t:ok(done.stderr:find(text, 1, true), done.stderr)
    t:equal(select(2, done.stderr:gsub("\n", "")), 1)
  end
  refused({ "effect" }, 'unknown bench "effect"; did you mean "effects"?', 2)
  refused({ "effects", "--device", "cuda" }, "device 'cuda': ", 1)
  refused({ "throughput", "--store" }, "--store keeps what a GPU gave", 2)
end)

suite:test("the check knows the bits of a GPU model, and when they change", function(t)
  local materials = engine.materials "paper"
  local found, worst =
    agreement.check(materials, engine.device "cpu", { { 2, 2, 2 } }, { "single", "double" })
  t:equal({ hashes.count(found), worst }, { 2, 0 })
  t:ok(found["2x2x2 single"] ~= found["2x2x2 double"])
  -- where a GPU may be: far less than the least that another law would do
  t:ok(agreement.tolerance("single", bodies.ALL) < 1e-3)
  t:ok(agreement.tolerance("double", bodies.ALL) < 1e-12)

  local model = "Nobody's GPU"
  t:equal(hashes.check(model, found, t:folder()),
    "no stored hash for this GPU model (Nobody's GPU)")
  local folder = t:folder()
  t:equal(hashes.store(model, found, folder), folder .. "/Nobody_s_GPU.json")
  t:ok(hashes.check(model, found, folder):find "^2 of 2 ")
  found["3x3x3 single"] = found["2x2x2 single"]
  t:ok(hashes.check(model, found, folder):find "^2 of 3 ")
  found["2x2x2 single"] = found["2x2x2 double"]
  t:raises("2x2x2 single: the last state has other bits", function()
    hashes.check(model, found, folder)
  end)
end)

return suite
