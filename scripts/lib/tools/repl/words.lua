--- words.lua: the functions that only the prompt has.

local engine = require "limax.engine"
local follow = require "limax.tools.repl.follow"
local host = require "limax.host"

local words = {}

-- A short description of a value.
local function described(value)
  if type(value) ~= "table" then
    local text = tostring(value)
    return type(value) == "string" and ("%q"):format(#text > 50 and text:sub(1, 50) .. ".." or text)
      or text
  end
  local class = getmetatable(value)
  if type(class) == "table" and rawget(class, "__tostring") then
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

  --- Lists the names that were defined at the prompt, with their values.
  function list.who()
    for _, name in ipairs(names():typed()) do
      io.write(("  %-12s %s\n"):format(name, described(names().own[name])))
    end
  end

  --- Evaluates an expression, prints its time, and returns its values.
  ---@param expression any an expression; in a script a function or a text
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

  --- Reloads a module into the same table, so that references to it see the change.
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

  --- Runs a script, and again when its file changes: within half a second at an idle prompt, else
  --- before the next line. Its top-level names remain defined, and a returned table remains the
  --- same.
  ---@param file string
  ---@return any value what the script returned
  function list.follow(file)
    if type(file) ~= "string" then engine.fail "follow: expected the name of a file" end
    return follow.begin(file, names())
  end

  --- Plots a trace (a line per column) over time, a list of numbers over its index, or a list of
  --- { x, y }, in the terminal.
  ---@param values limax.view|number[]|number[][]
  ---@param options? { column?: integer, rows?: integer, columns?: integer } only one
  --- column of a trace; the size of the plot in letters
  function list.plot(values, options)
    io.write(require("limax.tools.repl.plot").text(values, options), "\n")
  end

  --- Simulates a robot twice and compares the results: on two devices, or with two sets of options
  --- of `robot:simulate`.
  ---@param robot limax.robot|limax.scored_robot
  ---@param first "auto"|"cpu"|"cuda"|limax.robot.simulate_options
  ---@param second "auto"|"cpu"|"cuda"|limax.robot.simulate_options
  ---@param options? limax.robot.simulate_options of both
  ---@return table<string, number> differences of the measures, second minus first
  function list.compare(robot, first, second, options)
    return require("limax.tools.repl.compare").two(robot, first, second, options)
  end

  --- Evolves some generations, prints a line for each, and returns the run, which can be continued.
  --- After Ctrl-C the run so far is `_`.
  ---@param what table|limax.experiment|limax.run an experiment, its fields, or a run to continue
  ---@param generations? integer 5 if absent
  ---@return limax.run
  function list.evolve(what, generations)
    return require("limax.tools.repl.evolve").some(what, generations,
      function(run) names():remember(run) end)
  end

  --- The best robot of a run's last scored generation.
  ---@param run limax.run
  ---@return limax.scored_robot
  function list.champion(run) return require("limax.tools.repl.evolve").champion(run) end

  --- Simulates a robot and writes six poses as an SVG file; of a robot in motion it writes the
  --- current pose. Returns the path; `open = true` shows the file with BROWSER or the desktop's
  --- viewer.
  ---@param robot limax.robot|limax.scored_robot|limax.robot_in_motion
  ---@param file? string the first free name of picture-1.svg, picture-2.svg, ... if absent
  ---@param options? { duration?: number, scene?: table, device?: string, title?: string,
  --- open?: boolean } s
  ---@return string path
  function list.picture(robot, file, options)
    return require("limax.tools.repl.picture").write(robot, file, options)
  end

  return list
end

return words
