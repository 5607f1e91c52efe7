--- abi.lua: the engine's C interface: declares limax.h to the FFI, checks its version, and turns a
--- status into an error at the caller's line.

local ffi = require "ffi"
local host = require "limax.host"
local fault = require "limax.engine.fault"

local abi = {}

-- a second declaration would be an error, and a REPL may load this file again
if not pcall(ffi.typeof, "limax_population *") then ffi.cdef(host.cdef) end

--- The engine's functions and constants.
abi.C = ffi.C
local C = ffi.C

do
  local loaded, version = pcall(function() return C.limax_abi_version() end)
  if not loaded then
    error("the engine's library (liblimax) is not loaded: run this under the limax executable", 0)
  end
  if version ~= C.LIMAX_ABI then
    local text = "the engine has version %d of its interface, the scripts in %s need version %d: "
      .. "binary and data folder come from different builds; build or install them together"
    error(text:format(version, host.home, tonumber(C.LIMAX_ABI)), 0)
  end
end

--- Version of the engine, such as "0.1.0".
abi.version = ffi.string(C.limax_version())

-- Errors that are not mistakes of the caller; every other status is a mistake of the caller.
local KINDS = {
  [tonumber(C.LIMAX_OUT_OF_MEMORY)] = "memory", [tonumber(C.LIMAX_NO_DEVICE)] = "device",
  [tonumber(C.LIMAX_INTERNAL)] = "defect",
}

--- Raises the engine's text if `status` is a failure.
---@param what string|nil the call, put in front of the text
function abi.check(status, what)
  if status == C.LIMAX_OK then return end
  local text = ffi.string(C.limax_error_text())
  fault.raise(what and what .. ": " .. text or text, KINDS[tonumber(status)])
end

--- Checks a pointer from the engine, which is null where a GPU's data could not be copied.
---@param what string the call, put in front of the text
function abi.pointer(pointer, what)
  if pointer == nil then abi.check(C.LIMAX_NO_DEVICE, what) end
  return pointer
end

--- Decodes a description that the engine gives as JSON.
---@param text ffi.cdata* const char *
---@param what string in messages
function abi.description(text, what)
  return assert(host.json.decode(ffi.string(text), what))
end

return abi
