--- scene.lua: a scene is the list of its effects: `engine.scene { gravity = true, ground = {
--- stiffness = 1e5 } }`. true takes an effect's defaults, a table changes some of its fields, false
--- or nil leaves it out. An effect that a scene may have several times also takes a list of such
--- tables, in any order. The springs of the bodies act in every scene. Any other name with a table
--- that has a `force` is a scripted effect.

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local fault = require "limax.engine.fault"
local fields = require "limax.engine.fields"
local object = require "limax.engine.object"
local schema = require "limax.engine.schema"
local scripted_effect = require "limax.engine.scripted_effect"

local C = abi.C
local class = object.class("scene", "scene")
local methods = class.__index

-- the effect that every scene has
local ALWAYS = "springs"

---@class limax.effect
---@field name string
---@field summary string
---@field needs string[] effects, one of which the scene must have too; none if empty
---@field instances integer how often a scene may have it
---@field fields limax.field[]

local function describe(effect)
  local info = ffi.new "limax_effect_info"
  abi.check(C.limax_effect_describe(effect, info))
  local result = {
    name = ffi.string(info.name), summary = ffi.string(info.summary), needs = {}, fields = {},
    instances = info.instances,
  }
  for need in ffi.string(info.needs):gmatch "[^,%s]+" do result.needs[#result.needs + 1] = need end
  for i = 1, info.fields do
    local field = ffi.new "limax_field_info"
    abi.check(C.limax_effect_field(effect, i - 1, field))
    result.fields[i] = fields.read(field)
  end
  return result
end

--- Every built-in effect, in the order in which they act.
---@return limax.effect[]
local function effects()
  local list = {}
  for i = 1, C.limax_effect_count() do list[i] = describe(i - 1) end
  return list
end

-- Sets a table of heights, with a row for each place along x, and returns a copy of it.
local function set_heights(handle, effect, what, field, value)
  local first = type(value) == "table" and value[1]
  local expected = "a list of rows, each a list of numbers"
  if type(first) ~= "table" then schema.refuse(what, expected, value) end
  local width = #first
  local rule = schema.list(schema.numbers(width), { expected = expected })
  local copy = schema.demand(rule, value, what)
  local heights = ffi.new("double[?]", math.max(1, #copy * width))
  for x, row in ipairs(copy) do
    for y = 1, width do heights[(x - 1) * width + y - 1] = row[y] end
  end
  abi.check(C.limax_scene_set_heights(handle, effect, field.name, heights, #copy, width))
  return copy
end

-- Sets one field, and returns its value as scene:table() shows it. `place` names the effect, and
-- the instance where there may be several.
local function set(handle, effect, place, field, value)
  local what = ("scene: %s.%s"):format(place, field.name)
  if field.components == 0 then return set_heights(handle, effect, what, field, value) end
  local rule = field.components == 1 and schema.number {} or schema.numbers(field.components)
  value = schema.demand(rule, value, what)
  local values = ffi.new("double[?]", field.components, value)
  abi.check(C.limax_scene_set(handle, effect, field.name, values, field.components))
  return value
end

-- Adds one effect, or an instance of it; `changes` is true or a table of fields. Returns the values
-- of all its fields.
local function add(handle, effect, place, changes)
  if effect.name ~= ALWAYS then abi.check(C.limax_scene_add(handle, effect.name)) end
  local resolved, known = {}, {}
  for _, field in ipairs(effect.fields) do known[field.name] = true end
  if type(changes) == "table" then schema.known(changes, known, "scene: " .. place) end
  for _, field in ipairs(effect.fields) do
    local value
    if type(changes) == "table" then value = changes[field.name] end
    if value ~= nil then
      resolved[field.name] = set(handle, effect.name, place, field, value)
    elseif field.components == 0 then
      -- flat
      resolved[field.name] = { { 0, 0 }, { 0, 0 } }
    else
      resolved[field.name] = field.components == 1 and field.value[1] or field.value
    end
  end
  return resolved
end

-- Adds all instances of an effect that a scene may have several times: a list, or a single one.
local function add_all(handle, effect, value)
  local list = type(value) == "table" and value[1] ~= nil and value or { value }
  local resolved = {}
  for i, one in ipairs(list) do
    local place = ("%s[%d]"):format(effect.name, i)
    if type(one) ~= "table" and one ~= true then
      schema.refuse("scene: " .. place, "a table of its fields", one)
    end
    resolved[i] = add(handle, effect, place, one)
  end
  if not schema.list_size(list) then
    fault.raise(("scene: %s: expected a list of tables without named entries"):format(effect.name))
  end
  return resolved
end

--- Makes a scene.
---@param entries table<string, boolean|table>
---@return limax.scene
local function scene(entries)
  schema.demand(schema.table, entries, "scene")
  local all, built_in, known, scripted = effects(), {}, {}, {}
  for _, effect in ipairs(all) do built_in[effect.name], known[effect.name] = true, true end
  for name, value in pairs(entries) do
    if not built_in[name] and scripted_effect.is(value) then
      scripted[#scripted + 1], known[name] = name, true
    end
  end
  schema.known(entries, known, "scene", function(name)
    return type(entries[name]) == "table" and '; a force of your own has a text, force = "f = ...;"'
  end)
  table.sort(scripted, function(a, b) return tostring(a) < tostring(b) end)
  local self = object.make(class, nil, C.limax_scene_create, { resolved = {} })
  for _, effect in ipairs(all) do
    local value = entries[effect.name]
    if type(value) ~= "table" and type(value) ~= "boolean" and value ~= nil then
      schema.refuse("scene: " .. effect.name, "true, false or a table of its fields", value)
    end
    if effect.instances == 1 and type(value) == "table" and value[1] ~= nil then
      fault.raise(("scene: %s: a scene has it once; expected a table of its fields, got a list")
        :format(effect.name))
    end
    if effect.name == ALWAYS and value == false then
      fault.raise(("scene: %s act in every scene and cannot be left out"):format(ALWAYS))
    end
    if value then
      local resolved
      if effect.instances > 1 then
        resolved = add_all(self.handle, effect, value)
      else
        resolved = add(self.handle, effect, effect.name, value)
      end
      if effect.name ~= ALWAYS then self.resolved[effect.name] = resolved end
    end
  end
  for _, name in ipairs(scripted) do
    self.resolved[name] = scripted_effect.add(self.handle, name, entries[name])
  end
  abi.check(C.limax_scene_check(self.handle))
  return self
end

---@class limax.scene : limax.object

local function copied(value)
  if type(value) ~= "table" then return value end
  local copy = {}
  for key, part in pairs(value) do copy[key] = copied(part) end
  return copy
end

--- The scene as a plain table: each effect with the value of every field, or a list of such tables
--- where a scene may have several. `engine.scene` accepts it.
---@return table<string, table>
function methods:table()
  object.handle("scene:table", self, class)
  return copied(self.resolved)
end

return { class = class, scene = scene, effects = effects }
