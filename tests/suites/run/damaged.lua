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
  t:equal(done.status, 1)
  t:ok(done.stderr:find("limax: r/config.json was edited or damaged", 1, true), done.stderr)
end)

-- A file from somebody else may match its hash and still be no file of a run.
suite:test("a sealed file with a wrong field is named", { limit = 20 }, function(t)
  local base = t:folder()
  evolution.run(base .. "/r")
  local text = '{"schema":"limax.checkpoint/1","repetition":1,"generation":0,"bytes":7}\n'
  assert(host.file.write_atomic(base .. "/r/checkpoint", sealed.add(text)))
  local done = process.ends(base, { "list", "--check", "r" })
  t:equal({ done.status, done.stdout },
    { 1, "r is damaged:\n  checkpoint is invalid: bytes: expected a table, got 7\n" })
end)

suite:test("a pipe in a folder is named, and does not stop limax list", { limit = 20 }, function(t)
  local base = t:folder()
  evolution.run(base .. "/good")
  for k, file in ipairs { "metrics.jsonl", "STATUS", "config.json" } do
    local run = base .. "/bad" .. k
    shell("cp -r %s/good %s && rm %s/" .. file .. " && mkfifo %s/" .. file, base, run, run, run)
  end
  local done = process.ends(base, { "list", "." })
  t:equal(done.status, 0)
  t:ok(done.stdout:find "good +done" and done.stdout:find "bad1 +damaged", done.stdout)
  t:ok(done.stderr:find("bad1/metrics.jsonl: is not a regular file", 1, true), done.stderr)
  done = process.ends(base, { "run", "--resume", "bad2" })
  t:equal({ done.status, done.stderr }, { 1, "limax: bad2/STATUS: is not a regular file\n" })
end)

suite:test("a resume writes through no link", { limit = 20 }, function(t)
  local base = t:folder()
  assert(host.file.write_atomic(base .. "/tiny.lua", SCRIPT))
  process.completes(t, base, { "run", "tiny.lua", "--out", "r", "-q", "--device", "cpu" })
  shell("mkdir %s/elsewhere && mv %s/r/r01/population %s/elsewhere/ "
    .. "&& ln -s ../../elsewhere/population %s/r/r01/population", base, base, base, base)
  local kept = base .. "/elsewhere/population/g0099.jsonl"
  assert(host.file.write_atomic(kept, "kept"))
  process.completes(t, base, { "run", "--resume", "r", "-q", "--device", "cpu" })
  t:equal(host.file.exists(kept), "file")
  -- nor does it write there
  local more = { "run", "--resume", "r", "-q", "--changed", "--set", "generations=4" }
  shell("ln -s ../../kept %s/elsewhere/population/g0003.npy && echo kept >%s/kept", base, base)
  shell("rm %s/r/scripts/tiny.lua && ln -s ../../tiny.lua %s/r/scripts/", base, base)
  shell("ln %s/tiny.lua %s/script", base, base)
  process.completes(t, base, more)
  shell("rm %s/r/STATUS && ln -s ../kept %s/r/STATUS", base, base)
  local refused = process.ends(base, more)
  t:equal(refused.status, 1)
  t:ok(refused.stderr:find("r/STATUS is a link: a run is not continued", 1, true), refused.stderr)
  t:equal(source.read(base .. "/kept"), "kept\n")
  -- the name still refers to the same file
  shell("test %s/tiny.lua -ef %s/script", base, base)
end)

return suite
