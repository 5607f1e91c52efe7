--- conversion.lua: helpers of the suites of `limax convert`: a robot with its own weights in every
--- voxel, the command run to success or to an error, and other programs that read its files: if
--- one is not installed, the test is skipped with the name of its Debian package.

local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"

local conversion = {}

-- parts that touch along edges and at corners, and every material
local VOXELS = "ecs\nec.\n\nsb.\n..e\n\nse.\n.cb"

local function weight(x, y, z) return (x + 3 * y + 7 * z) / 37 end

--- A new folder with robot.json: 12 voxels of 0.05 m in a lattice of 3 x 2 x 3.
function conversion.stage(t)
  local folder = t:folder()
  limax.robot({ voxels = VOXELS, edge = 0.05,
    weights = { stiffness = weight, amplitude = 0.75, phase = weight } })
    :save(folder .. "/robot.json")
  return folder
end

--- Runs `limax convert` with these words, which must succeed.
---@return string[] notes what is not carried
function conversion.convert(t, folder, ...)
  local ended = process.ends(folder, { "convert", ... })
  t:ok(ended.status == 0, table.concat({ ... }, " ") .. ": " .. ended.stderr)
  local notes = {}
  for note in ended.stderr:gmatch "! not carried: ([^\n]+)" do notes[#notes + 1] = note end
  return notes
end

--- Expects an error: one line with these texts, and no file written.
function conversion.refused(t, folder, words, ...)
  local ended = process.fails(t, folder, 2, { "convert", unpack(words) }, ...)
  t:ok(select(2, ended.stderr:gsub("\n", "")) == 1, ended.stderr)
  t:equal(host.file.exists(folder .. "/" .. words[2]), nil)
end

local function run(line, folder)
  local output = folder .. "/.output"
  local status = os.execute(("{ cd %s && %s; } >%s 2>&1 </dev/null"):format(process.quote(folder),
    line, process.quote(output)))
  return status == 0, process.read(output)
end

--- Runs a Python script that needs these modules, in a folder. An exception fails the test.
function conversion.python(t, folder, modules, script)
  for _, module in ipairs(modules) do
    if not run(("/usr/bin/python3 -c 'import %s'"):format(module), folder) then
      t:skip(("there is no %s (Debian: apt-get install python3-%s)"):format(module, module))
    end
  end
  process.write(folder .. "/.script.py", script)
  t:ok(run("/usr/bin/python3 -B .script.py", folder))
end

return conversion
