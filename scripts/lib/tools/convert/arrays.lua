--- arrays.lua: NumPy's arrays of numbers: one in a .npy file, several in a .npz archive.

local ffi = require "ffi"
local bytes = require "limax.tools.convert.bytes"
local host = require "limax.host"

local arrays = {}

local MAGIC = "\147NUMPY"

-- C type of each of NumPy's types that is read.
local C_TYPES = { ["|b1"] = "uint8_t", ["|u1"] = "uint8_t", ["|i1"] = "int8_t",
  ["<u2"] = "uint16_t", ["<i2"] = "int16_t", ["<u4"] = "uint32_t", ["<i4"] = "int32_t",
  ["<u8"] = "uint64_t", ["<i8"] = "int64_t", ["<f4"] = "float", ["<f8"] = "double" }

local MAX_NUMBERS = 1e7

---@class limax.convert.array
---@field shape integer[]
---@field data number[] in row-major order

--- The bytes of a .npy file (format 1.0).
---@param kind string NumPy's type: "<f4", "|u1", ...
---@param data string|number[] in row-major order
function arrays.encode(kind, shape, data)
  if type(data) == "table" then data = bytes.pack(C_TYPES[kind], data) end
  local header = ("{'descr': '%s', 'fortran_order': False, 'shape': (%s,), }"):format(kind,
    table.concat(shape, ", "))
  -- magic, version, length and header with its newline fill a multiple of 64 bytes
  header = header .. (" "):rep(-(#MAGIC + 4 + #header + 1) % 64) .. "\n"
  return MAGIC .. "\1\0" .. bytes.pack("uint16_t", { #header }) .. header .. data
end

--- Reads a .npy file of numbers; `nil, message` for anything else, pickled objects included.
---@return limax.convert.array|nil
---@return string|nil message
function arrays.decode(text)
  if text:sub(1, #MAGIC + 2) ~= MAGIC .. "\1\0" or #text < 10 then
    return nil, "is not a NumPy array of format 1.0"
  end
  local offset = 10 + bytes.unpack("uint16_t", text:sub(9, 10))[1]
  local header = text:sub(11, offset)
  local kind = header:match "'descr':%s*'([^']*)'" or "unknown"
  local ctype = C_TYPES[kind:gsub("^=", "<")]
  if not ctype then
    return nil, ("has elements of type %q; expected bool, int, uint or float of up to 8 bytes,"
      .. " little-endian"):format(kind:sub(1, 20))
  end
  if not header:find "'fortran_order':%s*False" then return nil, "is not in C (row-major) order" end
  local shape, count = {}, 1
  for word in (header:match "'shape':%s*%(([^()]*)%)" or "0"):gmatch "%d+" do
    shape[#shape + 1], count = tonumber(word), count * tonumber(word)
  end
  if count > MAX_NUMBERS then
    return nil, ("has %g numbers; at most %d are read"):format(count, MAX_NUMBERS)
  end
  if #text - offset ~= count * ffi.sizeof(ctype) then
    return nil, ("holds %d bytes; its header states %d numbers of type %s"):format(
      #text - offset, count, kind)
  end
  return { shape = shape, data = bytes.unpack(ctype, text:sub(offset + 1)) }
end

--- The bytes of a .npz archive.
---@param list { [1]: string, [2]: string }[] name and .npy bytes of each array
function arrays.pack(list)
  local entries = {}
  for i, each in ipairs(list) do entries[i] = { each[1] .. ".npy", each[2] } end
  return host.zip.pack(entries)
end

--- The .npy bytes of a .npz archive by name, or `nil, message`.
---@return table<string, string>|nil
---@return string|nil message
function arrays.unpack(text)
  local entries, message = host.zip.unpack(text)
  if not entries then return nil, message end
  local by_name = {}
  for _, entry in ipairs(entries) do by_name[entry[1]:gsub("%.npy$", "")] = entry[2] end
  return by_name
end

return arrays
