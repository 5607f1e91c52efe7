--- scripted_effect.lua: texts of a scene: the controller of its muscles, and effects that a script
--- defines: `magnet = { force = "f = ...", strength =
--- 0.2, bound = { stiffness = 20 } }`. `force` is the text of its law (language: engine/README.md),
--- `bound` its contribution to the time step's bound; every other field is a parameter, a number or
--- a list of three.

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local fault = require "limax.engine.fault"
local schema = require "limax.engine.schema"
local suggest = require "limax.engine.suggest"

local C = abi.C
local scripted_effect = {}

local number_rule, vector_rule = schema.number {}, schema.numbers(3)
local bound_rule =
  schema.fields { stiffness = schema.number({}, 0), damping = schema.number({}, 0) }

--- Is a scene's entry a scripted effect?
function scripted_effect.is(entry) return type(entry) == "table" and entry.force ~= nil end

-- The line of a file on which a text begins; nil unless the file contains it exactly once.
local function line_in(path, text)
  local file = io.open(path, "rb")
  local content = file and file:read "*a"
  if file then file:close() end
  if not content then return nil end
  -- the line ends of a long text as Lua reads them
  content = content:gsub("\r\n", "\n")
  local start = content:find(text, 1, true)
  if not start or content:find(text, start + 1, true) then return nil end
  return 1 + select(2, content:sub(1, start - 1):gsub("\n", ""))
end

-- The place in the user's file of a line of a law's text, " (FILE:LINE)"; "" if it is not found.
-- `return limax.experiment { ... }` is a tail call, so its file may not be on the stack: then the
-- started script is searched.
local function place_of(text, line)
  local started = rawget(_G, "arg")
  local _, _, path = fault.place()
  for _, candidate in ipairs { path, type(started) == "table" and started[0] or nil } do
    local first = line_in(candidate, text)
    if first then return (" (%s:%d)"):format(candidate:match "[^/]*$", first + line - 1) end
  end
  return ""
end

-- The parameters among the fields, which are all but those in `fields`, in the order of their
-- names.
local function parameters_of(what, entry, fields)
  local names, resolved = {}, {}
  for _, name in ipairs(schema.known(entry, entry, what)) do
    local value, place = entry[name], what .. "." .. name
    if fields[name] == nil then
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

-- The same as the engine takes them, and how many.
local function list_of(names, resolved)
  local list = ffi.new("limax_script_parameter[?]", math.max(1, #names))
  for i, parameter in ipairs(names) do
    local value, slot = resolved[parameter], list[i - 1]
    slot.name = parameter
    local components = type(value) == "table" and value or { value }
    slot.components = #components
    for c = 1, #components do slot.value[c - 1] = components[c] end
  end
  return list, #names
end

local function text_of(value, what)
  local text = schema.demand(schema.string, value, what)
  if text:find("\0", 1, true) then fault.raise(what .. ": a text cannot hold a byte 0") end
  return text
end

-- Raises the engine's error about a text, with the line in the user's file.
local function check(status, text)
  if status == C.LIMAX_INVALID_ARGUMENT then
    local message = ffi.string(C.limax_error_text())
      :gsub("(unknown name 'frequency'); ", "%1; did you mean clock_sine? ")
    local line = tonumber(message:match "^[^,]*, line (%d+): ")
    fault.raise(message .. (line and place_of(text, line) or ""))
  end
  abi.check(status)
end

-- Refuses fields that are neither in `known` nor named by the text, the `role` of the effect.
local function require_named(what, entry, known, text, role)
  local allowed = {}
  for name in pairs(known) do allowed[name] = true end
  for word in text:gmatch "[%a_][%w_]*" do allowed[word] = true end
  schema.known(entry, allowed, what, function(name)
    return ("%s; the %s names no such parameter"):format(
      suggest.ending(name, schema.names(known, what)) or "", role)
  end)
end

--- Sets the controller of a scene: the text `signal` of its effect `control`, whose fields are in
--- `fields`. Every other field is a parameter that the text names. Returns text and parameters.
---@param handle ffi.cdata* limax_scene
---@param fields table<string, any>
function scripted_effect.set_controller(handle, entry, fields)
  local what, known = "scene: control", { signal = true }
  local text = text_of(entry.signal, what .. ".signal")
  for name in pairs(fields) do known[name] = true end
  require_named(what, entry, known, text, "signal")
  local names, resolved = parameters_of(what, entry, known)
  local list, count = list_of(names, resolved)
  check(C.limax_scene_set_controller(handle, text, list, count), text)
  resolved.signal = text
  return resolved
end

local OF_FORCE = { force = true, bound = true }

--- Adds a scripted effect to a scene, and returns it as in scene:table().
---@param handle ffi.cdata* limax_scene
function scripted_effect.add(handle, name, entry)
  local what = "scene: " .. name
  if type(name) ~= "string" or not name:match "^[%a_][%w_]*$" then
    schema.refuse("scene", "effects named by letters, digits and _", name)
  end
  local text = text_of(entry.force, what .. ".force")
  require_named(what, entry, OF_FORCE, text, "force")
  local bound = entry.bound
  if bound ~= nil then bound = schema.demand(bound_rule, bound, what .. ".bound") end
  local names, resolved = parameters_of(what, entry, OF_FORCE)
  local list, count = list_of(names, resolved)
  local limits = bound and ffi.new("double[2]", bound.stiffness, bound.damping)
  check(C.limax_scene_add_script(handle, name, text, list, count, limits), text)
  resolved.force, resolved.bound = text, bound
  return resolved
end

return scripted_effect
