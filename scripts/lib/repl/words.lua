--- words.lua: the names that only the prompt has: `who`, `time`, `reload`, `follow`.

local engine = require "limax.engine"
local follow = require "limax.repl.follow"
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
      engine.fail "time: expected an expression, got its value: write time(f(x)), alone in a line"
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
      error(value, 0)
    end
    value = follow.renew(old, value)
    package.loaded[module] = value
    return value
  end

  --- Runs a script, and again before the next line after its file has changed. Its top-level names
  --- stay at the prompt, and a table that it returns stays the same one.
  ---@param file string
  ---@return any value what the script returned
  function list.follow(file)
    if type(file) ~= "string" then engine.fail "follow: expected the name of a file" end
    return follow.begin(file, names())
  end

  return list
end

return words
