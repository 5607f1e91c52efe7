--- survival.lua: the survivors of a generation, and the state of a script: functions receive it,
--- resume restores it, and some values are refused.

local limax = require "limax"
local evolution = require "support.evolution"

local suite = require("limax.test").suite "survival"

local finished = evolution.finished

suite:test("generational keeps no robot, plus the best, which are the only parents", function(t)
  local history = finished { survival = "generational" }
  for _, entry in ipairs(history) do
    for _, robot in ipairs(entry.population) do t:ok(robot.origin ~= "elite") end
  end
  history = finished { survival = { "plus", share = 0.5 } }
  for k = 2, #history do
    local before, now, may = history[k - 1].population, history[k].population, {}
    for e = 1, 3 do
      t:equal(now[e].id, before[before.ranked[e]].id)
      may[now[e].id] = true
    end
    for i = 4, 6 do
      t:equal(now[i].origin, "bred")
      for _, parent in ipairs(now[i].parents) do t:ok(may[parent], "a parent survived") end
    end
  end
end)

suite:test("a function chooses survivors and parents", function(t)
  local history = finished {
    survival = function(robots, random, state)
      state.asked = state.asked + random:integer(1)
      return { robots.ranked[#robots.ranked] }, { robots.ranked[1] }
    end,
    state = function() return { asked = 0 } end,
  }
  for k = 2, #history do
    local before, now = history[k - 1].population, history[k].population
    t:equal(now[1].id, before[before.ranked[#before.ranked]].id)
    local best = before[before.ranked[1]].id
    t:equal(now[2].parents, { best, best })
  end
end)

suite:test("a wrong list ends the run with the place in it", function(t)
  local function refused(message, result)
    t:raises(message, function()
      finished { survival = function(robots) return result(robots) end }
    end)
  end
  refused("survival %(.*survival.lua:%d+%) returned nil, expected a list", function() end)
  refused("survival %(.*survival.lua:%d+%): survivors%[1%] is 7; expected an index from 1 to 6",
    function() return { 7 } end)
  refused("survivors%[2%] = %d is in the list already, at place 1",
    function(robots) return { robots.ranked[1], robots.ranked[1] } end)
  refused("6 survivors leave no place for offspring in a population of 6: return fewer",
    function(robots) return robots.ranked end)
end)

suite:test("every function gets the state, and resume restores it to the same bytes", function(t)
  evolution.resumes(t, {
    state = function() return { calls = 0, seen = {} } end,
    fitness = function(robot, state)
      state.calls = state.calls + 1
      state.seen[#state.seen + 1] = robot.id
      return robot:distance() + 1e-3 * state.calls
    end,
    supervisor = function(history, _, _, state)
      assert(state.calls >= #history * 4)
      return { mutation_rate = math.min(0.5, 0.01 * state.calls) }
    end,
  })
end)

suite:test("an own loop reads and writes the state", function(t)
  local function start()
    return limax.start(evolution.small { state = function() return { seen = {} } end },
      { say = evolution.silent })
  end
  local last
  for population in start():generations() do
    population:score()
    t:equal(#population.state.seen, population.generation)
    table.insert(population.state.seen, #population.ranked)
    last = population
  end
  t:equal(#last.state.seen, 3)
  t:raises("population%.state is there after score",
    function() start():generations()().state.seen = 1 end)
end)

suite:test("a state that no file can hold is refused with its place", function(t)
  local function refused(message, value)
    t:raises(message, function() finished { state = function() return value end } end)
  end
  local loop = {}
  loop.again = loop
  refused("state%.again is a table that contains itself", loop)
  refused("state%.f is a function; it may hold numbers", { f = print })
  refused("state%.list%[2%] is nan", { list = { 1, 0 / 0 } })
  refused("state%.archive has the key 7; keys are names, or 1, 2, 3", { archive = { [7] = 1 } })
  refused("state%.gaps is a list with gaps", { gaps = { 1, 2, nil, 4 } })
  refused("state%.mixed has both names and places", { mixed = { 1, x = 2 } })
end)
