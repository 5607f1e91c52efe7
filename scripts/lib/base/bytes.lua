--- bytes.lua: lists of numbers as little-endian arrays of a C type, and back.

local ffi = require "ffi"

local bytes = {}

assert(ffi.abi "le", "limax is built for little-endian machines only")

---@param kind string "float", "double", "uint16_t", "uint32_t", ...
function bytes.pack(kind, list)
  local array = ffi.new(kind .. "[?]", #list, list)
  return ffi.string(array, ffi.sizeof(array))
end

---@param text string bytes after the last whole number are ignored
function bytes.unpack(kind, text)
  local array, list = ffi.cast("const " .. kind .. " *", text), {}
  for i = 1, math.floor(#text / ffi.sizeof(kind)) do list[i] = tonumber(array[i - 1]) end
  return list
end

return bytes
