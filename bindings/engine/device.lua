--- device.lua: where robots are expressed, simulated and bred: `engine.device("cpu", { threads = 2
--- })`.

local ffi = require "ffi"
local host = require "limax.host"
local abi = require "limax.engine.abi"
local arguments = require "limax.engine.arguments"
local failure = require "limax.base.failure"
local memory = require "limax.engine.memory"
local object = require "limax.engine.object"

local C = abi.C
local class = object.class("device", C.limax_device_free)
local methods = class.__index

-- a device holds threads, so few may wait for the collector
local WEIGHT = 16

---@class limax.device : limax.object
---@field name string as it was asked for
---@field kind string "cpu" or "cuda"
---@field threads integer

-- More than any machine has: a larger number is a slip.
local MOST_THREADS = 1024

-- Threads from the environment, for where nobody names a number; 0 is one per core. What is set
-- wrong there is no mistake of the script's: a usage error.
local function threads_of_environment()
  local text = os.getenv "LIMAX_THREADS"
  if not text or text == "" then return 0 end
  local threads = tonumber(text)
  if not threads or threads % 1 ~= 0 or threads < 1 or threads > MOST_THREADS then
    failure.raise(2, ("LIMAX_THREADS is %s; it must be a whole number from 1 to %d"):format(
      arguments.shown(text), MOST_THREADS))
  end
  return threads
end

--- Opens a device. One that is not to be had raises, saying why.
---@param name "auto"|"cpu"|"cuda"|nil auto if left out
---@param options { threads: integer|nil, isa: string|nil }|nil
---@return limax.device
local function device(name, options)
  name = arguments.text("device", name == nil and "auto" or name)
  options = arguments.table("device options", options or {})
  arguments.known("device", options, { "threads", "isa" })
  local threads = options.threads
  threads = threads == nil and threads_of_environment()
    or arguments.integer("threads", threads, 0, MOST_THREADS)
  local isa = options.isa ~= nil and arguments.text("isa", options.isa) or nil
  memory.collect(WEIGHT)
  local out = ffi.new "limax_device *[1]"
  abi.check(C.limax_device_create(name, threads, isa, out))
  local self = object.new(class, out[0], { name = name })
  local description = self:describe()
  self.kind, self.threads = description.kind, description.threads
  return self
end

--- What this device is: kind, threads, isa, isa_available, cpu, compiler, build, cuda.
---@return table
function methods:describe()
  local text = ffi.string(C.limax_device_describe(object.handle("device", self, class)))
  local description, message = host.json.decode(text, "the device's description")
  return description or error(message, 0)
end

function class:__tostring()
  if not self.handle then return "freed device" end
  return ("%s (%d thread%s)"):format(self.kind, self.threads, self.threads == 1 and "" or "s")
end

local shared

--- Handle of a device that a call was given, or of one that all calls without a device share.
---@param what string
---@param given limax.device|nil
---@return ffi.cdata*
local function handle(what, given)
  if given == nil then
    if not shared or not shared.handle then shared = device "auto" end
    given = shared
  end
  return object.handle(what .. ": device", given, class)
end

return { class = class, device = device, handle = handle }
