--- bytes.lua: numbers as the little-endian bytes of binary files, and back.

local ffi = require "ffi"

local bytes = {}

-- every machine that limax is built for stores numbers so
assert(ffi.abi "le", "binary files are written on little-endian machines only")

--- A list of numbers as an array of one C type.
---@param kind string "float", "double", "uint16_t", "uint32_t", ...
---@param list number[]
---@return string
function bytes.pack(kind, list)
  local array = ffi.new(kind .. "[?]", #list)
  for i, value in ipairs(list) do array[i - 1] = value end
  return ffi.string(array, ffi.sizeof(array))
end

--- An array of one C type as a list of numbers; bytes beyond the last whole number are left out.
---@param kind string
---@param text string
---@return number[]
function bytes.unpack(kind, text)
  local count = math.floor(#text / ffi.sizeof(kind))
  local array, list = ffi.cast("const " .. kind .. " *", text), {}
  for i = 1, count do list[i] = tonumber(array[i - 1]) end
  return list
end

return bytes
