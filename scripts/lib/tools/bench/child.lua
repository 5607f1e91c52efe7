--- child.lua: wall time and peak memory of a whole `limax run`, from a shell and /proc of Linux.

local failure = require "limax.base.failure"
local host = require "limax.host"
local shell = require "limax.base.shell"

local child = {}

-- Runs its arguments as a command with a temporary folder. Prints the last VmHWM (kB) of the
-- process and its exit status.
local SCRIPT = [[
folder=$(mktemp -d) || exit 1
trap 'rm -rf "$folder"' EXIT
"$@" --out "$folder/run" -q >"$folder/output" 2>&1 &
pid=$!
peak=0
while now=$(grep VmHWM "/proc/$pid/status" 2>/dev/null); do peak=$now; sleep 0.05; done
wait "$pid"
status=$?
[ "$status" = 0 ] || cat "$folder/output"
echo "peak: $peak, status: $status"
]]

---@class limax.bench.run
---@field seconds number wall time
---@field peak_bytes number largest resident memory, VmHWM

--- Runs an experiment.
---@param script string path of the experiment
---@param arguments string[] further arguments
---@return limax.bench.run
function child.run(script, arguments)
  local words = { "sh", "-c", SCRIPT, "bench", host.executable, "run", script, unpack(arguments) }
  for i, word in ipairs(words) do words[i] = shell.quoted(word) end
  local began = host.clock()
  local pipe = assert(io.popen(table.concat(words, " "), "r"))
  local text = pipe:read "*a"
  pipe:close()
  local seconds = host.clock() - began
  host.raise_if_interrupted()
  local kilobytes, status = text:match "peak: VmHWM:%s*(%d+) kB, status: (%d+)\n$"
  if status ~= "0" then failure.raise(1, "limax run failed: " .. text:gsub("%s+$", "")) end
  return { seconds = seconds, peak_bytes = 1024 * tonumber(kilobytes) }
end

return child
