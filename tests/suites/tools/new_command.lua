--- new_command.lua: `limax new` writes files that run unchanged, and overwrites nothing.

local reader = require "limax.run.reader"
local host = require "limax.host"
local process = require "support.process"
local source = require "limax.base.source"

local suite = require("limax.test").suite "limax new"

local function limax(folder, ...) return process.ends(folder, { ... }) end

suite:test("an experiment that runs", function(t)
  local folder = t:folder()
  local done = limax(folder, "new", "my_walk")
  t:equal({ done.status, done.stderr }, { 0, "" })
  t:ok(done.stdout:find("wrote my_walk.lua; next: ", 1, true)
    and done.stdout:find " run my_walk.lua\n$", done.stdout)
  local text = source.read(folder .. "/my_walk.lua")
  t:ok(text:find('name = "my_walk"', 1, true) and not text:find("NAME", 1, true))
  local run = limax(folder, "run", "my_walk.lua", "-q", "--set", "population=8", "--set",
    "generations=2", "--set", "simulation.duration=0.4")
  t:ok(run.status == 0, run.stderr)
  t:equal(reader.read(folder .. "/runs/my_walk-1").journal:state(), "done")
end)

suite:test("a suite that passes once its goldens are recorded", function(t)
  local folder = t:folder()
  t:ok(host.file.mkdir(folder .. "/tests"))
  local done = limax(folder, "new", "tests/steps.lua", "--suite")
  t:equal({ done.status, done.stderr }, { 0, "" })
  t:ok(done.stdout:find(" test tests/steps.lua --update-golden\n", 1, true), done.stdout)
  local first = limax(folder, "test", "tests/steps.lua")
  t:equal(first.status, 1)
  t:ok(first.stdout:find("there is no golden tests/golden/steps/walk.json", 1, true), first.stdout)
  t:equal(limax(folder, "test", "tests/steps.lua", "--update-golden").status, 0)
  local again = limax(folder, "test", "tests")
  t:ok(again.status == 0, again.stdout)
  t:ok(again.stdout:find "\n%d+ passed, 0 failed", again.stdout)
end)

suite:test("existing files and invalid names are refused", function(t)
  local folder = t:folder()
  local function refused(part, ...)
    process.fails(t, folder, 2, { "new", ... }, part)
  end
  t:ok(host.file.write_atomic(folder .. "/mine.lua", "mine"))
  refused("mine.lua exists already", "mine")
  t:equal(source.read(folder .. "/mine.lua"), "mine")
  refused('"a b" cannot name a run folder', "a b")
  refused('"" cannot name a run folder', "folder/")
  refused("there is no folder nowhere/", "nowhere/walk")
  refused("needs NAME")
end)
