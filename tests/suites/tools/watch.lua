--- watch.lua: `limax watch` on runs that are done, in progress and locked.

local evolution = require "support.evolution"
local host = require "limax.host"
local process = require "support.process"
local source = require "limax.base.source"

local suite = require("limax.test").suite "watch"

local run = evolution.run

-- An experiment of two repetitions.
local TWICE = [[
return require("limax").experiment { name = "twice", fitness = "distance", lattice = { 2, 2, 2 },
  population = 6, generations = 3, repetitions = 2,
  simulation = { duration = 0.4, settle = 0.1, accuracy = "preview" } }
]]

-- Every file of a folder as one text.
local function contents(folder)
  local parts = {}
  for _, name in ipairs(host.file.list(folder)) do
    local path = folder .. "/" .. name
    if host.file.exists(path) == "folder" then
      parts[#parts + 1] = contents(path)
    else
      parts[#parts + 1] = path .. "\n" .. source.read(path)
    end
  end
  return table.concat(parts, "\n")
end

suite:test("curves and the best are printed, and no file is changed", function(t)
  local base = t:folder()
  assert(host.file.write_atomic(base .. "/twice.lua", TWICE))
  process.completes(t, base, { "run", "twice.lua", "-q", "--out", "r" })
  local before = contents(base .. "/r")
  -- as the run itself locks it
  local lock = assert(host.file.lock(base .. "/r/journal.jsonl"))
  local done = process.ends(base, { "watch", "r" }, { before = "export TERM=dumb;" })
  lock:free()
  t:ok(done.status == 0, done.stderr)
  t:equal(contents(base .. "/r"), before)
  local best = -math.huge
  for _, line in ipairs(evolution.metrics(base .. "/r")) do
    if line.generation == 2 then best = math.max(best, line.best_standard or line.best) end
  end
  for _, text in ipairs { "running   generation 6 of 6", ("best %.4g"):format(best),
    "fitness (m), the median of 2 repetitions", "** best   oo mean",
    "lowest layer first" } do
    t:ok(done.stdout:find(text, 1, true), text .. "\n" .. done.stdout)
  end
  t:ok(not done.stdout:find "[\128-\255\27]", "ASCII where the terminal is dumb")
end)

suite:test("on a terminal it follows a run to its end", { limit = 120 }, function(t)
  if os.execute "command -v script >/dev/null 2>&1" ~= 0 then
    t:skip "script is not installed (Debian: bsdutils)"
  end
  local base = t:folder()
  run(base .. "/r")
  local folder = base .. "/r"
  local path = folder .. "/journal.jsonl"
  local whole = source.read(path)
  -- a run in its first generation, which ends when that has been shown
  assert(host.file.write_atomic(path, whole:match "^[^\n]*\n[^\n]*\n"))
  local lock = assert(host.file.lock(path))
  assert(host.file.write_atomic(base .. "/rest", (whole:gsub("^[^\n]*\n[^\n]*\n", ""))))
  local line = ("cd %s && (for look in $(seq 1000); do "
    .. "grep -q 'generation 1 of 3' typed 2>/dev/null && break; sleep 0.1; done; "
    .. "cat r/journal.jsonl rest >all; mv all r/journal.jsonl) & cd %s && "
    .. "timeout 110 script -qefc %s typed >/dev/null 2>&1 </dev/null; echo $?"):format(
    process.quote(base), process.quote(base),
    process.quote(process.quote(host.executable) .. " watch r --every 0.1"))
  local pipe = io.popen(line)
  t:equal(tonumber(pipe:read "*a"), 0)
  pipe:close()
  lock:free()
  local typed = source.read(base .. "/typed")
  local begins, ends = typed:find("generation 1 of 3", 1, true),
    typed:find("generation 3 of 3", 1, true)
  t:ok(begins and ends and begins < ends, typed)
  -- once more if it read between the two files
  local _, screens = typed:gsub("\27%[H\27%[2J", "")
  t:ok(screens == 2 or screens == 3, typed)
end)

suite:test("a run without a generation, and a folder that is not a run", function(t)
  local base = t:folder()
  run(base .. "/r")
  local path = base .. "/r/journal.jsonl"
  assert(host.file.write_atomic(path, source.read(path):match "^[^\n]*\n"))
  local done = process.ends(base, { "watch", "r" })
  t:equal(done.status, 0)
  t:ok(done.stdout:find("no generation has been scored yet", 1, true), done.stdout)
  process.fails(t, base, 1, { "report", "r" }, "nothing to report")
  process.fails(t, base, 2, { "watch", "nothing" }, "nothing is not a run folder")
end)

return suite
