--- start.lua: what limax.host does in Lua: how `require` finds modules, the global table of
--- scripts, facts about this machine. Then it runs the command line, `...`, and returns the exit
--- status.
-- luacheck: ignore 122

local ffi = require "ffi"
local host = require "limax.host"

-- A run of many short generations compiles more traces than LuaJIT keeps by default; it would throw
-- all away and begin again, time after time.
jit.opt.start("maxtrace=8000", "maxmcode=32768", "sizemcode=256") -- traces, KB, KB

-- Modules that users' scripts may name; other names may change.
local PUBLIC = {
  limax = "scripts/lib/limax", ["limax.encoding"] = "scripts/lib/experiment/encoding",
  ["limax.engine"] = "bindings/engine/engine",
  ["limax.archive"] = "scripts/lib/experiment/archive",
  ["limax.control"] = "scripts/lib/settings/control",
  ["limax.fitness"] = "scripts/lib/experiment/fitness",
  ["limax.scenes"] = "scripts/lib/settings/scenes",
  ["limax.selection"] = "scripts/lib/experiment/selection",
  ["limax.survival"] = "scripts/lib/experiment/survival",
  ["limax.supervise"] = "scripts/lib/supervise/supervise",
  ["limax.variation"] = "scripts/lib/experiment/variation",
  ["limax.test"] = "scripts/lib/tools/test/test",
}

-- The file of one of limax's modules below home; nil for any other module.
local function file_of(module)
  if PUBLIC[module] then return PUBLIC[module] end
  -- words between single dots: no path outside of the folder
  local rest = module:match "^limax%.([%l%d_.]+)$"
  if not rest or ("." .. rest .. "."):find("..", 1, true) then return nil end
  local path = rest:gsub("%.", "/")
  if path:match "^engine/" then return "bindings/" .. path end
  return (path:match "^commands/" and "scripts/" or "scripts/lib/") .. path
end

local function search(module)
  local file = file_of(module)
  if not file then return nil end
  local path = ("%s/%s.lua"):format(host.home, file)
  if host.file.exists(path) ~= "file" then return ("\n\tno file '%s'"):format(path) end
  return assert(loadfile(path, "t"))
end

-- A Lua file along package.path.
local function search_path(module)
  local path, message = package.searchpath(module, package.path)
  return path and require("limax.base.script").compile(path) or message
end

package.path, package.cpath = "", ""
package.loaders = { package.loaders[1], search, search_path }

function math.random()
  error("math.random would make runs irreproducible: use the argument `random` of the function, or "
    .. "robots:random(i) in an encoding", 2)
end
math.randomseed = math.random

-- The clock, except inside a function that decides results: `host.role` names it there.
local date = os.date
for name, read in pairs { clock = os.clock, time = os.time, date = date } do
  os[name] = function(...)
    local is_now = name == "clock" or select(name == "time" and 1 or 2, ...) == nil
    if is_now and host.role then
      error(("os.%s would make runs irreproducible: %s must return the same for the same robot")
        :format(name, host.role), 2)
    end
    return read(...)
  end
end

function os.setlocale(name)
  if name == nil then return "C" end
  error('os.setlocale would change how numbers are read and written: the locale stays "C"', 2)
end

function os.exit(status)
  if type(status) == "boolean" then status = status and 0 or 1 end
  host.exit(status)
end

local function shown(key) return type(key) == "string" and key or type(key) end

-- Tables and functions of Lua are read through empty tables, so that every assignment is noticed.
local LOCKED = { "bit", "coroutine", "debug", "io", "jit", "math", "os", "string", "table" }
for _, name in ipairs(LOCKED) do
  _G[name] = setmetatable({}, { __index = _G[name], __newindex = function(_, key)
    error(("assignment to %s.%s: limax itself uses Lua's libraries; write a local function")
      :format(name, shown(key)), 2)
  end })
  package.loaded[name] = _G[name]
end

local globals = {}
for name, value in pairs(_G) do globals[name] = value end

setmetatable(_G, {
  __index = setmetatable(globals, { __index = function(_, key)
    error(("undefined name '%s': write local %s, or require the module that defines it")
      :format(shown(key), shown(key)), 2)
  end }),
  __newindex = function(_, key)
    local what = rawget(globals, key) ~= nil and "'%s', which limax itself uses"
      or "the undefined name '%s'"
    error(("assignment to " .. what .. ": write local %s"):format(shown(key), shown(key)), 2)
  end,
})
for name in pairs(globals) do rawset(_G, name, nil) end

ffi.cdef [[
int clock_gettime(int clock, long* seconds_and_nanoseconds);
int ioctl(int descriptor, unsigned long request, ...);
int isatty(int descriptor);
int usleep(unsigned microseconds);
]]
local C = ffi.C

-- Linux
local CLOCK_MONOTONIC, TIOCGWINSZ = 1, 0x5413
local LONGEST_WAIT = 86400 -- s
local WAIT_SLICE = 0.05    -- s between checks for Ctrl-C, which may come just before a sleep

local now = ffi.new "long[2]"
function host.clock()
  C.clock_gettime(CLOCK_MONOTONIC, now)
  return tonumber(now[0]) + 1e-9 * tonumber(now[1])
end

function host.wait(seconds)
  if not (seconds >= 0 and seconds <= LONGEST_WAIT) then error("expected 0 to 86400 seconds", 2) end
  local stop = host.clock() + seconds
  repeat
    host.raise_if_interrupted()
    local left = stop - host.clock()
    if left > 0 then C.usleep(1e6 * math.min(left, WAIT_SLICE)) end
  until left <= 0
end

function host.time() return date "!%Y-%m-%dT%H:%M:%SZ" end

local function columns()
  local size = ffi.new "unsigned short[4]" -- rows, columns, and two for pixels
  for descriptor = 1, 2 do
    if C.ioctl(descriptor, TIOCGWINSZ, size) == 0 and size[1] > 0 then return size[1] end
  end
  local count = tonumber((os.getenv "COLUMNS" or ""):match "^%d+")
  return count and count > 0 and count or 80
end

-- colours as https://no-color.org asks
function host.terminal()
  local kind = os.getenv "TERM"
  local plain = (os.getenv "NO_COLOR" or "") ~= "" or not kind or kind == "dumb"
  local out, err = C.isatty(1) ~= 0, C.isatty(2) ~= 0
  return { stdin = C.isatty(0) ~= 0, stdout = out, stderr = err, color = out and not plain,
    color_stderr = err and not plain, columns = columns() }
end

-- What a pattern finds in a file of the system; nil if nothing.
local function found(path, pattern)
  local file = io.open(path)
  local text = file and file:read "*a"
  if file then file:close() end
  return text and text:match(pattern)
end

function host.environment()
  local function kernel(name) return found("/proc/sys/kernel/" .. name, "[^\n]+") or "" end
  local system = found("/etc/os-release", 'PRETTY_NAME="?([^"\n]+)')
  return {
    compiler = host.compiler, build = host.build, luajit = jit.version, cores = host.cores,
    hostname = kernel "hostname",
    cpu = found("/proc/cpuinfo", "model name%s*:%s*([^\n]-)%s*\n") or jit.arch,
    system = ("%s%s %s"):format(system and system .. ", " or "", kernel "ostype",
      kernel "osrelease"),
    cuda = found("/proc/driver/nvidia/version", "NVRM version:%s*([^\n]-)%s*\n"),
    cuda_compiler = host.cuda_compiler ~= "" and host.cuda_compiler or nil,
  }
end

return require("limax.main").main { ... }
