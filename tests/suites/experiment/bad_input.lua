--- bad_input.lua: errors in an experiment, a material file, an option or the disk end
--- in one clear message and exit status 2 (usage, configuration) or 1 (failure), with nothing lost.

local evolution = require "support.evolution"
local host = require "limax.host"
local process = require "support.process"
local source = require "limax.base.source"

local suite = require("limax.test").suite "bad input"

local run = process.ends

suite:test("options, files and fields out of range", function(t)
  local folder = t:folder()
  evolution.script(folder .. "/try.lua")
  for name, text in pairs { nothing = "return 3\n",
    idle = 'local e = require("limax").experiment { fitness = "walk" }\n',
    colon = 'return require("limax"):experiment { fitness = "walk" }\n' } do
    process.write(("%s/%s.lua"):format(folder, name), text)
  end
  process.write(folder .. "/m.json", '{ "name": "m" }')
  evolution.script(folder .. "/bare.lua", 'materials = "m.json"')
  process.write(folder .. "/p.png", "\137PNG\r\n\26\n\0\0\0\rIHDR")
  for _, case in ipairs {
    { "run p.png", 2, "p.png is not a Lua script: it has bytes that are not text" },
    { "run nothing.lua", 2, "nothing.lua returns no experiment" },
    { "idle.lua", 0, "idle.lua made an experiment and did nothing with it" },
    { "colon.lua", 2, "write limax.experiment { ... }, with a dot" },
    { "run bare.lua", 2, 'm.json: schema: is missing; expected "limax.materials/1"' },
    { "run try.lua --repetition 2", 2, "the experiment has 1" },
    { "run try.lua --changed", 2, "--changed belongs to --resume" },
    { "run try.lua --together --apart", 2, "exclude each other" },
    { "run try.lua --resume r", 2, "leave out try.lua" },
    { "run --resume r", 2, "r is not a run folder" },
    { "run try.lua --out try.lua", 2, "try.lua is a file" },
    { "run try.lua --out /proc/limax/r", 2, "cannot make the folder" },
  } do
    local words = {}
    for word in case[1]:gmatch "%S+" do words[#words + 1] = word end
    process.fails(t, folder, case[2], words, case[3])
  end
  t:ok(not host.file.exists(folder .. "/runs"), "a refused run left a folder")
end)

suite:test("material files", function(t)
  local folder = t:folder()
  evolution.script(folder .. "/try.lua", 'materials = "mine.json"')
  assert(host.file.mkdir(folder .. "/inner"))
  process.fails(t, folder .. "/inner", 2, { "run", "../try.lua" },
    ("no file mine.json in %s/inner, nor beside the experiment in %s"):format(folder, folder))
  local good = source.read(host.home .. "/materials/paper.json")
  local text = good:gsub('"stiffness": *[%d%.e+]+', '"stiffness": -5', 1)
  process.write(folder .. "/mine.json", text)
  process.fails(t, folder, 2, { "run", "try.lua" }, "stiffness", "mine.json")
  process.write(folder .. "/mine.json", good)
  t:equal(run(folder, { "run", "try.lua", "-q" }).status, 0)
end)

suite:test("the next free folder is taken and printed, one that is used is refused", function(t)
  local folder = t:folder()
  evolution.script(folder .. "/try.lua")
  for n = 1, 2 do
    local done = run(folder, { "run", "try.lua" })
    t:equal(done.status, 0)
    t:ok(done.stdout:find("Run folder: runs/try-" .. n, 1, true), done.stdout)
    t:ok(done.stdout:find("fitness: distance, m: |r(T) - r(0)|", 1, true), done.stdout)
  end
  local before = source.read(folder .. "/runs/try-1/r01/metrics.jsonl")
  process.fails(t, folder, 2, { "run", "try.lua", "--out", "runs/try-1" }, "try-1 is used already")
  t:equal(source.read(folder .. "/runs/try-1/r01/metrics.jsonl"), before)
end)

suite:test("too little memory: no folder, and no advice to resume an empty one", function(t)
  local folder = t:folder()
  -- the genomes need 4 TB
  evolution.script(folder .. "/wide.lua", "population = 1e6, genome = { hidden = { 1024, 1024 } }")
  process.fails(t, folder, 2, { "run", "wide.lua", "--out", "r" },
    "a population of 1000000 robots on a lattice of 2x2x2 voxels needs")
  t:equal(host.file.exists(folder .. "/r"), nil)
  evolution.script(folder .. "/later.lua", [[fitness = function()
    require("limax.engine.fault").throw { kind = "memory", text = "it is full" }
  end]])
  local done = run(folder, { "run", "later.lua", "-q", "--out", "r" })
  t:equal(done.status, 1)
  t:ok(done.stderr:find "limax: it is full\nno generation is complete: begin again with a smaller",
    done.stderr)
end)

suite:test("a full disk: one message, and whole generations stay", function(t)
  local folder = t:folder()
  evolution.script(folder .. "/try.lua", "genome = { hidden = { 4 } }, generations = 40")
  -- a limit on the size of a file, in blocks of 512 bytes, acts like a full disk
  local done = run(folder, { "run", "try.lua", "--out", "r" },
    { before = "trap '' XFSZ; ulimit -f 60;" })
  process.failed(t, done, 1, "cannot append to r/")
  t:ok(done.stderr:find "is on disk; continue with: [^\n]*limax run %-%-resume r", done.stderr)
  -- nothing is wrong with the script
  t:ok(not done.stderr:find("repaired", 1, true), done.stderr)
  local text = source.read(folder .. "/r/r01/metrics.jsonl")
  t:ok(#text > 0 and text:sub(-1) == "\n")
  -- with space again it continues
  t:equal(run(folder, { "run", "--resume", "r", "-q" }).status, 0)
  t:equal(run(folder, { "run", "try.lua", "--out", "whole", "-q" }).status, 0)
  evolution.same_files(t, folder .. "/r", folder .. "/whole", { "r01/metrics.jsonl" })
end)
