--- answer.lua: the form that a model's answer has: which fields it may hold, as an object with
--- nulls to be filled in, and as a JSON schema in the subset that all endpoints share (every field
--- required and nullable, no numeric ranges: those are the ledger's).

local host = require "limax.host"
local ledger = require "limax.supervise.ledger"

local answer = {}

---@class limax.llm.allowed
---@field hyperparameters boolean
---@field materials boolean

-- Names of the fields that may be set: those of parameters, and by material.
local function fields(limits, allowed, materials)
  local parameters, by_material = {}, {}
  for _, limit in ipairs(limits) do
    if not limit.material and allowed.hyperparameters then
      parameters[#parameters + 1] = limit.field
    end
  end
  for _, material in ipairs(allowed.materials and materials or {}) do
    local names = ledger.material_fields(material)
    if #names > 0 then by_material[#by_material + 1] = { name = material.name, fields = names } end
  end
  return parameters, by_material
end

--- The object that a model is asked to fill in: null where nothing is to change.
---@param limits limax.limit[]
---@param allowed limax.llm.allowed
---@param materials table[] as a materials table lists them
---@return table
function answer.form(limits, allowed, materials)
  local parameters, by_material = fields(limits, allowed, materials)
  local form = { reason = "" }
  for _, name in ipairs(parameters) do form[name] = host.json.null end
  for _, material in ipairs(by_material) do
    local mine = {}
    for _, name in ipairs(material.fields) do mine[name] = host.json.null end
    form.materials = form.materials or {}
    form.materials[material.name] = mine
  end
  return form
end

local function object(properties, required)
  table.sort(required)
  return { type = "object", properties = properties, required = required,
    additionalProperties = false }
end

--- The same as a JSON schema.
---@param limits limax.limit[]
---@param allowed limax.llm.allowed
---@param materials table[]
---@return table
function answer.schema(limits, allowed, materials)
  local parameters, by_material = fields(limits, allowed, materials)
  local number = { type = { "number", "null" } }
  local properties, required = { reason = { type = "string" } }, { "reason" }
  for _, name in ipairs(parameters) do
    properties[name] = number
    required[#required + 1] = name
  end
  local inner, names = {}, {}
  for _, material in ipairs(by_material) do
    local mine = {}
    for _, name in ipairs(material.fields) do mine[name] = number end
    inner[material.name] = object(mine, { unpack(material.fields) })
    names[#names + 1] = material.name
  end
  if #names > 0 then
    properties.materials = object(inner, names)
    required[#required + 1] = "materials"
  end
  return object(properties, required)
end

return answer
