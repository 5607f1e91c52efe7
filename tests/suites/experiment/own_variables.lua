--- own_variables.lua: a run warns once, after its first generation, of functions that keep results
--- in variables of the script, and again when it continues.

local evolution = require "support.evolution"
local limax = require "limax"

local suite = require("limax.test").suite "own variables"

local archive, seen, count, best = {}, {}, 0, nil
local insert, CONSTANT = table.insert, { 2, x = 1 }
local function add(list, value) list[#list + 1] = value end
local function tally(value) count = count + value end

-- The notes on variables of a run.
local function notes_of(fields, options)
  local notes = {}
  options = options or {}
  function options.say(text) if text:find "variables" then insert(notes, text) end end
  fields.simulation = { duration = 0.2, settle = 0.05, accuracy = "preview" }
  limax.start(evolution.small(fields), options):finish()
  return notes
end

for name, case in pairs {
  ["assigned"] = { "best", function(robot) best = robot; return best:distance() end },
  ["a new entry"] = { "archive", function(robot) add(archive, robot); return robot:distance() end },
  ["a changed entry"] = { "seen", function(robot) seen.last = robot; return robot:distance() end },
  ["assigned by a function that it calls"] = { "count", function(robot)
    tally(1)
    return robot:distance()
  end },
} do
  suite:test("a variable is noted: " .. name, function(t)
    local notes = notes_of { generations = 2, fitness = case[2] }
    t:equal(#notes, 1)
    t:ok(notes[1]:find("fitness %(own_variables.lua:%d+%) keeps results in `" .. case[1] .. "`: "),
      notes[1])
    t:ok(notes[1]:find("use state = function() return { " .. case[1], 1, true), notes[1])
  end)
end

suite:test("variables that are only read, locals and the state are not noted", function(t)
  t:equal(notes_of { generations = 2,
    state = function() return { list = {}, count = 0 } end,
    fitness = function(robot, state)
      local copy = { CONSTANT.x + count, best, #seen }
      for k, each in ipairs(archive) do copy[k] = each end
      add(copy, robot.id)
      insert(state.list, robot.id)
      state.count = state.count + #copy
      return robot:distance()
    end,
    selection = limax.selection.get { "tournament", size = 2 }, survival = { "plus" },
  }, {})
end)

suite:test("one note names all functions, and resume repeats it", function(t)
  local function spec(generations)
    return { generations = generations, scene = { gravity = true },
      fitness = function(robot) tally(1); return robot:distance() end,
      selection = function(population) best = population; return 1, 1 end }
  end
  count = 0
  local folder = t:folder() .. "/r"
  local notes = notes_of(spec(2), { out = folder })
  t:ok(notes[1]:find("^fitness %(own_variables.lua:%d+%) keeps results in `count`, "
    .. "selection %(own_variables.lua:%d+%) in `best`: variables of a script are lost"), notes[1])
  t:ok(notes[1]:find("lost when a run continues; use state = function() return { count = 0 } end",
    1, true), notes[1])
  count = 5
  notes = notes_of(spec(3), { out = folder, resume = true, changed = true })
  t:ok(notes[1]:find("use state = function() return { count = 5 } end", 1, true), notes[1])
end)
