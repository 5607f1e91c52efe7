--- view.lua: the engine's arrays for Lua: indices from 1, checked, read without copying, and
--- invalid once their owner has replaced or freed them. `#view` is the length, `view[i][j]` reads,
--- `ipairs(view)` iterates, `view.shape` lists the lengths, `view:copy()` keeps, `view:table()`
--- makes Lua lists, `view:pointer()` is unchecked. A writable view also takes `view[i] = number`,
--- checked.
---
--- In LuaJIT only cdata may define both `#` and `ipairs`. There are three kinds:
--- - a view of several axes is an empty struct; a table finds its state;
--- - a row of a read-only view is a struct with a copy of its numbers, so that it needs no owner
---   and a loop over `trace[i][axis]` allocates no table;
--- - the last axis of a writable view ("cells") is a struct with a pointer and all that a check
---   needs, since scripts access millions of them.

local ffi = require "ffi"
local fault = require "limax.engine.fault"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"

local view = {}

---@class limax.view
---@field shape integer[] lengths along the axes
---@field unit string|nil of the numbers
---@field rate number|nil samples per second, of a trace
---@field samples integer|nil of a trace
---@field columns string[]|nil names along the last axis, of a trace
---@field inputs string[]|nil what a controller reads, of the trace "sensor"

-- fields of a view besides its shape
local FIELDS = { unit = true, rate = true, samples = true, columns = true, inputs = true }

---@class limax.view.state
---@field form table memory, shape, owner: shared by a view and all its parts
---@field axis integer the first axis of the view among those of the form
---@field offset integer|nil of its first element; cells have none, and share one state per form
---@field [integer] limax.view its parts, each made at the first read

-- The state of each view. A struct cannot hold Lua values. The keys are weak, so that an entry goes
-- with its view: a state refers to parts of its view, and never to the view itself.
---@type table<ffi.cdata*, limax.view.state>
local states = setmetatable({}, { __mode = "k" })
local class, methods = {}, strict.methods "view"
local new_view

-- the life of views whose memory is their own
local ENDLESS = { stamp = ffi.new("int32_t[1]", 1) }

local function shape_text(shape) return "[" .. table.concat(shape, "][") .. "]" end

local function tail(list, first) return { unpack(list, first) } end

local function is_index(key, length)
  return type(key) == "number" and key >= 1 and key <= length and key == math.floor(key)
end

-- A read with a key that is neither an index nor a method.
local function refuse_key(what, key, shape)
  if type(key) == "string" then
    fault.raise(("%s has no field %q; it has shape, size, copy, table and pointer")
      :format(what, key))
  end
  fault.raise(("index %s is out of range: this %s is %s; expected a whole number from 1 to %d")
    :format(schema.show(key), what, shape_text(shape), shape[1]))
end

local function read_only(what)
  fault.raise(what .. " is read-only; an encoding or a mutation writes to robots:genes(i),"
    .. " robots:voxels(i) and robots:weights(i), other scripts to a population's genome_view,"
    .. " voxels_view and weights_view")
end

-- Adds operators that raise, in place of LuaJIT's message about a struct, to a metatable.
local function without_arithmetic(metatable)
  local function refuse()
    fault.raise "a view, or a row of one, is not a number: calculate with its numbers, as in row[1]"
  end
  for _, name in ipairs { "add", "sub", "mul", "div", "mod", "pow", "unm", "lt", "le", "concat" } do
    metatable["__" .. name] = refuse
  end
  return metatable
end

local function next_entry(self, i)
  if i < #self then return i + 1, self[i + 1] end
end

-- The iterator of ipairs and pairs.
local function entries(self) return next_entry, self, 0 end

-- ---- a row of numbers ---------------------------------------------------------------------------

---@class limax.view.row : limax.view

-- The type of rows of `length` numbers. A type for each length: compiled code then keeps a row in
-- registers.
local function make_row_type(length)
  local row = strict.methods "row"
  function row:size() return length end
  function row:copy() return self end
  function row:pointer() return self.numbers, { 1 } end
  function row:table()
    local list = {}
    for i = 1, length do list[i] = self.numbers[i - 1] end
    return list
  end
  return ffi.metatype(("struct { double numbers[%d]; }"):format(math.max(length, 1)),
    without_arithmetic {
    __index = function(self, key)
      if is_index(key, length) then return self.numbers[key - 1] end
      if key == "shape" then return { length } end
      if FIELDS[key] then return nil end
      return row[key] or refuse_key("row", key, { length })
    end,
    __newindex = function() read_only "a row of a view" end,
    __len = function() return length end,
    __ipairs = entries, __pairs = entries,
    __tostring = function() return ("row of %d numbers"):format(length) end,
  })
end

local row_types, is_row_type = {}, {}

local function row_of(form, offset)
  local axes = #form.shape
  local length, stride, data = form.shape[axes], form.strides[axes], form.data
  local row_type = row_types[length]
  if not row_type then
    row_type = make_row_type(length)
    row_types[length], is_row_type[tonumber(row_type)] = row_type, true
  end
  local row = row_type()
  for i = 0, length - 1 do row.numbers[i] = data[offset + i * stride] end
  return row
end

-- ---- a view -------------------------------------------------------------------------------------

local function part(form, axis, offset)
  local self
  if form.range and axis == #form.shape then
    self = form.cells(form.data + offset, form.life.stamp, form.shape[axis], form.stamp)
    form.cells_state = form.cells_state or { form = form, axis = axis }
    states[self] = form.cells_state
  else
    self = new_view()
    states[self] = { form = form, axis = axis, offset = offset }
  end
  return self
end

-- Part i, kept, so that loops over `view[i][j][k]` make it only once.
local function part_of(state, i)
  local form, axis = state.form, state.axis
  local made = part(form, axis + 1, state.offset + (i - 1) * form.strides[axis])
  state[i] = made
  return made
end

local function require_valid(form)
  if form.life.stamp[0] == form.stamp then return end
  fault.raise(("this view of %s ended when %s"):format(form.what,
    form.life.why or "its owner was freed"))
end

-- A read with a key that is not an index.
local function field_of(state, key)
  local form, axis = state.form, state.axis
  if key == "shape" then return tail(form.shape, axis) end
  if FIELDS[key] then return axis == 1 and form.fields and form.fields[key] or nil end
  if type(key) ~= "string" then require_valid(form) end
  return methods[key] or refuse_key("view of " .. form.what, key, tail(form.shape, axis))
end

function class:__index(key)
  local state = states[self]
  local form, axis = state.form, state.axis
  if not is_index(key, form.shape[axis]) then return field_of(state, key) end
  if form.life.stamp[0] ~= form.stamp then require_valid(form) end
  local left = #form.shape - axis
  -- a row of a writable view is a view, not a copy
  if left > 1 or left == 1 and form.range then return state[key] or part_of(state, key) end
  local offset = state.offset + (key - 1) * form.strides[axis]
  if axis < #form.shape then return row_of(form, offset) end
  return form.data[offset]
end

-- A write that is not allowed.
local function refuse_write(state, key, value)
  local form, axis, range = state.form, state.axis, state.form.range
  if not range then read_only("a view of " .. form.what) end
  if range.refusal then fault.raise(range.refusal) end
  if axis < #form.shape then
    fault.raise(("%s: give an index for each of the axes %s"):format(form.what,
      shape_text(tail(form.shape, axis))))
  end
  if not is_index(key, form.shape[axis]) then field_of(state, key) end
  if not is_index(key, form.shape[axis]) then read_only(("%s.%s"):format(form.what, key)) end
  require_valid(form)
  schema.refuse(("%s[%d]"):format(form.what, key), schema.expected(range), value)
end

function class:__newindex(key, value) refuse_write(states[self], key, value) end

function class:__len()
  local state = states[self]
  return state.form.shape[state.axis]
end

class.__ipairs, class.__pairs = entries, entries

function class:__tostring()
  local state = states[self]
  return ("view of %s %s"):format(state.form.what, shape_text(tail(state.form.shape, state.axis)))
end

new_view = ffi.metatype("struct {}", without_arithmetic(class))

-- ---- the last axis of a writable view -----------------------------------------------------------

-- The type of writable rows of an element type and a range: compiled code then has its ends as
-- constants. Its fields are read-only for scripts too.
local function make_cells_type(element, least, most, integer)
  local cells = {}
  for name, method in pairs(class) do cells[name] = method end
  function cells:__index(key)
    if is_index(key, self.count_) and self.stamp_[0] == self.made_ then
      return self.data_[key - 1]
    end
    return class.__index(self, key)
  end
  function cells:__newindex(key, value)
    -- also false for NaN
    if is_index(key, self.count_) and self.stamp_[0] == self.made_ and type(value) == "number"
      and value >= least and value <= most and (not integer or value == math.floor(value)) then
      self.data_[key - 1] = value
    else
      refuse_write(states[self], key, value)
    end
  end
  return ffi.metatype(([[struct {
    %s *const data_; const int32_t *const stamp_; const int32_t count_, made_;
  }]]):format(element), cells)
end

local cells_types = {}

local function cells_type(element, range)
  local key = ("%s %.17g %.17g %s"):format(element, range.minimum, range.maximum, range.integer)
  cells_types[key] = cells_types[key]
    or make_cells_type(element, range.minimum, range.maximum, range.integer)
  return cells_types[key]
end

--- A view over memory of an object, which it keeps alive.
---@param owner table|ffi.cdata* an object, or memory that nothing replaces
---@param what string its name in messages ("voxels")
---@param element string C type ("float")
---@param data ffi.cdata* pointer to the first element
---@param shape integer[] lengths along the axes
---@param options? { strides?: integer[], life?: limax.life, fields?: table, range?: limax.range }
--- elements between neighbours along each axis, row-major if left out; the owner's life; unit,
--- rate, samples; what scripts may write (minimum, maximum, integer; row-major), read-only if left
--- out
---@return limax.view
function view.new(owner, what, element, data, shape, options)
  options = options or {}
  local strides = options.strides or { [#shape] = 1 }
  for i = #shape - 1, 1, -1 do strides[i] = strides[i] or strides[i + 1] * shape[i + 1] end
  local life = options.life or type(owner) == "table" and owner.life or ENDLESS
  return part({ what = what, data = data, element = element, shape = shape, strides = strides,
    life = life, stamp = life.stamp[0], owner = owner, fields = options.fields,
    range = options.range, cells = options.range and cells_type(element, options.range) }, 1, 0)
end

--- Whether `value` is a view or a row of one.
---@param value any
---@return boolean
function view.is_view(value)
  return states[value] ~= nil or type(value) == "cdata" and is_row_type[tonumber(ffi.typeof(value))]
    or false
end

--- The FFI array of a view over memory of its own; nil for a view of an object, and for a part.
---@param value any
---@return ffi.cdata*|nil
function view.memory(value)
  local state = states[value]
  local owner = state and state.axis == 1 and state.form.owner
  return type(owner) == "cdata" and owner or nil
end

-- The state of the view whose method is called, and the offset of its first element.
local function state_of(name, value)
  local state = states[value] or schema.refuse("view:" .. name, "a view", value)
  return state, state.offset or value.data_ - state.form.data
end

--- Length along an axis; `#view` is that of the first.
---@param axis integer|nil 1 if left out
---@return integer
function methods:size(axis)
  local state = state_of("size", self)
  local shape = tail(state.form.shape, state.axis)
  return shape[schema.index("size: axis", axis or 1, #shape)]
end

--- A view of the same shape over its own memory, which stays valid.
---@return limax.view
function methods:copy()
  local state, first = state_of("copy", self)
  local form, shape = state.form, tail(state.form.shape, state.axis)
  require_valid(form)
  local count, place = 1, 0
  for _, length in ipairs(shape) do count = count * length end
  local buffer = ffi.new(form.element .. "[?]", math.max(count, 1))
  local function walk(axis, offset)
    for i = 0, form.shape[axis] - 1 do
      local at = offset + i * form.strides[axis]
      if axis < #form.shape then
        walk(axis + 1, at)
      else
        buffer[place] = form.data[at]
        place = place + 1
      end
    end
  end
  walk(state.axis, first)
  return view.new(buffer, form.what, form.element, buffer, shape,
    { fields = state.axis == 1 and form.fields or nil })
end

--- The numbers as nested Lua lists.
---@return table
function methods:table()
  local state, first = state_of("table", self)
  local form = state.form
  require_valid(form)
  local shape, strides, data, axes = form.shape, form.strides, form.data, #form.shape
  local function lists(axis, offset)
    local list, stride = {}, strides[axis]
    for i = 1, shape[axis] do
      local at = offset + (i - 1) * stride
      if axis == axes then list[i] = data[at] else list[i] = lists(axis + 1, at) end
    end
    return list
  end
  return lists(state.axis, first)
end

--- Pointer to the first element, without any checks: it does not keep the owner alive. The second
--- result is the list of strides, in elements.
---@return ffi.cdata* pointer
---@return integer[] strides
function methods:pointer()
  local state, first = state_of("pointer", self)
  require_valid(state.form)
  return state.form.data + first, tail(state.form.strides, state.axis)
end

return view
