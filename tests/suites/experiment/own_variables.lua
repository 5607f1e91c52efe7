--- own_variables.lua: an experiment whose functions keep results in variables of the script is
--- noted before the run, and again when it continues; one that keeps none is not.

local evolution = require "support.evolution"
local limax = require "limax"

local suite = require("limax.test").suite "own variables"

local archive, seen, count, nested, best = {}, {}, 0, { cells = {} }, nil
local insert, floor, CONSTANT = table.insert, math.floor, { 2, x = 1 }
local function add(list, value) list[#list + 1] = value end
local function tally(value) count = count + value end
local function twice(call) return call(1), call(2) end
function nested:put(value) self.last = value end

local function note_of(fields)
  fields.fitness = fields.fitness or "walk"
  return table.concat(limax.experiment(fields).notes, "\n")
end

for name, case in pairs {
  ["assigned"] = { "best", function(robot) best = robot; return best end },
  ["appended to"] = { "archive", function(robot) archive[#archive + 1] = robot.id end },
  ["passed to table.insert"] = { "archive", function(robot) insert(archive, robot.id) end },
  ["written by a function that it calls"] = { "count", function(robot) return tally(robot.id) end },
  ["passed to a function that writes"] = { "seen", function(robot) add(seen, robot.id) end },
  ["written in a closure"] = { "seen", function(robot)
    twice(function(k) seen[k] = robot.id end)
  end },
  ["a table within a table"] = { "nested", function(robot)
    local cells = nested.cells
    if robot then cells.x = robot.id end
  end },
  ["written by its method"] = { "nested", function(robot) nested:put(robot.id) end },
} do
  suite:test("a variable is noted: " .. name, function(t)
    local note = note_of { fitness = case[2] }
    t:ok(note:find("fitness %(own_variables.lua:%d+%) keeps results in `" .. case[1] .. "`: "),
      note)
    t:ok(note:find("use state = function() return { " .. case[1], 1, true), note)
  end)
end

suite:test("variables that are only read, locals and the state are not noted", function(t)
  local note = note_of {
    state = function() return { list = {}, count = 0 } end,
    fitness = function(robot, state)
      local copy = robot and {} or { archive }
      for k, each in ipairs(archive) do copy[k] = floor(each) + CONSTANT.x + count end
      add(copy, robot.id)
      twice(function(k) copy[k] = k end)
      insert(state.list, archive[1])
      state.count = state.count + #copy
      return state.count, { best = best, seen = #seen }
    end,
    selection = limax.selection.get { "tournament", size = 2 }, survival = { "plus" },
  }
  t:equal(note, "")
end)

suite:test("one note names all functions, and resume repeats it", function(t)
  local function spec(generations)
    return evolution.small { generations = generations, scene = { gravity = true },
      fitness = function(robot) tally(1); return robot:distance() end,
      selection = function(population) best = population; return 1, 1 end }
  end
  count = 0
  local notes, folder = {}, t:folder() .. "/r"
  for k, generations in ipairs { 1, 2 } do
    limax.start(spec(generations), { out = folder, resume = true, changed = true,
      say = function(text) if text:find "variables" then notes[k] = text end end }):finish()
  end
  t:ok(notes[1]:find("^fitness %(own_variables.lua:%d+%) keeps results in `count`, "
    .. "selection %(own_variables.lua:%d+%) in `best`: variables of a script are lost"), notes[1])
  t:ok(notes[2]:find("lost when a run continues; use state = function() return { count = 6 } end",
    1, true), notes[2])
end)
