--- instructions.lua: the processor's instructions in a step of one body, counted by valgrind, which
--- no other work on the machine disturbs. Valgrind knows no AVX-512: it counts the passes for
--- x86-64-v3.

local host = require "limax.host"
local shell = require "limax.base.shell"

local instructions = {}

-- Start-up drops out of the difference of two runs. It varies by some 1e5 instructions from run to
-- run (addresses decide the order of hash tables), so the runs differ by many steps.
local FEW, MANY = 320, 4160

--- Is there something that counts?
---@return boolean
function instructions.available()
  return os.execute "command -v valgrind >/dev/null 2>&1" == 0
end

local function count(steps, scene)
  local pipe = assert(io.popen(table.concat({ "valgrind --tool=callgrind",
    "--callgrind-out-file=/dev/null", shell.quoted(host.executable),
    shell.quoted(host.home .. "/scripts/lib/tools/bench/counted_steps.lua"), steps,
    shell.quoted(scene), "2>&1" }, " ")))
  local output = pipe:read "*a"
  pipe:close()
  return tonumber(output:match "Collected : (%d+)")
    or error("callgrind counted nothing:\n" .. output, 0)
end

--- Instructions of one step of a full body of 5x5x5 voxels, to some 30. Takes seconds.
---@param scene table
---@return number
function instructions.per_step(scene)
  local text = host.json.encode(scene)
  return (count(MANY, text) - count(FEW, text)) / (MANY - FEW)
end

return instructions
