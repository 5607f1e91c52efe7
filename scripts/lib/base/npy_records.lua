--- npy_records.lua: rows of fields as a NumPy array of records (.npy, format 2.0): the fields of a
--- row side by side. `host.rows.lines` makes lines of JSON of the file.

local ffi = require "ffi"

local bytes = require "limax.base.bytes"

local npy_records = {}

-- C type of each of NumPy's types.
local C_TYPES = { ["<f8"] = "double", ["<i8"] = "int64_t", ["<i4"] = "int32_t", ["|b1"] = "uint8_t",
  ["|S"] = "char" }

---@class limax.npy.field
---@field name string with `a.b` for field `b` of `a`, `a[1]` for the first entry of the list `a`
---@field kind string NumPy's type; of a text "|S"
---@field count integer|nil values of a list
---@field width integer|nil bytes of a text
---@field memory ffi.cdata* array that holds the values
---@field offset integer|nil bytes from its beginning to the first value; 0
---@field stride integer|nil bytes from one row to the next; those of the values

--- A field of the numbers of a list by row, in which nil is none.
---@param rows integer
---@param values table<integer, number>
---@return limax.npy.field
function npy_records.numbers(name, kind, values, rows)
  local memory = ffi.new(C_TYPES[kind] .. "[?]", rows)
  local none = kind == "<f8" and 0 / 0 or -1
  for i = 1, rows do memory[i - 1] = values[i] or none end
  return { name = name, kind = kind, memory = memory }
end

--- Likewise of lists of numbers, the longest of which sets the length.
---@param lists table<integer, number[]>
---@return limax.npy.field
function npy_records.lists(name, lists, rows)
  local count = 0
  for i = 1, rows do count = math.max(count, lists[i] and #lists[i] or 0) end
  local memory = ffi.new("double[?]", rows * count)
  for i = 1, rows do
    local list = lists[i]
    for k = 1, count do memory[(i - 1) * count + k - 1] = list and list[k] or 0 / 0 end
  end
  return { name = name, kind = "<f8", memory = memory, count = count }
end

--- Likewise of texts.
---@param texts table<integer, string>
---@return limax.npy.field
function npy_records.texts(name, texts, rows)
  local width = 0
  for i = 1, rows do width = math.max(width, texts[i] and #texts[i] or 0) end
  local memory = ffi.new("char[?]", rows * width)
  for i = 1, rows do
    if texts[i] then ffi.copy(memory + (i - 1) * width, texts[i], #texts[i]) end
  end
  return { name = name, kind = "|S", memory = memory, width = width }
end

-- The bytes of a field in a row.
local function size_of(field)
  return field.width or ffi.sizeof(C_TYPES[field.kind]) * (field.count or 1)
end

local function first_of(field)
  return ffi.cast("const uint8_t *", field.memory) + (field.offset or 0)
end

-- Does any row have a value? Of whole numbers only memory with values is passed.
local function has_values(field, rows)
  if size_of(field) == 0 then return false end
  if field.kind ~= "<f8" then return true end
  local from, stride = first_of(field), field.stride or size_of(field)
  for i = 0, rows - 1 do
    local value = ffi.cast("const double *", from + i * stride)[0]
    if value - value == 0 then return true end
  end
  return false
end

-- Copies the values of a field into its place of every row. Of numbers that belong together all are
-- NaN if one is not finite.
local function fill(field, rows, to, width)
  local from, size = first_of(field), size_of(field)
  local stride, is_vector = field.stride or size, field.kind == "<f8" and field.stride
  for i = 0, rows - 1 do ffi.copy(to + i * width, from + i * stride, size) end
  for i = 0, is_vector and rows - 1 or -1 do
    local values, sum = ffi.cast("double *", to + i * width), 0
    for k = 0, (field.count or 1) - 1 do sum = sum + (values[k] - values[k]) end
    for k = 0, sum == 0 and -1 or (field.count or 1) - 1 do values[k] = 0 / 0 end
  end
end

local function header_of(fields, rows)
  local types = {}
  for k, field in ipairs(fields) do
    types[k] = ("('%s', '%s%s'%s), "):format(field.name, field.kind, field.width or "",
      field.count and (", (%d,)"):format(field.count) or "")
  end
  local text = ("{'descr': [%s], 'fortran_order': False, 'shape': (%d,), }"):format(
    table.concat(types), rows)
  -- magic, length, text and line break fill a multiple of 64 bytes
  text = text .. (" "):rep(-(12 + #text + 1) % 64) .. "\n"
  return "\147NUMPY\2\0" .. bytes.pack("uint32_t", { #text }) .. text
end

--- The bytes of a .npy file. A field that no row has is left out.
---@param rows integer
---@param fields limax.npy.field[]
function npy_records.pack(rows, fields)
  local there, width = {}, 0
  for _, field in ipairs(fields) do
    if has_values(field, rows) then
      there[#there + 1], width = field, width + size_of(field)
    end
  end
  local header = header_of(there, rows)
  local size = #header + rows * width
  local memory = ffi.new("uint8_t[?]", size)
  ffi.copy(memory, header, #header)
  local to = memory + #header
  for _, field in ipairs(there) do
    fill(field, rows, to, width)
    to = to + size_of(field)
  end
  return ffi.string(memory, size)
end

return npy_records
