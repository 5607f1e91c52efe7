--- words.lua: the names that only the prompt has: what was typed, times, scripts that change, and
--- looks at robots.

local engine = require "limax.engine"
local follow = require "limax.tools.repl.follow"
local host = require "limax.host"

local words = {}

-- What a name stands for, in a few words.
local function described(value)
  if type(value) ~= "table" then
    local text = tostring(value)
    return type(value) == "string" and ("%q"):format(#text > 50 and text:sub(1, 50) .. ".." or text)
      or text
  end
  local class = getmetatable(value)
  if engine.is_view(value) or type(class) == "table" and rawget(class, "__tostring") then
    return (tostring(value):match "[^\n]*$")
  end
  local count = 0
  for _ in pairs(value) do count = count + 1 end
  return ("table of %d"):format(count)
end

local function seconds(number)
  if number < 1e-3 then return ("%.3g us"):format(1e6 * number) end
  if number < 1 then return ("%.3g ms"):format(1e3 * number) end
  return ("%.3g s"):format(number)
end

local function finish(began, ...)
  io.write(seconds(host.clock() - began), "\n")
  return ...
end

--- The words of one prompt.
---@param names fun(): limax.repl.names
---@return table<string, function>
function words.of(names)
  local list = {}

  --- Lists the names that were typed, with what they are.
  function list.who()
    for _, name in ipairs(names():typed()) do
      io.write(("  %-12s %s\n"):format(name, described(names().own[name])))
    end
  end

  --- Runs an expression, prints how long it took, and gives its values.
  ---@param expression any at the prompt any expression; else a function or its text
  ---@return any ... the values
  function list.time(expression)
    if type(expression) == "string" then
      expression = setfenv(assert(loadstring("return " .. expression, "=input")),
        names().environment)
    end
    if type(expression) ~= "function" then
      engine.fail "time: expected an expression in parentheses, a function or a text"
    end
    return finish(host.clock(), expression())
  end

  --- Reads a module again. Its table stays the same one, so that whoever holds it sees the change.
  ---@param module string as `require` takes it
  ---@return any module
  function list.reload(module)
    if type(module) ~= "string" then engine.fail "reload: expected the name of a module" end
    local old = package.loaded[module]
    package.loaded[module] = nil
    local fine, value = pcall(require, module)
    if not fine then
      package.loaded[module] = old
      if value == host.interrupt then error(value, 0) end
      engine.fail("reload: " .. tostring(value))
    end
    value = follow.renew(old, value)
    package.loaded[module] = value
    return value
  end

  --- Runs a script, and again when its file has changed: within half a second where nobody types,
  --- else before the next line. Its top-level names stay at the prompt, and a table that it returns
  --- stays the same one.
  ---@param file string
  ---@return any value what the script returned
  function list.follow(file)
    if type(file) ~= "string" then engine.fail "follow: expected the name of a file" end
    return follow.begin(file, names())
  end

  --- Draws numbers over time, or over their place in the list, in the terminal: a trace (its
  --- columns as lines), a list of numbers, or a list of { x, y }.
  ---@param values limax.view|number[]|number[][]
  ---@param options? { column?: integer, rows?: integer, columns?: integer } one column of a trace
  --- alone; the size of the plot in letters
  function list.plot(values, options)
    io.write(require("limax.tools.repl.plot").text(values, options), "\n")
  end

  --- Simulates one robot twice and shows what differs: on two devices, or with two sets of options
  --- as `robot:simulate` takes them.
  ---@param robot limax.robot|limax.scored_robot
  ---@param first "auto"|"cpu"|"cuda"|limax.robot.simulate_options
  ---@param second "auto"|"cpu"|"cuda"|limax.robot.simulate_options
  ---@param options? limax.robot.simulate_options of both
  ---@return table<string, number> differences of each measure, second less first
  function list.compare(robot, first, second, options)
    return require("limax.tools.repl.compare").two(robot, first, second, options)
  end

  --- Evolves some generations, a line for each, and gives the run, which can be evolved on. After
  --- Ctrl-C the run so far is `_`.
  ---@param what table|limax.experiment|limax.run an experiment, its fields, or a run to go on with
  ---@param generations? integer 5 if absent
  ---@return limax.run
  function list.evolve(what, generations)
    return require("limax.tools.repl.evolve").some(what, generations,
      function(run) names():remember(run) end)
  end

  --- The best robot of a run's newest scored generation.
  ---@param run limax.run
  ---@return limax.scored_robot
  function list.champion(run) return require("limax.tools.repl.evolve").champion(run) end

  --- Simulates a robot and writes six poses of its walk as an SVG file; of a robot in motion the
  --- pose that it has now. Gives the path; `open = true` shows it in the desktop's viewer, or the
  --- one that BROWSER names.
  ---@param robot limax.robot|limax.scored_robot|limax.robot_in_motion
  ---@param file? string the first free of picture-1.svg, picture-2.svg, ... if absent
  ---@param options? { duration?: number, scene?: table, device?: string, title?: string,
  --- open?: boolean } s
  ---@return string path
  function list.picture(robot, file, options)
    return require("limax.tools.repl.picture").write(robot, file, options)
  end

  return list
end

return words
