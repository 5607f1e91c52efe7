--- proxies.lua: sets the proxies in this process's environment, which libcurl reads, during a call.

local ffi = require "ffi"

local proxies = {}

-- each suite file loads this again; a function may be declared repeatedly
ffi.cdef "int setenv(const char*, const char*, int); int unsetenv(const char*);"

local PROXIES = { "http_proxy", "https_proxy", "HTTPS_PROXY", "all_proxy", "ALL_PROXY", "no_proxy",
  "NO_PROXY" }

local function set(name, value)
  if value then ffi.C.setenv(name, value, 1) else ffi.C.unsetenv(name) end
end

--- Calls `call` with exactly these proxies.
---@param variables table<string, string>
---@param call fun(): any
---@return any ... what `call` returns
function proxies.with(variables, call)
  local before = {}
  for _, name in ipairs(PROXIES) do
    before[name] = os.getenv(name)
    set(name, variables[name])
  end
  local results = { pcall(call) }
  for _, name in ipairs(PROXIES) do set(name, before[name]) end
  if not results[1] then error(results[2], 0) end
  return unpack(results, 2, table.maxn(results))
end

return proxies
