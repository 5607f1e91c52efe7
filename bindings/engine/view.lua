--- view.lua: the engine's arrays for Lua: indices from 1, checked, read without copying, and
--- invalid once their owner has replaced or freed them. `view[i][j]` reads,
--- `view.shape` lists the lengths (`#view` and `ipairs` do not work on views), `view:copy()` keeps,
--- `view:table()` makes Lua lists, `view:pointer()` is unchecked.
---
--- A view is a small table over a form that all its rows share. All rows of a view are made when
--- the first one is read, and kept, so that loops over `view[i][j][k]` allocate only once.

local ffi = require "ffi"
local new_table = require "table.new"
local fault = require "limax.engine.fault"
local schema = require "limax.engine.schema"

local view = {}

-- a view of more rows makes them on each use: kept rows would need more memory than the data
local MAX_ROWS = 131072

---@class limax.view
---@field shape integer[] lengths along the axes
---@field unit string|nil of the numbers
---@field rate number|nil samples per second, of a trace
---@field samples integer|nil of a trace

-- fields of a view besides its shape
local FIELDS = { unit = true, rate = true, samples = true }

local methods = {}
local branch = {} -- a view whose entries are rows
local leaf = {}   -- a view whose entries are numbers

local function shape_text(form, axis)
  local lengths = {}
  for i = axis, #form.shape do lengths[#lengths + 1] = ("[%d]"):format(form.shape[i]) end
  return table.concat(lengths)
end

local function tail(form, axis)
  local lengths = {}
  for i = axis, #form.shape do lengths[#lengths + 1] = form.shape[i] end
  return lengths
end

local function axis_of(self) return rawget(self, "axis") or #self.form.shape end

-- The part of a form from an axis on. A branch gets its array part at once: growing it would change
-- the table's layout, for which compiled code is specialised.
local function part(form, axis, offset)
  if axis == #form.shape then return setmetatable({ form = form, offset = offset }, leaf) end
  local self = new_table(form.keeps_rows and form.shape[axis] or 0, 3)
  self.form, self.offset, self.axis = form, offset, axis
  return setmetatable(self, branch)
end

local function ended(form)
  fault.raise(("this view of %s ended when %s"):format(form.what,
    form.life.why or "its owner was freed"))
end

-- A read with a key that is not a valid index.
local function miss(self, key)
  local method = methods[key]
  if method then return method end
  local form, axis = self.form, axis_of(self)
  if key == "shape" then return tail(form, axis) end
  if type(key) == "string" then
    if FIELDS[key] then return axis == 1 and form.fields and form.fields[key] or nil end
    local text = "a view of %s has no field %q; it has shape, size, copy, table and pointer"
    fault.raise(text:format(form.what, key))
  end
  if form.life.stamp ~= form.stamp then ended(form) end
  local length = form.shape[axis]
  local text = "index %s is out of range: this view of %s is %s; "
    .. "expected a whole number from 1 to %d"
  fault.raise(text:format(schema.show(key), form.what, shape_text(form, axis), length))
end

function leaf:__index(key)
  local form = self.form
  if type(key) == "number" and key >= 1 and key <= form.leaf_length and key == math.floor(key)
      and form.life.stamp == form.stamp then
    return form.data[self.offset + (key - 1) * form.leaf_stride]
  end
  return miss(self, key)
end

function branch:__index(key)
  local form, axis = self.form, self.axis
  if type(key) == "number" and key >= 1 and key <= form.shape[axis] and key == math.floor(key)
      and form.life.stamp == form.stamp then
    local offset, stride = self.offset, form.strides[axis]
    if not form.keeps_rows then return part(form, axis + 1, offset + (key - 1) * stride) end
    -- all rows at once: later reads find them without this function
    for i = 1, form.shape[axis] do
      rawset(self, i, part(form, axis + 1, offset + (i - 1) * stride))
    end
    return rawget(self, key)
  end
  return miss(self, key)
end

local function read_only(self)
  local text = "a view of %s is read-only; write through its owner, or unchecked through :pointer()"
  fault.raise(text:format(self.form.what))
end
leaf.__newindex, branch.__newindex = read_only, read_only

local function text(self)
  return ("view of %s %s"):format(self.form.what, shape_text(self.form, axis_of(self)))
end
leaf.__tostring, branch.__tostring = text, text

--- A view over memory of another object.
---@param options table
---   what     its name in messages ("voxels")
---   data     pointer to the first element
---   element  its C type ("float")
---   shape    lengths along the axes
---   strides  elements between neighbours along each axis; row-major if left out
---   life     limax.life of what owns the memory
---   owner    kept alive by the view
---   fields   unit, rate, samples
---@return limax.view
function view.new(options)
  local shape, strides = options.shape, options.strides
  local axes = #shape
  if not strides then
    strides = {}
    local stride = 1
    for i = axes, 1, -1 do
      strides[i] = stride
      stride = stride * shape[i]
    end
  end
  local rows = 1
  for i = 1, axes - 1 do rows = rows * shape[i] end
  local form = {
    what = options.what, data = options.data, element = options.element,
    shape = shape, strides = strides, leaf_length = shape[axes], leaf_stride = strides[axes],
    life = options.life, stamp = options.life.stamp, owner = options.owner,
    fields = options.fields, keeps_rows = rows <= MAX_ROWS,
  }
  return part(form, 1, 0)
end

--- Whether `value` is a view.
---@param value any
---@return boolean
function view.is_view(value)
  if type(value) ~= "table" then return false end
  local class = getmetatable(value)
  return class == leaf or class == branch
end

-- Raises unless `self` of a method is a view.
local function require_view(name, value)
  if view.is_view(value) then return end
  schema.refuse("view:" .. name, "a view (call it with a colon)", value)
end

--- Length along an axis.
---@param axis integer|nil 1 if left out
---@return integer
function methods:size(axis)
  require_view("size", self)
  local shape = self.shape
  return shape[schema.index("size: axis", axis or 1, #shape)]
end

-- Calls `act(place, value)` for every element in row-major order.
local function each(self, act)
  local form = self.form
  if form.life.stamp ~= form.stamp then ended(form) end
  local shape, strides, data, axes = form.shape, form.strides, form.data, #form.shape
  local place = 0
  local function walk(axis, offset)
    local stride = strides[axis]
    for i = 0, shape[axis] - 1 do
      if axis == axes then
        act(place, data[offset + i * stride])
        place = place + 1
      else
        walk(axis + 1, offset + i * stride)
      end
    end
  end
  walk(axis_of(self), self.offset)
end

--- A view of the same shape over its own memory, which stays valid.
---@return limax.view
function methods:copy()
  require_view("copy", self)
  local form = self.form
  local shape = tail(form, axis_of(self))
  local count = 1
  for _, length in ipairs(shape) do count = count * length end
  local buffer = ffi.new(form.element .. "[?]", math.max(count, 1))
  each(self, function(place, value) buffer[place] = value end)
  return view.new {
    what = form.what, data = buffer, element = form.element, shape = shape,
    life = { stamp = 1 }, owner = buffer, fields = axis_of(self) == 1 and form.fields or nil,
  }
end

--- The numbers as nested Lua lists.
---@return table
function methods:table()
  require_view("table", self)
  local form = self.form
  if form.life.stamp ~= form.stamp then ended(form) end
  local shape, strides, data, axes = form.shape, form.strides, form.data, #form.shape
  local function lists(axis, offset)
    local list, stride = {}, strides[axis]
    for i = 1, shape[axis] do
      local at = offset + (i - 1) * stride
      if axis == axes then list[i] = data[at] else list[i] = lists(axis + 1, at) end
    end
    return list
  end
  return lists(axis_of(self), self.offset)
end

--- Pointer to the first element, without any checks: it does not keep the owner alive. The second
--- result is the list of strides, in elements.
---@return ffi.cdata* pointer
---@return integer[] strides
function methods:pointer()
  require_view("pointer", self)
  local form = self.form
  if form.life.stamp ~= form.stamp then ended(form) end
  local strides = {}
  for i = axis_of(self), #form.strides do strides[#strides + 1] = form.strides[i] end
  return form.data + self.offset, strides
end

return view
