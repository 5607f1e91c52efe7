--- device.lua: where robots are expressed, simulated and bred: `engine.device("cpu", { threads = 2
--- })`.

local abi = require "limax.engine.abi"
local fault = require "limax.engine.fault"
local object = require "limax.engine.object"
local schema = require "limax.engine.schema"

local C = abi.C
local class = object.class("device", "device")
local methods = class.methods

---@class limax.device : limax.object
---@field name string as requested
---@field kind string "cpu" or "cuda"
---@field threads integer

local MOST_THREADS = 1024

-- Threads if the script names no number; 0 is one per core.
local function threads_of_environment()
  local text = os.getenv "LIMAX_THREADS"
  if not text or text == "" then return 0 end
  local threads, message = schema.whole(1, MOST_THREADS)(tonumber(text) or text, "LIMAX_THREADS")
  if message then fault.throw { kind = "usage", status = 2, text = message } end
  return threads
end

local options_rule =
  schema.fields { threads = schema.whole(0, MOST_THREADS), isa = schema.string }

--- Opens a device. Raises if it is unavailable.
---@param name "auto"|"cpu"|"cuda"|nil auto if left out
---@param options { threads: integer|nil, isa: string|nil }|nil
---@return limax.device
local function device(name, options)
  name = schema.demand(schema.string, name == nil and "auto" or name, "device")
  options = schema.demand(options_rule, options, "device")
  local threads = options.threads or threads_of_environment()
  local self = object.make(class, nil, function(out)
    return C.limax_device_create(name, threads, options.isa, out)
  end, { name = name })
  local description = self:describe()
  object.set(self, "kind", description.kind)
  object.set(self, "threads", description.threads)
  return self
end

--- Describes this device: kind, threads, isa, isa_available, cpu, compiler, build, cuda.
---@return table
function methods:describe()
  return abi.description(C.limax_device_describe(object.handle("device", self, class)), "device")
end

function class:__tostring()
  if not self.handle then return "freed device" end
  return ("%s (%d thread%s)"):format(self.kind, self.threads, self.threads == 1 and "" or "s")
end

local shared

--- Handle of a call's device; nil: of one device that all such calls share.
local function handle(what, on)
  if on == nil then
    if not shared or not shared.handle then shared = device "auto" end
    on = shared
  end
  return object.handle(what .. ": device", on, class), on.kind
end

return { class = class, device = device, handle = handle }
