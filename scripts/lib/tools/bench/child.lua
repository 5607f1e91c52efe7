--- child.lua: what a whole `limax run` costs, start and end of the program included: its time and
--- the most memory that it ever held. Linux: both come from a shell and /proc.

local failure = require "limax.base.failure"
local host = require "limax.host"
local process = require "limax.tools.test.process"

local child = {}

-- Runs the words that follow it in a new folder, removed afterwards. Prints the seconds that it
-- took, the last VmHWM (kB) seen in its status (it only grows) and its exit status.
local SCRIPT = [[
folder=$(mktemp -d) || exit 1
trap 'rm -rf "$folder"' EXIT
"$@" --out "$folder/run" -q >"$folder/said" 2>&1 &
pid=$!
peak=0
while now=$(grep VmHWM "/proc/$pid/status" 2>/dev/null); do peak=$now; sleep 0.05; done
wait "$pid"
status=$?
[ "$status" = 0 ] || cat "$folder/said"
echo "peak: $peak, status: $status"
]]

---@class limax.bench.run
---@field seconds number wall time
---@field peak_bytes number largest resident memory, VmHWM

--- Runs an experiment by `limax run`, without progress and figures.
---@param script string path of the experiment
---@param arguments string[] further words
---@return limax.bench.run
function child.run(script, arguments)
  local words = { "sh", "-c", SCRIPT, "bench", host.executable, "run", script, unpack(arguments) }
  for i, word in ipairs(words) do words[i] = process.quoted(word) end
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
