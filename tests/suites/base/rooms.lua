--- rooms.lua: a room of the library requires only files of its own and of the rooms before it, all
--- of them exist, and no files require each other in a cycle.

local host = require "limax.host"
local source = require "limax.base.source"

local suite = require("limax.test").suite "rooms"

-- From the ground up. limax.lua is the module `limax`, main.lua the command line.
local ROOMS = { "bindings/engine/", "scripts/lib/base/", "scripts/lib/settings/",
  "scripts/lib/robot/", "scripts/lib/run/", "scripts/lib/supervise/", "scripts/lib/experiment/",
  "scripts/lib/evolution/", "scripts/lib/draw/", "scripts/lib/limax.lua", "scripts/lib/tools/",
  "scripts/commands/", "scripts/lib/main.lua" }

-- Modules whose file is not named by the module.
local PUBLIC = { ["limax"] = "scripts/lib/limax.lua",
  ["limax.engine"] = "bindings/engine/engine.lua",
  ["limax.archive"] = "scripts/lib/experiment/archive.lua",
  ["limax.control"] = "scripts/lib/settings/control.lua",
  ["limax.fitness"] = "scripts/lib/experiment/fitness.lua",
  ["limax.scenes"] = "scripts/lib/settings/scenes.lua",
  ["limax.selection"] = "scripts/lib/experiment/selection.lua",
  ["limax.supervise"] = "scripts/lib/supervise/supervise.lua",
  ["limax.survival"] = "scripts/lib/experiment/survival.lua",
  ["limax.encoding"] = "scripts/lib/experiment/encoding.lua",
  ["limax.variation"] = "scripts/lib/experiment/variation.lua",
  ["limax.test"] = "scripts/lib/tools/test/test.lua" }

local function file_of(module)
  local rest = module:match "^limax%.(.*)$"
  if PUBLIC[module] or not rest or rest == "host" then return PUBLIC[module] end
  if rest:match "%.$" then return nil end -- the beginning of a name
  local folder = rest:match "^engine%." and "bindings/" or rest:match "^commands%." and "scripts/"
    or "scripts/lib/"
  return folder .. rest:gsub("%.", "/") .. ".lua"
end

local function rank_of(file)
  for rank, room in ipairs(ROOMS) do
    if file:sub(1, #room) == room then return rank end
  end
  error("no room for " .. file)
end

-- The requires of every file: { file = , line = , to = }, by file.
local function read_requires()
  local requires = {}
  local function visit(path)
    for _, name in ipairs(host.file.list(host.home .. "/" .. path) or {}) do
      visit(path .. "/" .. name)
    end
    if not path:match "%.lua$" then return end
    local list, number = {}, 0
    for line in (source.read(host.home .. "/" .. path) .. "\n"):gmatch "(.-)\n" do
      number = number + 1
      local code = line:gsub("^%s*%-%-.*", "")
      local module = code:match "require%(?%s*[\"'](limax[%w_%.]*)[\"']"
      local to = module and file_of(module)
      if to then list[#list + 1] = { line = ("%s:%d: %s"):format(path, number, line), to = to } end
    end
    requires[path] = list
  end
  visit "scripts/lib"
  visit "scripts/commands"
  visit "bindings/engine"
  return requires
end

suite:test("every required file exists, in no later room, and there is no cycle", function(t)
  local requires, state = read_requires(), {}
  local function visit(file, path)
    state[file] = "open"
    for _, each in ipairs(requires[file]) do
      t:ok(requires[each.to], "no such file: " .. each.line)
      t:ok(rank_of(each.to) <= rank_of(file), each.line)
      local whole = path .. "\n" .. each.line
      t:ok(state[each.to] ~= "open", "a cycle:" .. whole)
      if not state[each.to] then visit(each.to, whole) end
    end
    state[file] = "done"
  end
  for file in pairs(requires) do
    if not state[file] then visit(file, "") end
  end
end)
