--- scripted_effect.lua: an effect that a script brings: `magnet = { force = "f = ...", strength =
--- 0.2, bound = { stiffness = 20 } }`. `force` is the law's text (engine/README.md has the
--- language), `bound` what it adds to the time step's bound; all else is a parameter, a number or a
--- list of three.

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local fault = require "limax.engine.fault"
local schema = require "limax.engine.schema"

local C = abi.C
local scripted_effect = {}

local number_rule, vector_rule = schema.number {}, schema.numbers(3)
local bound_rule =
  schema.fields { stiffness = schema.number({}, 0), damping = schema.number({}, 0) }

--- Whether a scene's entry under a name that is no effect's is one of these.
---@param given any
---@return boolean
function scripted_effect.is(given) return type(given) == "table" and given.force ~= nil end

-- The line of a file on which a text begins; nil where the file does not hold it as it is, or holds
-- it twice: then nobody knows which.
local function line_in(path, text)
  local file = io.open(path, "rb")
  local content = file and file:read "*a"
  if file then file:close() end
  if not content then return nil end
  -- as Lua reads a text over several lines
  content = content:gsub("\r\n", "\n")
  local start = content:find(text, 1, true)
  if not start or content:find(text, start + 1, true) then return nil end
  return 1 + select(2, content:sub(1, start - 1):gsub("\n", ""))
end

-- Where in the user's file a line of a law's text stands, as " (FILE:LINE)"; "" where it is not
-- found. `return limax.experiment { ... }` leaves no trace of its file on the stack: then it is the
-- script that was started.
local function place_of(text, line)
  local started = rawget(_G, "arg")
  local _, _, path = fault.place()
  for _, candidate in ipairs { path, type(started) == "table" and started[0] or nil } do
    local first = line_in(candidate, text)
    if first then return (" (%s:%d)"):format(candidate:match "[^/]*$", first + line - 1) end
  end
  return ""
end

local function bound_of(what, given)
  return given ~= nil and schema.demand(bound_rule, given, what) or nil
end

-- The parameters among the fields, in the order of their names.
local function parameters_of(what, given)
  local names, resolved = {}, {}
  for _, name in ipairs(schema.known(given, given, what)) do
    local value, place = given[name], what .. "." .. name
    if name ~= "force" and name ~= "bound" then
      names[#names + 1] = name
      if type(value) ~= "number" and type(value) ~= "table" then
        schema.refuse(place, "a number or a list of three", value)
      end
      local rule = type(value) == "number" and number_rule or vector_rule
      resolved[name] = schema.demand(rule, value, place)
    end
  end
  return names, resolved
end

--- Adds one to a scene, and returns it as scene:table() shows it.
---@param handle ffi.cdata* limax_scene
---@param name string
---@param given table
---@return table
function scripted_effect.add(handle, name, given)
  local what = "scene: " .. name
  if type(name) ~= "string" or not name:match "^[%a_][%w_]*$" then
    schema.refuse("scene", "effects named by letters, digits and _", name)
  end
  local text = schema.demand(schema.string, given.force, what .. ".force")
  if text:find("\0", 1, true) then
    fault.raise(what .. ".force: a text cannot hold a byte 0")
  end
  local bound = bound_of(what .. ".bound", given.bound)
  local names, resolved = parameters_of(what, given)
  local list = ffi.new("limax_script_parameter[?]", math.max(1, #names))
  for i, parameter in ipairs(names) do
    local value, slot = resolved[parameter], list[i - 1]
    slot.name = parameter
    local components = type(value) == "table" and value or { value }
    slot.components = #components
    for c = 1, #components do slot.value[c - 1] = components[c] end
  end
  local limits = bound and ffi.new("double[2]", bound.stiffness, bound.damping)
  local status = C.limax_scene_add_script(handle, name, text, list, #names, limits)
  if status == C.LIMAX_INVALID_ARGUMENT then
    local message = ffi.string(C.limax_error_text())
    local line = tonumber(message:match "^[^,]*, line (%d+): ")
    fault.raise(message .. (line and place_of(text, line) or ""))
  end
  abi.check(status)
  resolved.force, resolved.bound = text, bound
  return resolved
end

return scripted_effect
