--- report_foreign.lua: `limax report`, `watch`, `list`, `compare` and `picture` on run folders that
--- are damaged, from another version or malicious: a damaged file is named, nothing is executed.

local csv = require "limax.base.csv"
local evolution = require "support.evolution"
local failure = require "limax.base.failure"
local forged = require "support.forged"
local host = require "limax.host"
local page = require "limax.tools.report.page"
local process = require "support.process"
local runs = require "limax.tools.report.runs"
local source = require "limax.base.source"

local suite = require("limax.test").suite "report_foreign"

local function run(folder, fields)
  fields = fields or {}
  fields.supervisor = "random"
  return evolution.run(folder, fields)
end

-- A field of a file set to something else, or taken away where `value` is nil.
local function setter(name, value)
  return function(entry)
    local outer, inner = name:match "^(.*)%.(.*)$"
    entry = outer and entry[outer] or entry
    entry[inner or name] = value
  end
end

-- A file of a run folder, a field of its first line or of the whole, a wrong value, and what the
-- message says after the file's name.
local METRICS = "r01/metrics.jsonl"
local DAMAGE = {
  { METRICS, "best", "x", ", line 1: best: expected a number from -1e+150 to 1e+150" },
  { METRICS, "champion.id", {}, ", line 1: champion.id: expected a whole number" },
  { METRICS, "parameters", nil, ", line 1: parameters: is missing; expected a table" },
  { METRICS, "generation", 5, ", line 1: generation: expected 0 of repetition 1" },
  { "r01/ledger.jsonl", "entries", { { field = 5 } },
    ", line 1: entries[1].field: expected a text" },
  { "r01/timing.jsonl", "seconds.simulate", "1",
    ", line 1: seconds.simulate: expected a number" },
  { "config.json", "generations", "x", ": generations: expected a whole number from 1" },
  { "config.json", "fitness", { 1 }, ": fitness: expected a name, or a table with" },
}

suite:test("a damaged field ends a command with file, line and field", function(t)
  local base = t:folder()
  run(base .. "/whole")
  for k, damage in ipairs(DAMAGE) do
    local file, field, value, expected = unpack(damage, 1, 4)
    local folder = ("%s/%d"):format(base, k)
    assert(os.execute(("cp -r %s/whole %s"):format(process.quote(base),
      process.quote(folder))) == 0)
    forged.object(folder, file, setter(field, value))
    local _, caught = failure.attempt(function()
      return page.text(runs.read_all { folder }, { robots = true })
    end)
    local message = tostring(caught)
    local place = ("%s/%s%s"):format(folder, file, expected)
    t:ok(failure.is_damaged(caught) and message:find(place, 1, true), k .. ": " .. message)
    t:ok(not message:find "%c", message)
  end
  local done = process.ends(base, { "list", "." })
  t:ok(done.status == 0, done.stderr)
  t:equal(select(2, done.stdout:gsub("\n", "")), #DAMAGE + 2)
  t:ok(not done.stdout:find("attempt", 1, true), done.stdout)
end)

suite:test("a damaged run is listed as damaged, with the reason", function(t)
  local base = t:folder()
  run(base .. "/good")
  run(base .. "/spoiled")
  forged.text(base .. "/spoiled", METRICS, function(text) return (text:gsub("^{", "[")) end)
  local done = process.ends(base, { "list", base })
  t:equal(done.status, 0)
  t:ok(done.stdout:find "/spoiled +damaged" and done.stdout:find "/good +done", done.stdout)
  local reason = ("limax: %s/spoiled/r01/metrics.jsonl, line 1: column"):format(base)
  t:ok(done.stderr:find(reason, 1, true), done.stderr)
  done = process.ends(base, { "list", "--check", base })
  -- its bytes are those that the journal names
  t:equal(done.status, 0)
  assert(host.file.write_atomic(base .. "/spoiled/" .. METRICS, "{]\n"))
  done = process.ends(base, { "list", "--check", base })
  t:equal({ done.status, done.stderr }, { 1, "limax: 1 of 2 run folders is damaged\n" })
  t:ok(done.stdout:find "/spoiled is damaged" and done.stdout:find "/good: 3", done.stdout)
end)

suite:test("no control character reaches a terminal", function(t)
  local base = t:folder()
  local folder = run(base .. "/r\27[2J\n<b>'\"&")
  forged.object(folder, "config.json", setter("name", "a\27[2Jb\194\155c\nd"))
  forged.object(folder, "config.json", setter("supervisor", { name = "\27]0;x\7" }))
  local function clean(status, ...)
    local done = process.ends(base, { ... }, { before = "export NO_COLOR=1;" })
    local text = done.stdout .. done.stderr
    t:ok(done.status == status and #text > 0, (...) .. ": " .. text)
    t:ok(not text:find "[%z\1-\8\11-\31\127]" and not text:find("\194\155", 1, true), text)
    return done
  end
  clean(0, "compare", folder)
  t:ok(host.json.decode(clean(0, "compare", folder, "--json").stdout))
  clean(0, "picture", folder, "--out", "x.svg")
  clean(0, "watch", folder, "--once")
  clean(0, "list", base)
  clean(0, "report", folder, "--no-robots", "--out", "x.html")
  t:ok(not source.read(base .. "/x.html"):find("<b>", 1, true))
  forged.object(folder, "r01/champions/g0002.json", setter("key\27[2J", 1))
  clean(1, "picture", folder, "--out", "x.svg")
  evolution.script(base .. "/own.lua", [=[population = 20,
    fitness = function(robot) if robot.id == 30 then error "\27]0;x\7" end return 7 end]=])
  clean(0, "run", "own.lua", "--out", "own\27c")
end)

suite:test("a name that a spreadsheet would take for a formula is text in CSV", function(t)
  local base = t:folder()
  local folder = run(base .. "/r", { supervisor = "fixed" })
  for _, name in ipairs { "=1+1", "@SUM(A1)", "+x", "-x" } do
    forged.object(folder, "config.json", setter("supervisor", { name = name }))
    local done = process.completes(t, base, { "compare", folder, "--csv" })
    t:ok(done.stdout:find("\n'" .. name .. ",1,", 1, true), done.stdout)
  end
  t:equal(csv.encode({ "a", "b" }, { { a = -1, b = "-1.5" } }), "a,b\n-1,-1.5\n")
end)

suite:test("a file that cannot be written is reported", function(t)
  local base = t:folder()
  run(base .. "/r")
  assert(host.file.mkdir(base .. "/r/r01.html"))
  for _, words in ipairs { { "report", "r", "--no-robots", "--out", "r/r01.html" },
    { "report", "r", "--no-robots", "--figures", "r/config.json/x" },
    { "picture", "r", "--out", "none/x.mp4" } } do
    local done = process.fails(t, base, 1, words)
    t:ok(done.stderr:match "^limax: [^\n]+\n$", done.stderr)
  end
  process.fails(t, base, 2, { "report", "r", "--out", "page.pdf" }, "its name must end in .html")
  assert(os.remove(base .. "/r/r01/champions/g0002.json"))
  process.fails(t, base, 1, { "picture", "r", "--out", "x.png" }, "g0002.json: No such file")
end)
