--- fields.lua: the numeric fields of the engine's options and effects: name, unit, range, default
--- and explanation, as engine/base/fields.h and the effects' headers state them.

local ffi = require "ffi"
local C = require("limax.engine.abi").C

local fields = {}

---@class limax.field: limax.range
---@field name string
---@field unit string "1" for a pure number
---@field note string
---@field components integer 1, 3 for a vector, 0 for a table of heights
---@field minimum number of each component
---@field maximum number
---@field value number[] the default

--- A field as the C interface describes it.
---@param info ffi.cdata* limax_field_info
function fields.read(info)
  local value = {}
  for c = 1, info.components do value[c] = info.value[c - 1] end
  return {
    name = ffi.string(info.name), unit = ffi.string(info.unit), note = ffi.string(info.note),
    components = info.components, integer = info.whole ~= 0 or nil, value = value,
    minimum = info.minimum, maximum = info.maximum,
  }
end

--- The fields of a group of options by name; the default of one component is a number.
---@return table<string, limax.field>
function fields.of(group)
  local list, info, index = {}, ffi.new "limax_field_info", 0
  while C.limax_option_field(group, index, info) == C.LIMAX_OK do
    local field = fields.read(info)
    if field.components == 1 then field.value = field.value[1] end
    list[field.name], index = field, index + 1
  end
  return list
end

return fields
