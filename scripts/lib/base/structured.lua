--- structured.lua: NumPy's structured arrays: rows of named fields side by side, the same bytes in
--- memory and in a .npy file (format 2.0). A field is a number, a text, a list of one length, or a
--- struct of fields, which may be one of the engine.

local ffi = require "ffi"

local bytes = require "limax.base.bytes"

local structured = {}

-- C type and size of each of NumPy's types of numbers.
local NUMBERS = { i4 = { "int32_t", 4 }, i8 = { "int64_t", 8 }, u8 = { "uint64_t", 8 },
  f8 = { "double", 8 } }

-- Limits of a header, which may come from somebody else.
local MOST_FIELDS, MOST_DEPTH, MOST_BYTES = 10000, 8, 2 ^ 31

---@class limax.structured.field
---@field name string
---@field kind string|limax.structured.field[] "i4", "i8", "u8", "f8", "S16" (a text of 16 bytes),
--- or the fields of a struct
---@field count integer|nil of a list
---@field struct string|nil name of that struct in C; without one its fields are doubles, an array
--- in C

---@class limax.structured.layout
---@field fields limax.structured.field[]
---@field size integer bytes of a row
---@field places table<string, { offset: integer, size: integer, field: limax.structured.field }>
---@field descr string as NumPy writes it; layouts with the same one are equal
---@field array ffi.ctype*|nil "struct { ... }[?]"; nil of an array that was read

---@class limax.structured.array
---@field layout limax.structured.layout
---@field count integer rows
---@field data ffi.cdata* struct[count]; const uint8_t * of an array that was read
---@field bytes string|nil that `data` points into

-- NumPy's name of a kind, and the bytes of one value; nil for an unknown kind.
local function described(kind)
  if type(kind) == "table" then
    local parts, size = {}, 0
    for k, field in ipairs(kind) do
      local text, each = described(field.kind)
      if not text then return nil end
      parts[k] = ("('%s', %s%s)"):format(field.name, text,
        field.count and (", (%d,)"):format(field.count) or "")
      size = size + each * (field.count or 1)
    end
    return "[" .. table.concat(parts, ", ") .. "]", size
  end
  if NUMBERS[kind] then return ("'<%s'"):format(kind), NUMBERS[kind][2] end
  local width = tonumber(kind:match "^S(%d+)$")
  if width then return ("'|%s'"):format(kind), width end
end

local function is_text(field) return type(field.kind) == "string" and field.kind:match "^S" end

--- Have two fields values of one form? Texts may differ in their length.
function structured.same_kind(a, b)
  if is_text(a) and is_text(b) then return a.count == b.count end
  return a.count == b.count and described(a.kind) == described(b.kind)
end

-- The declaration of a field as the member of a struct.
local function member(field)
  local kind, lists = field.kind, field.count and ("[%d]"):format(field.count) or ""
  if field.struct then return ("%s %s%s;"):format(field.struct, field.name, lists) end
  if type(kind) == "table" then return ("double %s[%d];"):format(field.name, #kind) end
  if NUMBERS[kind] then return ("%s %s%s;"):format(NUMBERS[kind][1], field.name, lists) end
  return ("char %s[%s];"):format(field.name, kind:sub(2))
end

-- Offsets and sizes of fields in a row.
local function placed(fields)
  local places, offset = {}, 0
  for _, field in ipairs(fields) do
    local _, each = described(field.kind)
    local size = each * (field.count or 1)
    places[field.name], offset = { offset = offset, size = size, field = field }, offset + size
  end
  return places, offset
end

-- C types are never collected: one for each layout.
local made = {}

--- Makes the layout of an array.
---@param fields limax.structured.field[] each of a multiple of 8 bytes, so that C adds no padding
function structured.layout(fields)
  local descr = described(fields)
  if made[descr] then return made[descr] end
  local places, size = placed(fields)
  local members = {}
  for k, field in ipairs(fields) do members[k] = member(field) end
  local row = ffi.typeof(("struct { %s }"):format(table.concat(members, " ")))
  assert(ffi.sizeof(row) == size, "a field is not a multiple of 8 bytes")
  made[descr] = { fields = fields, size = size, places = places, descr = descr,
    array = ffi.typeof("$[?]", row) }
  return made[descr]
end

--- Makes an array of zeros.
function structured.new(layout, count)
  return { layout = layout, count = count, data = ffi.new(layout.array, count) }
end

--- The bytes of a .npy file before those of the rows.
function structured.header(layout, count)
  local text = ("{'descr': %s, 'fortran_order': False, 'shape': (%d,), }"):format(layout.descr,
    count)
  -- magic, length, text and line break fill a multiple of 64 bytes
  text = text .. (" "):rep(-(12 + #text + 1) % 64) .. "\n"
  return "\147NUMPY\2\0" .. bytes.pack("uint32_t", { #text }) .. text
end

-- The parts of a row that are copied between two layouts: { into, from, bytes }.
local function plan_of(to, from)
  local list = {}
  for name, place in pairs(to.places) do
    local other = from.places[name]
    if other and type(place.field.kind) == "table" and not place.field.struct then
      -- its fields by their names
      local theirs = placed(other.field.kind)
      for inner, at in pairs((placed(place.field.kind))) do
        if theirs[inner] then
          list[#list + 1] = { place.offset + at.offset, other.offset + theirs[inner].offset,
            at.size }
        end
      end
    elseif other and (described(other.field.kind) == described(place.field.kind)
      or is_text(place.field) and is_text(other.field)) then
      list[#list + 1] = { place.offset, other.offset, math.min(place.size, other.size) }
    end
  end
  return list
end

-- Plans by the two layouts.
local plans = setmetatable({}, { __mode = "k" })

--- Copies rows from one array to another. Where the layouts differ, fields are copied by name, and
--- those that `from` lacks or has in another form stay as they are; of a list the first values are
--- copied.
---@param i integer its first row, from 0
---@param j integer likewise
---@param count integer rows
function structured.copy(to, i, from, j, count)
  local into = ffi.cast("uint8_t *", to.data) + i * to.layout.size
  local source = ffi.cast("const uint8_t *", from.data) + j * from.layout.size
  if to.layout.descr == from.layout.descr then
    ffi.copy(into, source, count * to.layout.size)
    return
  end
  local of_layout = plans[to.layout] or setmetatable({}, { __mode = "k" })
  plans[to.layout] = of_layout
  of_layout[from.layout] = of_layout[from.layout] or plan_of(to.layout, from.layout)
  for _, part in ipairs(of_layout[from.layout]) do
    local a, b, size = part[1], part[2], part[3]
    for k = 0, count - 1 do
      ffi.copy(into + k * to.layout.size + a, source + k * from.layout.size + b, size)
    end
  end
end

-- Reads the value of Python that begins at `at`: a text, a number, True, False, or a list, tuple or
-- dictionary of these. Returns the value and where it ends; nil for anything else.
local function parse(text, at, depth)
  at = text:find("%S", at)
  if not at or depth > MOST_DEPTH then return nil end
  local quoted, quoted_end = text:match("^'([^'\\\n]*)'()", at)
  if quoted then return quoted, quoted_end end
  local word, word_end = text:match("^(%w+)()", at)
  if word == "True" or word == "False" then return word == "True", word_end end
  if word then return word:match "^%d+$" and #word < 16 and tonumber(word) or nil, word_end end
  local close = ({ ["["] = "]", ["("] = ")", ["{"] = "}" })[text:sub(at, at)]
  if not close then return nil end
  local list, is_map = {}, close == "}"
  at = at + 1
  while true do
    at = text:find("%S", at)
    if not at then return nil end
    if text:sub(at, at) == close then return list, at + 1 end
    local value, key
    value, at = parse(text, at, depth + 1)
    if value == nil or #list > MOST_FIELDS then return nil end
    if is_map then
      key, at = value, text:match("^%s*:()", at)
      if type(key) ~= "string" or not at then return nil end
      value, at = parse(text, at, depth + 1)
      if value == nil then return nil end
    end
    list[key or #list + 1] = value
    at = text:match("^%s*,()", at) or at
    if not text:find("^%s*[%]%)},%['%({%w]", at) then return nil end
  end
end

-- The fields of a parsed description; nil and what is wrong.
local function fields_of(descr, budget)
  local fields, seen = {}, {}
  if type(descr) ~= "table" then return nil, "its type is no list of fields" end
  for k, entry in ipairs(descr) do
    budget.left = budget.left - 1
    if budget.left < 0 then return nil, ("has more than %d fields"):format(MOST_FIELDS) end
    local name, kind, shape = unpack(type(entry) == "table" and entry or {})
    if type(name) ~= "string" or not name:match "^[%a_][%w_]*$" or seen[name] then
      return nil, ("its field %d has no name of its own"):format(k)
    end
    seen[name] = true
    local field = { name = name }
    if type(kind) == "table" then
      local message
      field.kind, message = fields_of(kind, budget)
      if not field.kind then return nil, message end
    else
      field.kind = type(kind) == "string" and kind:gsub("^[<|=]", "") or "unknown"
    end
    if not described(field.kind) then
      return nil, ("its field %s is of type %q; expected <i4, <i8, <u8, <f8 or a text"):format(name,
        tostring(field.kind):sub(1, 20))
    end
    if shape ~= nil then
      field.count = type(shape) == "table" and #shape == 1 and tonumber(shape[1]) or nil
      if not field.count or field.count > MOST_BYTES then
        return nil, ("its field %s is no list of one length"):format(name)
      end
    end
    fields[k] = field
  end
  return fields
end

--- Reads the bytes of a .npy file with a structured array; `nil, message` for anything else. The
--- bytes are not copied.
function structured.read(text)
  local version = text:match "^\147NUMPY([\1\2])%z"
  if not version or #text < 12 then return nil, "is not a NumPy array of format 1.0 or 2.0" end
  local kind, first = "uint32_t", 12
  if version == "\1" then kind, first = "uint16_t", 10 end
  local length = bytes.unpack(kind, text:sub(9, first))[1]
  if length > #text - first then return nil, "ends within its header" end
  local header = parse(text:sub(first + 1, first + length), 1, 0)
  if type(header) ~= "table" or type(header.shape) ~= "table" then
    return nil, "has a header that is not NumPy's"
  elseif header.fortran_order ~= false or #header.shape ~= 1
    or type(header.shape[1]) ~= "number" then
    return nil, "is not one row after the other"
  end
  local fields, message = fields_of(header.descr, { left = MOST_FIELDS })
  if not fields then return nil, message end
  local places, size = placed(fields)
  local count, rest = header.shape[1], #text - first - length
  -- divided, since a product may be too large to be exact
  if size == 0 or size > MOST_BYTES or rest % size ~= 0 or rest / size ~= count then
    return nil, ("holds %d bytes; its header states %.0f rows of %.0f bytes"):format(rest, count,
      size)
  end
  return { layout = { fields = fields, size = size, places = places, descr = described(fields) },
    count = count, bytes = text,
    data = ffi.cast("const uint8_t *", text) + (first + length) }
end

return structured
