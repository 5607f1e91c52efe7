--- words.lua: the functions that only the prompt has.

local engine = require "limax.engine"
local follow = require "limax.tools.repl.follow"
local host = require "limax.host"
local names = require "limax.tools.repl.names"
local output = require "limax.base.output"
local schema = require "limax.engine.schema"
local show = require "limax.tools.repl.show"

local words = names.words

-- Those in modules of their own, which are loaded at the first call.
for name, module in pairs { champion = "evolve", compare = "compare", evolve = "evolve",
  picture = "picture", plot = "plot" } do
  words[name] = function(...) return require("limax.tools.repl." .. module)[name](...) end
end

--- Lists the names that were defined at the prompt, with their values.
function words.who()
  for _, name in ipairs(names.typed()) do
    output.write(("  %-12s %s\n"):format(name, show.line(names.get(name))))
  end
end

local function finish(began, ...)
  local seconds = host.clock() - began
  local unit = seconds < 1e-3 and { 1e6, "us" } or seconds < 1 and { 1e3, "ms" } or { 1, "s" }
  output.write(("%.3g %s\n"):format(unit[1] * seconds, unit[2]))
  return ...
end

--- Calls a function, prints its time, and returns its values.
---@param call string|function the text of an expression, or a function
---@return any ... the values
function words.time(call)
  if type(call) == "string" then
    call = setfenv(assert(loadstring("return " .. call, "=input")), names.environment)
  end
  if type(call) ~= "function" then
    engine.fail "time: expected the text of an expression, or a function"
  end
  return finish(host.clock(), call())
end

--- Runs a script, and again when its file changes: within half a second at an idle prompt, else
--- before the next line. Its top-level names remain defined, and a returned table remains the same.
---@param file string
---@return any value what the script returned
function words.follow(file)
  return follow.begin(schema.demand(schema.string, file, "follow"))
end

return words
