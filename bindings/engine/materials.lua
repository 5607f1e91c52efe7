--- materials.lua: material tables. Indices count from 1; material 1 is always the empty one. SI
--- units.

local ffi = require "ffi"
local host = require "limax.host"
local abi = require "limax.engine.abi"
local fault = require "limax.engine.fault"
local names = require "limax.engine.names"
local object = require "limax.engine.object"
local schema = require "limax.engine.schema"
local suggest = require "limax.engine.suggest"

local C = abi.C
local class = object.class("material table", "materials")
local methods = class.methods

---@class limax.materials : limax.object
---@field count integer with the empty one
---@field name string of the table

---@class limax.material
---@field name string
---@field letter string
---@field kind "empty"|"passive"|"expanding"|"contracting"
---@field stiffness number N/m
---@field mass_per_site number kg
---@field damping_ratio number 1
---@field amplitude number largest relative change of rest length, 1
---@field phase number largest phase, rad
---@field stiffness_floor number smallest stiffness weight, 1

-- numbers of a material, in the interface's order; MUSCLE_FIELDS: those of muscles only
local FIELDS = {
  "stiffness", "mass_per_site", "damping_ratio", "amplitude", "phase", "stiffness_floor",
}
local field_name = schema.choice(FIELDS)
local MUSCLE_FIELDS = { amplitude = true, phase = true }

local function make(create)
  local self = object.make(class, nil, create)
  object.set(self, "count", C.limax_materials_count(self.handle))
  object.set(self, "name", ffi.string(C.limax_materials_name(self.handle)))
  return self
end

-- Path of a shipped table.
local function shipped(name)
  local folder = host.home .. "/materials"
  local path = ("%s/%s.json"):format(folder, name)
  if host.file.exists(path) == "file" then return path end
  local names_there = {}
  for _, file in ipairs(host.file.list(folder) or {}) do
    names_there[#names_there + 1] = file:match "^(.+)%.json$"
  end
  fault.raise(("materials: there is no table %q in %s%s"):format(name, folder,
    suggest.ending(name, names_there)))
end

-- Refuses a table without a schema with an example; the engine checks everything else.
local function require_schema(value, origin)
  if type(value) ~= "table" or value.schema ~= nil then return end
  fault.raise(origin .. ': schema: is missing; expected "limax.materials/1" beside name, fields and'
    .. " materials, as in materials/paper.json")
end

--- Reads a material table.
---@param source string|table a path that ends in .json, the name of a shipped table, or the table
---@return limax.materials
local function materials(source)
  if type(source) == "table" then
    if getmetatable(source) == class then
      schema.refuse("materials", "a path, a name or a plain table (materials:copy() copies)",
        "materials")
    end
    require_schema(source, "materials")
    local encoded, text = pcall(host.json.encode, source)
    if not encoded then fault.raise("materials: " .. tostring(text)) end
    return make(function(out) return C.limax_materials_parse(text, #text, "materials", out) end)
  end
  if schema.demand(schema.string, source, "materials"):find("\0", 1, true) then
    schema.refuse("materials", "a path or a name without a zero byte", source)
  end
  local is_file = source:match "%.json$"
  if is_file and not host.file.exists(source) then
    fault.raise(("materials: there is no file %s"):format(host.file.absolute(source)))
  end
  local path = is_file and source or shipped(source)
  local file = is_file and io.open(path, "rb")
  if file then
    require_schema(host.json.decode(file:read "*a" or "", path), path)
    file:close()
  end
  return make(function(out) return C.limax_materials_load(path, out) end)
end

--- One material.
---@param i integer
---@return limax.material
function methods:get(i)
  local handle, index = object.entry("materials:get", self, class, i)
  local material = ffi.new "limax_material"
  abi.check(C.limax_materials_get(handle, index, material))
  local result = {
    name = ffi.string(material.name), letter = ffi.string(material.letter),
    kind = names.material_kind.text[material.kind],
  }
  for _, field in ipairs(FIELDS) do result[field] = material[field] end
  return result
end

--- Index of the material with this letter or name, or nil.
---@param letter_or_name string
---@return integer|nil
function methods:index(letter_or_name)
  schema.demand(schema.string, letter_or_name, "materials:index")
  for i = 1, self.count do
    local material = self:get(i)
    if material.letter == letter_or_name or material.name == letter_or_name then return i end
  end
  return nil
end

--- Sets one number of one material, within the field's range.
---@param i integer
---@param field string
---@param value number
function methods:set(i, field, value)
  local handle, index = object.entry("materials:set", self, class, i)
  schema.demand(field_name, field, "materials:set: field")
  value = schema.demand(schema.number {}, value, field)
  abi.check(C.limax_materials_set(handle, index, field, value))
end

--- A field's unit, range (inclusive) and the source of its values.
---@param name string
---@return { unit: string, minimum: number, maximum: number, source: string }
function methods:field(name)
  local handle = object.handle("materials:field", self, class)
  schema.demand(field_name, name, "materials:field")
  local unit, source = ffi.new "const char *[1]", ffi.new "const char *[1]"
  local minimum, maximum = ffi.new "double[1]", ffi.new "double[1]"
  abi.check(C.limax_materials_field(handle, name, unit, minimum, maximum, source))
  return {
    unit = ffi.string(unit[0]), source = ffi.string(source[0]),
    minimum = minimum[0], maximum = maximum[0],
  }
end

--- An independent copy.
---@return limax.materials
function methods:copy()
  local handle = object.handle("materials:copy", self, class)
  return make(function(out) return C.limax_materials_copy(handle, out) end)
end

--- The table as plain Lua values, as in a material file; `engine.materials` reads it.
---@return table
function methods:table()
  object.handle("materials:table", self, class)
  local result = { schema = "limax.materials/1", name = self.name, fields = {}, materials = {} }
  for _, field in ipairs(FIELDS) do result.fields[field] = self:field(field) end
  for i = 1, self.count do
    local material = self:get(i)
    for _, field in ipairs(FIELDS) do
      if material.kind == "empty" or material.kind == "passive" and MUSCLE_FIELDS[field] then
        material[field] = nil
      end
    end
    result.materials[i] = material
  end
  return result
end

function class:__tostring()
  if not self.handle then return "freed material table" end
  return ("materials %q (%d)"):format(self.name, self.count)
end

return { class = class, materials = materials }
