--- arrays.lua: NumPy's arrays of any shape and of every kind of number, alone (.npy) or several in
--- a ZIP (.npz).

local bytes = require "limax.tools.convert.bytes"
local host = require "limax.host"

local arrays = {}

local MAGIC = "\147NUMPY"

-- NumPy's names of kinds, as C types of this machine.
local KINDS = { ["|b1"] = "uint8_t", ["|u1"] = "uint8_t", ["|i1"] = "int8_t", ["<u2"] = "uint16_t",
  ["<i2"] = "int16_t", ["<u4"] = "uint32_t", ["<i4"] = "int32_t", ["<u8"] = "uint64_t",
  ["<i8"] = "int64_t", ["<f4"] = "float", ["<f8"] = "double" }

--- Most numbers of an array that is read, and its most axes.
arrays.MOST = 1e7
arrays.MOST_AXES = 32 -- NumPy's own limit

---@class limax.convert.array
---@field shape integer[]
---@field data number[] row by row

--- The bytes of a .npy file (format 1.0).
---@param kind string NumPy's name: "<f4", "|u1", ...
---@param shape integer[]
---@param data string the numbers, row by row
---@return string
function arrays.encode(kind, shape, data)
  local lengths = {}
  for axis, length in ipairs(shape) do lengths[axis] = ("%d,"):format(length) end
  local header = ("{'descr': '%s', 'fortran_order': False, 'shape': (%s), }"):format(kind,
    table.concat(lengths, " "))
  -- magic, version, two bytes of length, header and its newline fill a multiple of 64 bytes
  header = header .. (" "):rep(-(#MAGIC + 4 + #header + 1) % 64) .. "\n"
  return MAGIC .. "\1\0" .. bytes.pack("uint16_t", { #header }) .. header .. data
end

--- The same of a list of numbers.
---@param kind string
---@param shape integer[]
---@param list number[]
---@return string
function arrays.of_list(kind, shape, list)
  return arrays.encode(kind, shape, bytes.pack(KINDS[kind], list))
end

-- The lengths of the axes and how many numbers that makes, from the header's "3, 4".
local function shape_of(text)
  local shape, count = {}, 1
  for word in text:gmatch "[^,%s]+" do
    local length = word:match "^%d+$" and tonumber(word)
    if not length or length > arrays.MOST or #shape == arrays.MOST_AXES then
      return nil, ("has the shape (%s); legal are up to %d whole numbers from 0 to %d"):format(
        text:sub(1, 40), arrays.MOST_AXES, arrays.MOST)
    end
    shape[#shape + 1] = length
    count = count * length
  end
  if count > arrays.MOST then
    return nil, ("has %g numbers; at most %d are read"):format(count, arrays.MOST)
  end
  return shape, count
end

--- Reads a .npy file of numbers; `nil, message` for anything else. Objects (pickles) are refused.
---@param text string
---@return limax.convert.array|nil
---@return string|nil message
function arrays.decode(text)
  if text:sub(1, #MAGIC) ~= MAGIC or #text < 12 then return nil, "is no NumPy array" end
  local major = text:byte(7)
  if major ~= 1 and major ~= 2 then
    return nil, ("has NumPy's format %d; legal are 1 and 2"):format(major)
  end
  local width = major == 1 and 2 or 4
  local length = bytes.unpack(width == 2 and "uint16_t" or "uint32_t", text:sub(9, 8 + width))[1]
  local header = text:sub(9 + width, 8 + width + length)
  if #header < length then
    return nil, ("is cut short: its header has %d bytes of %d"):format(#header, length)
  end
  if header:find "'descr':%s*%[" then return nil, "is an array of records; legal are numbers" end
  local kind = header:match "'descr':%s*'([^']*)'"
  local order = header:match "'fortran_order':%s*(%a+)"
  local shape_text = header:match "'shape':%s*%(([^()]*)%)"
  if not kind or not shape_text or not order then
    return nil, "has a header without descr, fortran_order or shape"
  end
  local ctype = KINDS[kind] or KINDS[kind:gsub("^=", "<")]
  if not ctype then
    return nil, ("has numbers of kind %q; legal are bool, int, uint and float of up to 8 bytes,"
      .. " little-endian"):format(kind:sub(1, 20))
  end
  if order ~= "False" then return nil, "is in Fortran's order; legal is C's" end
  local shape, count = shape_of(shape_text)
  if not shape then return nil, count end
  local data = bytes.unpack(ctype, text:sub(9 + width + length))
  if #data ~= count then
    return nil, ("holds %d numbers, its header says %d"):format(#data, count)
  end
  return { shape = shape, data = data }
end

--- The bytes of a .npz file.
---@param list { [1]: string, [2]: string }[] name and .npy bytes of each array
---@return string
function arrays.pack(list)
  local entries = {}
  for i, each in ipairs(list) do entries[i] = { each[1] .. ".npy", each[2] } end
  return host.zip.pack(entries)
end

--- The .npy bytes in a .npz file, by name; `nil, message` if it is none.
---@param text string
---@return table<string, string>|nil
---@return string|nil message
function arrays.unpack(text)
  local entries, message = host.zip.unpack(text)
  if not entries then return nil, message end
  local by_name = {}
  for _, entry in ipairs(entries) do
    local name = entry[1]:match "^(.*)%.npy$"
    if name and by_name[name] then return nil, ("has two arrays %q"):format(name:sub(1, 40)) end
    if name then by_name[name] = entry[2] end
  end
  return by_name
end

return arrays
