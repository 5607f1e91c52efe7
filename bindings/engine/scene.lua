--- scene.lua: a scene is the list of its effects: `engine.scene { gravity = true, ground = {
--- stiffness = 1e5 } }`. true takes an effect's defaults, a table changes some of its fields, false
--- or nil leaves it out. An effect that a scene may have several times also takes a list of such
--- tables, in any order but for blocks and targets. The springs of the bodies act in every scene.
--- Any other name with a table that has a `force` is a scripted effect.

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local fault = require "limax.engine.fault"
local fields = require "limax.engine.fields"
local object = require "limax.engine.object"
local schema = require "limax.engine.schema"
local scripted_effect = require "limax.engine.scripted_effect"
local strict = require "limax.engine.strict"
local suggest = require "limax.engine.suggest"

local C = abi.C
local class = object.class("scene", "scene")
local methods = class.methods

-- the effect that every scene has
local ALWAYS = "springs"
-- the one with a text and its parameters, and its field that is 0 or 1
local CONTROLLED, SWITCH = "control", "hold"

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
    result.fields[i].switch = result.name == CONTROLLED and result.fields[i].name == SWITCH or nil
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
  local expected = "a list of rows, each a list of numbers"
  local first = type(value) == "table" and value[1]
  if type(first) ~= "table" then schema.refuse(what, expected, value) end
  local width = #first
  local copy =
    schema.demand(schema.list(schema.numbers(width), { expected = expected }), value, what)
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
  local what, components = ("scene: %s.%s"):format(place, field.name), field.components
  if components == 0 then return set_heights(handle, effect, what, field, value) end
  -- the engine's message about a range shows its unit, which a pure number has not
  local pure = field.unit == "1" and components == 1
  local rule = components == 1 and schema.number {} or schema.numbers(components)
  value = schema.demand(pure and schema.field(field) or rule, value, what)
  abi.check(C.limax_scene_set(handle, effect, field.name, ffi.new("double[?]", components, value),
    components))
  return value
end

-- The default of a field as scene:table() shows it; a table of heights is flat.
local function default_of(field)
  if field.components == 0 then return { { 0, 0 }, { 0, 0 } } end
  return field.components == 1 and field.value[1] or field.value
end

-- Adds one effect, or an instance of it; `changes` is true or a table of fields. Returns the values
-- of all its fields.
local function add(handle, effect, place, changes)
  if effect.name ~= ALWAYS then abi.check(C.limax_scene_add(handle, effect.name)) end
  if changes == true then changes = {} end
  local resolved = {}
  for _, field in ipairs(effect.fields) do resolved[field.name] = default_of(field) end
  local has_text = effect.name == CONTROLLED
  if has_text and changes.signal == nil then
    for _, name in ipairs(schema.names(changes, place) or {}) do
      if resolved[name] == nil and suggest.nearest(name, { "signal" }) then
        fault.raise(('scene: %s.%s: unknown field; did you mean "signal"?'):format(place, name))
      end
    end
    fault.raise(("scene: %s needs a signal, the text of its controller, such as "):format(place)
      .. 'signal = "a = clock_sine;"')
  end
  if not has_text then schema.known(changes, resolved, "scene: " .. place) end
  for _, field in ipairs(effect.fields) do
    local value = changes[field.name]
    if value ~= nil then resolved[field.name] = set(handle, effect.name, place, field, value) end
  end
  if has_text then
    for name, value in pairs(scripted_effect.set_controller(handle, changes, resolved)) do
      resolved[name] = value
    end
  end
  return resolved
end

-- Adds an effect as the script's entry asks: once, or each instance of a list.
local function add_entry(handle, effect, entry)
  local place, is_list = "scene: " .. effect.name, type(entry) == "table" and entry[1] ~= nil
  local signal = type(entry) == "table" and effect.name == CONTROLLED and entry.signal or entry
  if type(entry) == "string" and effect.name == CONTROLLED then
    fault.raise(("%s: expected a table, got a text: write control = { signal = %s }"):format(place,
      schema.show(entry)))
  end
  local name = strict.name_of(signal)
  if name and effect.name == CONTROLLED then
    fault.raise(("%s: got the function %s itself; call it: %s {}"):format(place, name, name))
  end
  if type(signal) == "function" and effect.name == CONTROLLED then
    fault.raise(place .. ": a Lua function controls only a robot by hand (robot:simulate,"
      .. ' robot:begin); elsewhere write a text, such as { signal = "a = clock_sine;" }, or take'
      .. " one of limax.control")
  end
  if type(entry) ~= "table" and type(entry) ~= "boolean" then
    schema.refuse(place, "true, false or a table of its fields", entry)
  end
  if effect.instances == 1 then
    if is_list then
      fault.raise(place .. ": a scene has it once; expected a table of its fields, got a list")
    end
    return add(handle, effect, effect.name, entry)
  end
  local resolved = {}
  for i, one in ipairs(is_list and entry or { entry }) do
    if type(one) ~= "table" and one ~= true then
      schema.refuse(("%s[%d]"):format(place, i), "a table of its fields", one)
    end
    resolved[i] = add(handle, effect, ("%s[%d]"):format(effect.name, i), one)
  end
  if is_list and not schema.list_size(entry) then
    fault.raise(place .. ": expected a list of tables without named entries")
  end
  return resolved
end

--- Makes a scene.
---@param entries table<string, boolean|table>
---@return limax.scene
local function scene(entries)
  schema.demand(schema.table, entries, "scene")
  if entries[ALWAYS] == false then
    fault.raise(("scene: %s act in every scene and cannot be left out"):format(ALWAYS))
  end
  local all, known, scripted = effects(), {}, {}
  for _, effect in ipairs(all) do known[effect.name] = true end
  for name, value in pairs(entries) do
    if scripted_effect.is(value) then
      if known[name] then
        fault.raise(("scene: %s: the name is taken by an effect of limax; give your force another")
          :format(name))
      end
      scripted[#scripted + 1] = name
    end
  end
  for _, name in ipairs(scripted) do known[name] = true end
  schema.known(entries, known, "scene", function(name)
    return type(entries[name]) == "table" and suggest.ending(name, schema.names(known, "scene"))
      .. '; a force of your own has a text, force = "f = ...;"'
  end)
  table.sort(scripted)
  local self = object.make(class, nil, C.limax_scene_create, { resolved = {} })
  for _, effect in ipairs(all) do
    local entry = entries[effect.name]
    if entry then self.resolved[effect.name] = add_entry(self.handle, effect, entry) end
  end
  self.resolved[ALWAYS] = nil
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

--- How many genes of control the scene's controller reads; 0 without one.
function methods:control_genes()
  local handle = object.handle("scene:control_genes", self, class)
  local needs = ffi.new "limax_controller_needs"
  abi.check(C.limax_scene_controller(handle, needs))
  return needs.genes
end

--- The sensors that the scene's controller reads, in order: { "strain.x", "contact" }.
---@return string[]
function methods:inputs()
  local handle, list = object.handle("scene:inputs", self, class), {}
  local needs = ffi.new "limax_controller_needs"
  abi.check(C.limax_scene_controller(handle, needs))
  local at, component = ffi.new "int32_t[1]", ffi.new "int32_t[1]"
  local info = ffi.new "limax_sensor_info"
  for i = 1, needs.inputs do
    abi.check(C.limax_scene_input(handle, i - 1, at, component))
    abi.check(C.limax_sensor_describe(at[0], info))
    local axis = info.components == 3 and "." .. ("xyz"):sub(component[0] + 1, component[0] + 1)
    list[i] = ffi.string(info.name) .. (axis or "")
  end
  return list
end

---@class limax.sensor
---@field name string
---@field unit string
---@field note string
---@field components integer 1 or 3
---@field measured boolean whether noise and delay apply
---@field range number what a controller's value of 1 is, in `unit`

--- The sensors that a controller may read.
---@return limax.sensor[]
local function sensors()
  local list, info = {}, ffi.new "limax_sensor_info"
  for i = 1, C.limax_sensor_count() do
    abi.check(C.limax_sensor_describe(i - 1, info))
    list[i] = { name = ffi.string(info.name), unit = ffi.string(info.unit),
      note = ffi.string(info.note), components = info.components, measured = info.measured ~= 0,
      range = info.range }
  end
  return list
end

return { class = class, scene = scene, effects = effects, sensors = sensors }
