--- conversion.lua: what the suites of `limax convert` share: a robot with weights of its own in
--- every voxel, the command run to a good end, and the command refused.

local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"

local conversion = {}

-- parts that touch along edges and at corners, and every material
local VOXELS = "ecs\nec.\n\nsb.\n..e\n\nse.\n.cb"

local function weight(x, y, z) return (x + 3 * y + 7 * z) / 37 end

---@param path string
---@param text string
function conversion.write(path, text) assert(host.file.write_atomic(path, text)) end

--- A new folder with robot.json: 12 voxels of 0.05 m in a lattice of 3 x 2 x 3.
---@param t limax.test_context
---@return string folder
function conversion.stage(t)
  local folder = t:folder()
  limax.robot({ voxels = VOXELS, edge = 0.05,
    weights = { stiffness = weight, amplitude = 0.75, phase = weight } })
    :save(folder .. "/robot.json")
  return folder
end

--- Runs `limax convert` with these words to a good end.
---@param t limax.test_context
---@param folder string
---@param ... string
---@return { status: integer, stdout: string, stderr: string }
function conversion.convert(t, folder, ...)
  local done = process.ends(folder, { "convert", ... })
  t:ok(done.status == 0, table.concat({ ... }, " ") .. ": " .. done.stderr)
  return done
end

--- Expects a refusal: one line with these texts, and nothing written.
---@param t limax.test_context
---@param folder string
---@param words string[]
---@param ... string
function conversion.refused(t, folder, words, ...)
  local done = process.ends(folder, { "convert", unpack(words) })
  t:ok(done.status == 2, ("status %d: %s"):format(done.status, done.stderr))
  for _, text in ipairs { ... } do t:ok(done.stderr:find(text, 1, true), done.stderr) end
  t:ok(select(2, done.stderr:gsub("\n", "")) == 1, done.stderr)
  t:equal(host.file.exists(folder .. "/" .. words[2]), nil)
end

return conversion
