--- damage.lua: a damaged run folder is never continued silently: every file is verified first, the
--- message names file, line and field, nothing is changed elsewhere, and the run goes on from the
--- last generation that is whole.

local check = require "limax.run.check"
local evolution = require "support.evolution"
local failure = require "limax.base.failure"
local host = require "limax.host"
local process = require "support.process"
local reader = require "limax.run.reader"
local sealed = require "limax.base.sealed"
local source = require "limax.base.source"

local suite = require("limax.test").suite "damage"

local write = process.write

-- Writes an experiment whose fitness has this factor.
local function write_experiment(folder, factor)
  evolution.script(folder .. "/tiny.lua", ([[generations = 5, repetitions = 2,
    genome = { require_muscle = false },
    fitness = function(robot) return %s * robot:distance() end]]):format(factor))
end

local function shell(command, ...)
  local words = { ... }
  for k, word in ipairs(words) do words[k] = process.quote(word) end
  assert(os.execute(command:format(unpack(words))) == 0, command)
end

-- A folder with a run of five generations.
local function make(t)
  local folder = t:folder()
  write_experiment(folder, "1")
  process.completes(t, folder, { "run", "tiny.lua", "-q", "--out", "r" })
  return folder
end

local function flipped(text, place)
  return text:sub(1, place - 1) .. string.char(bit.bxor(text:byte(place), 4)) .. text:sub(place + 1)
end

-- Kinds of damage to a file. Each takes the text and returns another one; nil deletes the file.
local WAYS = {
  deleted = function() return nil end,
  emptied = function() return "" end,
  truncated = function(text) return text:sub(1, math.floor(#text / 2)) end,
  zeroed = function(text) return ("\0"):rep(#text) end,
  ["changed at its start"] = function(text) return flipped(text, 3) end,
  ["changed in the middle"] = function(text) return flipped(text, math.floor(#text / 2)) end,
  ["changed at its end"] = function(text) return flipped(text, #text - 3) end,
  swapped = function(text) return (text:gsub("^([^\n]*\n)([^\n]*\n)", "%2%1")) end,
}

local FILES = { "config.json", "journal.jsonl", "r01/metrics.jsonl", "r02/ledger.jsonl",
  "r01/timing.jsonl", "scripts/tiny.lua", "r01/robots/g0000.npy", "r02/robots/g0004.npy",
  "r02/genomes/g0004.npy", "r01/champions/g0002.json", "r01/B.npy" }

suite:test("of any file is found", function(t)
  local run = make(t) .. "/r"
  t:equal(check.folder(reader.read(run)), {})
  for _, file in ipairs(FILES) do
    local path = run .. "/" .. file
    local text = t:ok(source.read(path))
    for way, change in pairs(WAYS) do
      local changed = change(text)
      if changed then write(path, changed) else host.file.remove(path) end
      local fine, folder = failure.attempt(reader.read, run)
      local found = fine and check.text(check.folder(folder)) or failure.bare(folder)
      -- a journal that is cut is that of a process that was killed: its run is not done
      local is_cut = file == "journal.jsonl" and (way == "emptied" or way == "truncated")
      if changed == text then
        t:equal(found, "") -- an array without a second line
      elseif is_cut then
        t:equal(folder.journal:state(), "stopped")
      else
        t:ok(found:find(file, 1, true), ("%s %s: %s"):format(file, way, found))
      end
      write(path, text)
    end
  end
end)

suite:test("is refused with nothing changed, and the run goes on from what is whole", function(t)
  local folder = make(t)
  local whole, run = folder .. "/r", folder .. "/copy"
  for _, case in ipairs {
    { file = "r02/genomes/g0003.npy", from = 2 },
    { file = "r01/robots/g0001.npy", from = 0 },
    { file = "r02/metrics.jsonl", from = 3 },
  } do
    shell("rm -rf %s && cp -r %s %s", run, whole, run)
    local path = run .. "/" .. case.file
    local text = source.read(path)
    local damaged = flipped(text, math.max(3, #text - 100))
    write(path, damaged)
    local refused = process.ends(folder, { "run", "--resume", "copy", "-q" })
    t:equal(refused.status, 1)
    local from = tonumber(refused.stderr:match "%-%-from (%d+)")
    t:ok(refused.stderr:find(case.file, 1, true) and from == case.from, refused.stderr)
    t:ok(source.read(path) == damaged)
    process.completes(t, folder, { "run", "--resume", "copy", "-q", "--from", tostring(from) })
    for _, name in ipairs { "r01/metrics.jsonl", "r02/ledger.jsonl", "r01/genomes/g0004.npy",
      "r02/robots/g0004.npy" } do
      t:ok(source.read(run .. "/" .. name) == source.read(whole .. "/" .. name), name)
    end
  end
  local listed = process.ends(folder, { "list", "--check", "copy" })
  t:ok(listed.status == 0 and listed.stdout:find "10 generations, undamaged", listed.stdout)
end)

suite:test("a file that cannot be read is not taken for a damaged one", function(t)
  local folder = make(t)
  local path = folder .. "/r/r02/genomes/g0001.npy"
  t:ok(host.file.remove(path) and host.file.mkdir(path))
  local refused = process.ends(folder, { "run", "--resume", "r", "-q", "--from", "0" })
  t:equal({ refused.status, refused.stderr }, { 1, "limax: r is damaged:\n"
    .. "  r02/genomes/g0001.npy could not be read (is not a regular file)\n"
    .. "make every file readable, then continue with: " .. host.executable .. " run --resume r\n" })
end)

-- The new fitness is smaller by a factor of a million: old scores of elites would win for ever.
suite:test("a changed fitness that was interrupted never mixes with the old scores", function(t)
  local folder = make(t)
  write_experiment(folder, '1e-6 * (os.getenv "DIE" and os.execute "kill -9 $PPID" or 1)')
  local killed = process.ends(folder, { "run", "--resume", "r", "-q", "--changed", "--set",
    "generations=8" }, { before = "DIE=1" })
  t:equal(killed.status, 137)
  -- the new configuration is in force, and there is no generation under it
  process.completes(t, folder, { "run", "--resume", "r", "-q" })
  for _, line in ipairs(reader.read(folder .. "/r"):lines("metrics", 1)) do
    if line.generation > 4 then t:ok(line.best < 1e-5, line.best) end
  end
end)

suite:test("a change that a full disk interrupts leaves a run that goes on", function(t)
  local folder = make(t)
  local former = source.read(folder .. "/tiny.lua")
  write(folder .. "/tiny.lua", former .. "-- " .. ("x"):rep(2e6) .. "\n")
  local words = { "run", "--resume", "r", "-q", "--changed" }
  local failed = process.ends(folder, words, { before = "ulimit -f 2000;" })
  t:ok(failed.stderr:find("cannot write r/scripts-2/tiny.lua: File too large", 1, true),
    failed.stderr)
  process.completes(t, folder, { "list", "--check", "r" })
  process.completes(t, folder, words)
  t:ok(source.read(folder .. "/r/scripts/tiny.lua") == former)
  t:ok(not host.file.exists(folder .. "/r/config-3.json"))
  process.completes(t, folder, { "list", "--check", "r" })
end)

suite:test("a folder that a killed process began is used, a taken name is not", function(t)
  local folder = make(t)
  host.file.mkdir(folder .. "/begun/scripts")
  write(folder .. "/begun/journal.jsonl", "")
  process.completes(t, folder, { "run", "tiny.lua", "-q", "--out", "begun" })
  local words = { "run", "tiny.lua", "-q" }
  local first, second = process.start(folder, words), process.start(folder, words)
  t:equal({ first:finish() == 0, second:finish() == 0 }, { true, true })
  t:ok(host.file.exists(folder .. "/runs/try-2"))
end)

suite:test("is named by the commands that read it", function(t)
  local folder = make(t)
  local path = folder .. "/r/r01/metrics.jsonl"
  write(path, (source.read(path):gsub('"best":', '"best": ', 1)))
  for _, words in ipairs { { "compare", "r", "r" }, { "report", "r", "--no-robots" },
    { "picture", "r", "--out", "p.svg" } } do
    process.fails(t, folder, 1, words, "r/r01/metrics.jsonl, line 1: the line of generation 0 does"
      .. " not match its hash in journal.jsonl")
  end
end)

suite:test("a damaged configuration is refused with its field", function(t)
  local base = make(t)
  local path = base .. "/r/config.json"
  local text = source.read(path)
  local function changed(from, to)
    write(path, (text:gsub(from, to)))
    return process.ends(base, { "run", "--resume", "r", "-q" })
  end
  local done = changed('"overrides": %[%]', '"overrides": 7')
  t:equal({ done.status, done.stderr },
    { 1, "limax: r/config.json: run.overrides: expected a list of texts, got 7\n" })
  done = changed('"population": 6', '"population": 8')
  t:equal(done.status, 2)
  t:ok(done.stderr:find("limax: r/config.json was changed since it was sealed", 1, true),
    done.stderr)
end)

-- A line from somebody else may match its hash and still be no line of a run.
suite:test("an array of other robots than the population is refused", function(t)
  local base = t:folder()
  write_experiment(base, 1)
  process.completes(t, base, { "run", "tiny.lua", "-q", "--out", "r", "--repetition", "1" })
  local path = base .. "/r/r01/robots/g0001.npy"
  local text = source.read(path)
  local count = tonumber(text:match "'shape': %((%d+)")
  local function without_one(line)
    local size, row = line:match '"robots":%[(%d+),"%x+",(%d+)%]'
    text = text:gsub("'shape': %(%d+", "'shape': (" .. count - 1, 1):sub(1, size - row)
    return sealed.add((line:gsub('^{"hash":"%x+",', "{"):gsub('"robots":%b[]',
      ('"robots":[%d,"%s",%d]'):format(#text, host.xxh3(text, tonumber(row)), row))))
  end
  write(base .. "/r/journal.jsonl", (source.read(base .. "/r/journal.jsonl"):gsub("[^\n]*\n",
    function(line) return line:find '"generation":1,' and without_one(line) or line end)))
  write(path, text)
  local done = process.ends(base, { "run", "--resume", "r", "--from", "1", "-q" })
  t:ok(done.status == 1 and done.stderr:find(("holds %d robots; the run has %d"):format(count - 1,
    count), 1, true), done.stderr)
end)

suite:test("a sealed line with a wrong field is named", function(t)
  local base = t:folder()
  evolution.run(base .. "/r")
  local path = base .. "/r/journal.jsonl"
  for line, problem in pairs {
    ['{"kind":"generation","evaluations":-1}'] = "evaluations: expected a whole number from 0",
    ['{"kind":"end","at":0,"state":"done","ended":"now"}'] = "does not follow the lines",
    ['{"kind":"end","at":0,"state":"fine","ended":"now"}'] = 'state: expected one of "done"',
    ['{"kind":"other"}'] = "has a kind that limax does not know" } do
    local text = source.read(path)
    write(path, text .. sealed.add(line) .. "\n")
    local done = process.ends(base, { "list", "--check", "r" })
    t:ok(done.status == 1 and done.stdout:find("journal.jsonl, line 6", 1, true)
      and done.stdout:find(problem, 1, true), done.stdout)
    write(path, text)
  end
end)

suite:test("a pipe in a folder is named, and does not stop limax list", function(t)
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

suite:test("a link in a folder is refused by every command", function(t)
  local base = make(t)
  write(base .. "/kept", "kept")
  for _, place in ipairs { "r01", "r01/robots", "r01/metrics.jsonl", "scripts", "scripts/tiny.lua",
    "config.json", "journal.jsonl", "report.html" } do
    shell("rm -rf %s/bad %s/elsewhere && cp -r %s/r %s/bad", base, base, base, base)
    local path = base .. "/bad/" .. place
    if host.file.exists(path) then
      shell("mv %s %s/elsewhere && ln -s %s/elsewhere %s", path, base, base, path)
    else
      shell("ln -s %s/kept %s", base, path)
    end
    for _, words in ipairs { { "run", "--resume", "bad", "-q", "--changed", "--set",
      "generations=6" }, { "report", "bad", "--no-robots" }, { "list", "--check", "bad" },
      { "convert", "bad", "bad.csv", "--force" } } do
      local done = process.ends(base, words)
      t:ok(done.status > 0, place .. ": " .. table.concat(words, " "))
    end
    t:equal(source.read(base .. "/kept"), "kept")
  end
end)

suite:test("what a killed process left is removed when the run goes on", function(t)
  local base = make(t)
  local words = { "run", "tiny.lua", "-q", "--out", "best", "--set", "record.population=best" }
  process.completes(t, base, words)
  local left = { "r01/robots/g0000.npy", "r01/robots/g0007.npy", "r02/genomes/.g0003.npy.7-1.part",
    "scripts/.tiny.lua.7-1.part", "config-2.json", "scripts-2/tiny.lua", ".config.json.7-1.part" }
  host.file.mkdir(base .. "/best/scripts-2")
  for _, file in ipairs(left) do write(base .. "/best/" .. file, "left") end
  process.completes(t, base, { "run", "--resume", "best", "-q" })
  for _, file in ipairs(left) do t:equal(host.file.exists(base .. "/best/" .. file), nil) end
  process.completes(t, base, { "list", "--check", "best" })
end)

suite:test("a process that lost its lock ends before it writes where another one went on",
  function(t)
    local folder = t:folder() .. "/r"
    local run = evolution.small({ generations = 6 })
    local limax = require "limax"
    run = limax.start(run, { out = folder, say = evolution.silent })
    local journal
    local ok, problem = failure.attempt(function()
      for robots in run:generations() do
        if robots.generation == 2 then
          run.folder:settle()
          journal = source.read(folder .. "/journal.jsonl") .. "another process\n"
          write(folder .. "/journal.jsonl", journal)
        end
      end
    end)
    t:ok(not ok and tostring(problem.text):find "journal.jsonl has .*another process wrote it",
      tostring(problem.text))
    t:equal(source.read(folder .. "/journal.jsonl"), journal)
    t:ok(not host.file.exists(folder .. "/r01/champions/g0002.json"))
    run.folder:close()
  end)
