--- conversion.lua: helpers of the suites of `limax convert`: a robot with its own weights in every
--- voxel, and the command run to success or to an error.

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

--- Runs `limax convert` with these words, which must succeed.
---@param t limax.test_context
---@param folder string
---@param ... string
---@return string[] notes what is not carried
function conversion.convert(t, folder, ...)
  local ended = process.ends(folder, { "convert", ... })
  t:ok(ended.status == 0, table.concat({ ... }, " ") .. ": " .. ended.stderr)
  local notes = {}
  for note in ended.stderr:gmatch "! not carried: ([^\n]+)" do notes[#notes + 1] = note end
  return notes
end

--- Expects an error: one line with these texts, and no file written.
---@param t limax.test_context
---@param folder string
---@param words string[]
---@param ... string
function conversion.refused(t, folder, words, ...)
  local ended = process.ends(folder, { "convert", unpack(words) })
  t:ok(ended.status == 2, ("status %d: %s"):format(ended.status, ended.stderr))
  for _, text in ipairs { ... } do t:ok(ended.stderr:find(text, 1, true), ended.stderr) end
  t:ok(select(2, ended.stderr:gsub("\n", "")) == 1, ended.stderr)
  t:equal(host.file.exists(folder .. "/" .. words[2]), nil)
end

return conversion
