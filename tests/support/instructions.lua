--- instructions.lua: instructions of a step of one body, counted by valgrind, whatever else runs on
--- the machine. Valgrind does not support AVX-512: it counts the passes for x86-64-v3.

local host = require "limax.host"
local shell = require "limax.base.shell"

local instructions = {}

-- So many that the 5e4 instructions of the call itself are less than 0.5 %.
local STEPS = 640

function instructions.available()
  return os.execute "command -v valgrind >/dev/null 2>&1" == 0
end

--- Instructions of one step of a full body of 5x5x5 voxels. Takes seconds.
function instructions.per_step(scene)
  local pipe = assert(io.popen(table.concat({ "valgrind --tool=callgrind",
    "--callgrind-out-file=/dev/null --toggle-collect='limax_simulation_advance*'",
    shell.quoted(host.executable),
    shell.quoted(host.home .. "/tests/support/counted_steps.lua"), STEPS,
    shell.quoted(host.json.encode(scene)), "2>&1" }, " ")))
  local output = pipe:read "*a"
  pipe:close()
  local count = tonumber(output:match "Collected : (%d+)")
  if not count or count == 0 then error("callgrind counted nothing:\n" .. output, 0) end
  return count / STEPS
end

return instructions
