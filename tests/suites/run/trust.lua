--- trust.lua: scripts that a folder of somebody else names run only after `limax trust`, and then
--- only those that the command showed.

local forged = require "support.forged"
local host = require "limax.host"
local process = require "support.process"
local seal = require "limax.base.seal"
local source = require "limax.base.source"

local suite = require("limax.test").suite "trust"

-- An experiment whose script leaves a mark where it runs.
local SCRIPT = [[
local limax = require "limax"
io.open(os.getenv "MARK", "a"):write "x"
return limax.experiment { name = "own", lattice = { 2, 2, 2 }, population = 4, generations = 2,
  repetitions = 1, simulation = { duration = 0.1, settle = 0 }, fitness = "distance" }
]]

-- A folder with a run "r" of another user, whose script is gone unless `keep`; and functions that
-- call limax as this user.
local function foreign(t, keep)
  local base = t:folder()
  local mark, key = base .. "/mark", "LIMAX_KEY_FILE=%s/%s.key MARK=%s/mark"
  local theirs, mine = key:format(base, "theirs", base), key:format(base, "mine", base)
  host.file.mkdir(base .. "/their")
  process.write(base .. "/their/own.lua", SCRIPT)
  process.completes(t, base, { "run", "their/own.lua", "-q", "--out", "r" }, { before = theirs })
  if not keep then host.file.remove(base .. "/their/own.lua") end
  host.file.remove(mark)
  local user = { base = base }
  function user.fails(status, text, ...)
    local done = process.ends(base, { ... }, { before = mine })
    t:ok(done.status == status and done.stderr:find(text, 1, true),
      ("status %s, expected %d and %q: %s"):format(done.status, status, text, done.stderr))
    t:ok(not host.file.exists(mark), "a script has run: " .. text)
    return done
  end
  function user.completes(...) return process.completes(t, base, { ... }, { before = mine }) end
  function user.has_run()
    local has = host.file.exists(mark) ~= nil
    host.file.remove(mark)
    return has
  end
  return user, theirs
end

-- Changes a document as a stranger would, who cannot seal it.
local function forge(user, from, to)
  forged.text(user.base .. "/r", "config.json", function(text)
    return (seal.without(text):gsub(from, function() return to end))
  end)
end

local MORE = { "run", "--resume", "r", "-q", "--changed", "--set", "generations=3" }

suite:test("a folder of another key runs after it was trusted", function(t)
  local user = foreign(t)
  user.fails(2, "its script would run with your rights. Look at it and trust it: limax trust r",
    unpack(MORE))
  local shown = user.completes("trust", "--yes", "r").stdout
  for _, text in ipairs { "runs      r/scripts/own.lua", "their/own.lua (not there)",
    "sealed with key " } do
    t:ok(shown:find(text, 1, true), shown)
  end
  local sealed = source.read(user.base .. "/r/config.json")
  local journal = source.read(user.base .. "/r/journal.jsonl")
  forge(user, '"seed": %d+', '"seed": 5')
  user.fails(2, "is not sealed", unpack(MORE))
  process.write(user.base .. "/r/config.json", (sealed:gsub('"seed": %d+', '"seed": 5')))
  user.fails(2, "was changed since it was sealed", unpack(MORE))
  process.write(user.base .. "/r/config.json", sealed)
  process.write(user.base .. "/r/journal.jsonl", journal)
  process.write(user.base .. "/r/scripts/new.lua", "")
  user.fails(2, "new.lua is not one of the scripts that ran", "trust", "--yes", "r")
  user.fails(2, "new.lua is not one of the scripts that ran", unpack(MORE))
  host.file.remove(user.base .. "/r/scripts/new.lua")
  user.completes(unpack(MORE))
  t:ok(user.has_run())
end)

suite:test("a script runs only as it was recorded", function(t)
  local user = foreign(t, true)
  user.completes("trust", "--yes", "r")
  local path = user.base .. "/their/own.lua"
  process.write(path, SCRIPT .. " ")
  user.fails(2, "own.lua has changed", "run", "--resume", "r", "-q")
  -- a path that depends on who reads it is not where the script was
  process.write(user.base .. "/own.lua", SCRIPT)
  for _, other in ipairs { "/proc/self/cwd/own.lua", user.base .. "/r/../own.lua" } do
    forge(user, '"path": "[^"]*"', ('"path": "%s"'):format(other))
    t:ok(user.completes("trust", "--yes", "r").stdout:find("(not there)", 1, true), other)
    local done = user.completes("run", "--resume", "r", "--changed", "--set", "generations=2")
    t:ok(done.stderr:find("continuing with the copy r/scripts", 1, true), done.stderr)
    user.has_run()
  end
  forge(user, '"file": "own.lua"', '"file": "../own.lua"')
  user.fails(1, "run.scripts[1].file: expected a path below this folder", "watch", "r")
end)

suite:test("a sweep of another key is neither continued nor extended", function(t)
  local user, theirs = foreign(t, true)
  local base = user.base
  local plan = { "sweep", "their/own.lua", "-q", "--set", "seed=1,2", "--out", "s" }
  process.completes(t, base, plan, { before = theirs })
  user.has_run()
  for _, words in ipairs { { "--resume", "s" }, { "--resume", "s", "--run", "1" } } do
    user.fails(2, "s was sealed with key ", "sweep", unpack(words))
  end
  process.ends(base, plan, { before = theirs:gsub("theirs", "mine") })
  t:ok(user.has_run(), "the named file runs")
  t:equal(source.read(base .. "/s/study.json"):match '"key": "(%x+)"',
    host.sha256((host.file.read_private(base .. "/theirs.key"):gsub("\n", ""))):sub(1, 8))
  -- nothing is written elsewhere
  host.file.mkdir(base .. "/elsewhere")
  for _, link in ipairs { "s/report.html", "s/.locks/1" } do
    host.file.remove(base .. "/" .. link)
    os.execute(("ln -s %s/elsewhere/file %s/%s"):format(base, base, link))
    user.fails(2, link .. " is a link", "report", "s", "--no-robots")
    host.file.remove(base .. "/" .. link)
  end
  local text = source.read(base .. "/s/study.json")
  process.write(base .. "/s/study.json", (text:gsub('"path": "seed=1/r01"', '"path": "../r"')))
  user.fails(1, "runs[1].path: expected a path below this folder", "report", "s", "--no-robots")
  t:equal(#host.file.list(base .. "/elsewhere"), 0)
end)

suite:test("a damaged champion is no result", function(t)
  local user = foreign(t)
  local champion = user.base .. "/r/r01/champions/g0001.json"
  process.write(champion, (source.read(champion):gsub('"score": [%d.e-]+', '"score": 99')))
  for _, words in ipairs { { "modes", "r" }, { "convert", "r", "x.json" } } do
    user.fails(1, "g0001.json", unpack(words))
  end
end)
