--- damaged.lua: commands on run folders with a damaged field, a pipe or a link: one message with
--- file, line and field, no traceback, and nothing is changed elsewhere.

local evolution = require "support.evolution"
local host = require "limax.host"
local process = require "support.process"
local sealed = require "limax.base.sealed"
local source = require "limax.base.source"

local suite = require("limax.test").suite "damaged"

local SCRIPT = [[
local limax = require "limax"
return limax.experiment { name = "tiny", fitness = "distance", lattice = { 2, 2, 2 },
  population = 6, generations = 3, repetitions = 1, supervisor = "random",
  simulation = { duration = 0.2, settle = 0.05, accuracy = "preview" } }
]]

local function shell(command, ...)
  local words = { ... }
  for k, word in ipairs(words) do words[k] = process.quote(word) end
  assert(os.execute(command:format(unpack(words))) == 0, command)
end

suite:test("a resume names the field of a damaged configuration", { limit = 20 }, function(t)
  local base = t:folder()
  assert(host.file.write_atomic(base .. "/tiny.lua", SCRIPT))
  process.completes(t, base, { "run", "tiny.lua", "--out", "r", "-q", "--device", "cpu" })
  local text = source.read(base .. "/r/config.json"):gsub('"overrides": %[%]', '"overrides": 7')
  assert(host.file.write_atomic(base .. "/r/config.json", text))
  local done = process.ends(base, { "run", "--resume", "r", "-q", "--device", "cpu" })
  t:equal({ done.status, done.stderr },
    { 1, "limax: r/config.json: run.overrides: expected a list of texts, got 7\n" })
  assert(host.file.write_atomic(base .. "/r/config.json",
    (text:gsub('"overrides": 7', '"overrides": []'):gsub('"population": 6', '"population": 8'))))
  done = process.ends(base, { "run", "--resume", "r", "-q", "--device", "cpu" })
  t:equal(done.status, 2)
  t:ok(done.stderr:find("limax: r/config.json was changed since it was sealed", 1, true),
    done.stderr)
end)

-- A line from somebody else may match its hash and still be no line of a run.
suite:test("a sealed line with a wrong field is named", { limit = 20 }, function(t)
  local base = t:folder()
  evolution.run(base .. "/r")
  local path = base .. "/r/journal.jsonl"
  for line, problem in pairs {
    ['{"kind":"generation","evaluations":-1}'] = "evaluations: expected a whole number from 0",
    ['{"kind":"end","at":0,"state":"done","ended":"now"}'] = "does not follow the lines",
    ['{"kind":"end","at":0,"state":"fine","ended":"now"}'] = 'state: expected one of "done"',
    ['{"kind":"other"}'] = "has a kind that limax does not know" } do
    local text = source.read(path)
    assert(host.file.write_atomic(path, text .. sealed.add(line) .. "\n"))
    local done = process.ends(base, { "list", "--check", "r" })
    t:ok(done.status == 1 and done.stdout:find("journal.jsonl, line 6", 1, true)
      and done.stdout:find(problem, 1, true), done.stdout)
    assert(host.file.write_atomic(path, text))
  end
end)

suite:test("a pipe in a folder is named, and does not stop limax list", { limit = 20 }, function(t)
  local base = t:folder()
  evolution.run(base .. "/good")
  for k, file in ipairs { "r01/metrics.jsonl", "journal.jsonl", "config.json" } do
    local run = base .. "/bad" .. k
    shell("cp -r %s/good %s && rm %s/" .. file .. " && mkfifo %s/" .. file, base, run, run, run)
  end
  local done = process.ends(base, { "list", "." })
  t:equal(done.status, 0)
  t:ok(done.stdout:find "good +done" and done.stdout:find "bad1 +damaged", done.stdout)
  t:ok(done.stderr:find("bad1/r01/metrics.jsonl is a link, or no regular file", 1, true),
    done.stderr)
  process.fails(t, base, 2, { "run", "--resume", "bad2" },
    "bad2/journal.jsonl is a link, or no regular file")
end)

suite:test("a link in a folder is refused by every command", { limit = 60 }, function(t)
  local base = t:folder()
  assert(host.file.write_atomic(base .. "/tiny.lua", SCRIPT))
  process.completes(t, base, { "run", "tiny.lua", "--out", "r", "-q", "--device", "cpu" })
  shell("cp %s/tiny.lua %s/kept", base, base)
  for _, place in ipairs { "r01", "r01/robots", "r01/metrics.jsonl", "scripts", "scripts/tiny.lua",
    "config.json", "journal.jsonl", "report.html" } do
    shell("rm -rf %s/bad %s/elsewhere && cp -r %s/r %s/bad", base, base, base, base)
    local path = base .. "/bad/" .. place
    if host.file.exists(path) then
      shell("mv %s %s/elsewhere && ln -s %s/elsewhere %s", path, base, base, path)
    else
      shell("ln -s %s/kept %s", base, path)
    end
    for _, words in ipairs { { "run", "--resume", "bad", "-q", "--device", "cpu", "--changed",
      "--set", "generations=4" }, { "report", "bad", "--no-robots" }, { "list", "--check", "bad" },
      { "convert", "bad", "bad.csv", "--force" } } do
      local done = process.ends(base, words)
      t:ok(done.status > 0, place .. ": " .. table.concat(words, " "))
    end
    t:equal(source.read(base .. "/kept"), SCRIPT)
  end
end)

return suite
