--- materials.lua: the fields of a run's materials that a supervisor may change, as plain tables:
--- material name -> field -> value.

local proposals = require "limax.supervise.proposals"

local materials = {}

---@alias limax.material_fields table<string, table<string, number>>

--- The changeable fields of engine materials.
function materials.fields(engine_materials)
  local fields = {}
  for i = 1, engine_materials.count do
    local material = engine_materials:get(i)
    for _, name in ipairs(proposals.material_fields(material)) do
      fields[material.name] = fields[material.name] or {}
      fields[material.name][name] = material[name]
    end
  end
  return fields
end

--- A copy of engine materials with these fields.
function materials.with(first, fields)
  local copy = first:copy()
  for i = 1, copy.count do
    local material = copy:get(i)
    for _, name in ipairs(proposals.material_fields(material)) do
      copy:set(i, name, fields[material.name][name])
    end
  end
  return copy
end

---@param b limax.material_fields of the same materials
function materials.equal(a, b)
  for name, fields in pairs(a) do
    for field, value in pairs(fields) do
      if b[name][field] ~= value then return false end
    end
  end
  return true
end

return materials
