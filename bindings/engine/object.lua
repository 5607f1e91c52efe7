--- object.lua: the common part of all objects over a C handle: a handle that `:free()` or the
--- garbage collector ends, a stamp by which views detect that their data are gone, errors for freed
--- objects, and fields that scripts cannot change, because memory is read by their sizes.

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local fault = require "limax.engine.fault"
local memory = require "limax.engine.memory"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"

local object = {}

---@class limax.life
---@field stamp ffi.cdata* int32_t[1], increases whenever the data of the views are replaced
---@field why string|nil why it increased last, with the line

--- A new life.
function object.life() return { stamp = ffi.new("int32_t[1]", 1) } end

--- Invalidates every view of `life` that exists now.
---@param why string completes "this view ended when ..."
function object.end_views(life, why)
  life.stamp[0] = life.stamp[0] + 1
  life.why = ("%s (%s)"):format(why, fault.where())
end

-- the metatable of every class, as a set
local classes = {}

-- The key of an object's fields. The object itself is empty, so that every assignment is noticed.
local FIELDS = {}

--- Sets a field of an object.
function object.set(self, name, value) rawget(self, FIELDS)[name] = value end

---@class limax.object
---@field handle ffi.cdata*|nil nil once freed
---@field life limax.life
---@field bodies_life limax.life|nil of a population's views of bodies
---@field writing_life limax.life|nil of those through which a script writes bodies
local shared = {}

--- Frees the object and its memory in the engine, and invalidates its views. May be called twice.
---@param why string|nil completes "this view ended when ..."
function shared:free(why)
  local handle = self.handle
  if not handle then return end
  -- C frees last: an error or an interrupt on the way leaves the handle to the garbage collector,
  -- and never an object that would free it again
  object.set(self, "freed", fault.where())
  object.set(self, "handle", nil)
  why = why or ("its %s was freed"):format(self.kind_name)
  object.end_views(self.life, why)
  for _, life in ipairs { "bodies_life", "writing_life" } do
    if self[life] then object.end_views(self[life], why) end
  end
  memory.freed()
  self.end_handle(ffi.gc(handle, nil))
end

local function with_article(noun) return (noun:match "^[aeiou]" and "an " or "a ") .. noun end

--- Raises unless `value` is an object of `class`, freed or not.
---@param what string the argument's name in messages
function object.require(what, value, class)
  if type(value) == "table" and getmetatable(value) == class then return end
  local came = type(value)
  local other = came == "table" and getmetatable(value)
  if classes[other] then came = other.methods.kind_name end
  fault.raise(("%s: expected %s, got %s"):format(what, with_article(class.methods.kind_name),
    came == "nil" and "nil" or with_article(came)))
end

--- A class: a metatable whose methods include `:free()`.
---@param kind_name string the word for it in messages
---@param c_name string of its C type and functions: "population" for limax_population
---@return table class methods go into class.methods
function object.class(kind_name, c_name)
  local methods = strict.methods(kind_name, { kind_name = kind_name,
    end_handle = abi.C["limax_" .. c_name .. "_free"] })
  methods.free = shared.free
  local class = { methods = methods, result = ffi.typeof("limax_" .. c_name .. " *[1]") }
  classes[class] = true
  function class.__index(self, key)
    local value = rawget(self, FIELDS)[key]
    if value == nil then return methods[key] end
    return value
  end
  function class.__newindex(_, key)
    fault.raise(("%s: the fields of %s are read-only; keep your own values in a table of your own")
      :format(tostring(key), with_article(kind_name)))
  end
  function class.__tostring(self) return self.handle and kind_name or "freed " .. kind_name end
  return class
end

--- Makes an object of `class`.
---@param what string|nil the call, put in front of an error's text
---@param make fun(out: ffi.cdata*): integer calls the C function that stores the handle in out[0]
function object.make(class, what, make, fields)
  memory.collect()
  local out = class.result()
  abi.check(make(out), what)
  fields = fields or {}
  -- the C function itself: the finaliser table would keep a closure, and so its owner, alive
  fields.handle = ffi.gc(out[0], class.methods.end_handle)
  fields.life = object.life()
  return setmetatable({ [FIELDS] = fields }, class)
end

--- The handle of `value`, which must be an object of `class` that is not freed.
---@param what string the argument's name in messages
function object.handle(what, value, class)
  object.require(what, value, class)
  if not value.handle then
    fault.raise(("%s: this %s was freed (%s)"):format(what, value.kind_name, value.freed))
  end
  return value.handle
end

--- The handle of `value`, and its entry i as the C interface counts, from 0.
function object.entry(what, value, class, i)
  local handle = object.handle(what, value, class)
  return handle, schema.index(what, i, value.count) - 1
end

return object
