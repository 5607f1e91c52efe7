--- npy.lua: NumPy's arrays of numbers: one in a .npy file (format 1.0), several in a .npz archive.

local ffi = require "ffi"
local bytes = require "limax.base.bytes"
local host = require "limax.host"

local npy = {}

local MAGIC = "\147NUMPY\1\0"

-- C type of each of NumPy's types that is read.
local C_TYPES = { ["|b1"] = "uint8_t", ["|u1"] = "uint8_t", ["|i1"] = "int8_t",
  ["<u2"] = "uint16_t", ["<i2"] = "int16_t", ["<u4"] = "uint32_t", ["<i4"] = "int32_t",
  ["<u8"] = "uint64_t", ["<i8"] = "int64_t", ["<f4"] = "float", ["<f8"] = "double" }

---@class limax.npy.array
---@field kind string NumPy's type, as in "<f4"
---@field shape integer[]
---@field count integer numbers in the array
---@field data string little-endian, in row-major order

--- The bytes before the data of a .npy file.
---@param kind string NumPy's type: "<f4", "|u1", ...
function npy.header(kind, shape)
  local header = ("{'descr': '%s', 'fortran_order': False, 'shape': (%s%s), }"):format(kind,
    table.concat(shape, ", "), #shape == 1 and "," or "")
  -- magic, two bytes of length, header and its newline fill a multiple of 64 bytes
  header = header .. (" "):rep(-(#MAGIC + 2 + #header + 1) % 64) .. "\n"
  return MAGIC .. bytes.pack("uint16_t", { #header }) .. header
end

--- The bytes of a .npy file.
---@param kind string NumPy's type
---@param data string|number[] in row-major order
function npy.encode(kind, shape, data)
  if type(data) == "table" then data = bytes.pack(C_TYPES[kind], data) end
  return npy.header(kind, shape) .. data
end

--- The bytes of a .npy file with a table of numbers.
---@param rows number[][] of equal length
function npy.table(rows)
  local numbers, width = {}, #rows[1]
  for i, row in ipairs(rows) do
    for k = 1, width do numbers[(i - 1) * width + k] = row[k] end
  end
  return npy.encode("<f8", { #rows, width }, numbers)
end

--- Reads a .npy file of numbers; `nil, message` for anything else, pickled objects included.
function npy.decode(text)
  if text:sub(1, #MAGIC) ~= MAGIC or #text < 10 then
    return nil, "is not a NumPy array of format 1.0"
  end
  local offset = 10 + bytes.unpack("uint16_t", text:sub(9, 10))[1]
  local header = text:sub(11, offset)
  local kind = (header:match "'descr':%s*'([^']*)'" or "unknown"):gsub("^=", "<")
  local ctype = C_TYPES[kind]
  if not ctype then
    return nil, ("has elements of type %q; expected bool, int, uint or float of up to 8 bytes,"
      .. " little-endian"):format(kind:sub(1, 20))
  end
  if not header:find "'fortran_order':%s*False" then return nil, "is not in C (row-major) order" end
  local shape, count = {}, 1
  for word in (header:match "'shape':%s*%(([^()]*)%)" or "0"):gmatch "%d+" do
    shape[#shape + 1], count = tonumber(word), count * tonumber(word)
  end
  if #text - offset ~= count * ffi.sizeof(ctype) then
    return nil, ("holds %d bytes; its header states %g numbers of type %s"):format(
      #text - offset, count, kind)
  end
  return { kind = kind, shape = shape, count = count, data = text:sub(offset + 1) }
end

--- The numbers of an array in row-major order.
function npy.numbers(array) return bytes.unpack(C_TYPES[array.kind], array.data) end

--- The bytes of a .npz archive.
---@param list { [1]: string, [2]: string }[] name and .npy bytes of each array
function npy.pack(list)
  local entries = {}
  for i, each in ipairs(list) do entries[i] = { each[1] .. ".npy", each[2] } end
  return host.zip.pack(entries)
end

--- The .npy bytes of a .npz archive by name, or `nil, message`.
function npy.unpack(text)
  local entries, message = host.zip.unpack(text)
  if not entries then return nil, message end
  local by_name = {}
  for _, entry in ipairs(entries) do by_name[entry[1]:gsub("%.npy$", "")] = entry[2] end
  return by_name
end

return npy
