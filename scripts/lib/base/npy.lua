--- npy.lua: two-dimensional float32 arrays as NumPy files (format 1.0: magic, version, a Python
--- dictionary padded to 64 bytes, then the rows, little endian).

local npy = {}

local magic = "\147NUMPY\1\0"

--- The bytes before the data of a .npy file.
---@param rows integer
---@param columns integer
---@return string
function npy.header(rows, columns)
  local header = ("{'descr': '<f4', 'fortran_order': False, 'shape': (%d, %d), }")
    :format(rows, columns)
  -- magic, two bytes of length, header and its newline fill a multiple of 64 bytes
  local padding = -(#magic + 2 + #header + 1) % 64
  header = header .. (" "):rep(padding) .. "\n"
  return magic .. string.char(#header % 256, math.floor(#header / 256)) .. header
end

--- The bytes of a .npy file.
---@param data string little-endian float32, rows x columns
---@param rows integer
---@param columns integer
---@return string
function npy.encode(data, rows, columns)
  assert(#data == 4 * rows * columns, "npy: the data do not fill rows x columns")
  return npy.header(rows, columns) .. data
end

--- Data, rows and columns of a file of `encode`; `nil, message` for anything else.
---@param bytes string
---@return string|nil data
---@return integer|string rows_or_message
---@return integer|nil columns
function npy.decode(bytes)
  if bytes:sub(1, #magic) ~= magic then return nil, "not a NumPy file of format 1.0" end
  local low, high = bytes:byte(#magic + 1, #magic + 2)
  if not high then return nil, "cut off in its header" end
  local length = low + 256 * high
  local header = bytes:sub(#magic + 3, #magic + 2 + length)
  local rows, columns =
    header:match "'descr': '<f4', 'fortran_order': False, 'shape': %((%d+), (%d+)%)"
  if not rows then return nil, "not a two-dimensional array of little-endian float32" end
  rows, columns = tonumber(rows), tonumber(columns)
  local data = bytes:sub(#magic + 3 + length)
  if #data ~= 4 * rows * columns then
    return nil, ("holds %d bytes, its header says %d x %d float32"):format(#data, rows, columns)
  end
  return data, rows, columns
end

return npy
