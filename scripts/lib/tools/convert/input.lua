--- input.lua: files that somebody else wrote: read up to a size, refused in one line that names the
--- file. Nothing in them is believed before it is checked.

local failure = require "limax.base.failure"
local source = require "limax.base.source"

local input = {}

--- Largest file that is read, bytes: a million voxels with three numbers each take 60 MB of text.
input.LARGEST = 128 * 2 ^ 20

--- Most voxels of a lattice that is read: a hundred along each axis.
input.MOST_VOXELS = 1e6

--- Most lists and objects of a JSON file that is read: of a tower one voxel wide each of three
--- weights has two for every voxel, its layer and the line in it, and the letters have one.
input.MOST_LISTS = 8 * input.MOST_VOXELS

--- Ends the command: what is wrong in a file. What the file says is shown without control
--- characters, which a terminal would obey.
---@param path string
---@param pattern string
function input.refuse(path, pattern, ...)
  failure.raise(2, ("%s: %s"):format(path, (pattern:format(...):gsub("%c", "?"))))
end

--- The bytes of a file.
---@param path string
---@return string
function input.read(path)
  local file, message = io.open(path, "rb")
  if not file then failure.raise(2, message) end
  local size = file:seek "end"
  file:close()
  if size and size > input.LARGEST and size < 2 ^ 53 then
    input.refuse(path, "has %d bytes; at most %d are read", size, input.LARGEST)
  end
  local text
  text, message = source.read(path)
  if not text then failure.raise(2, ("%s (is it a folder?)"):format(message)) end
  return text
end

--- A call whose errors are about a file: they end the command with the file's name.
---@param path string
---@param call function
---@return any
function input.about(path, call, ...)
  local fine, value = failure.attempt(call, ...)
  if fine then return value end
  local text = failure.bare(value):gsub("%c", "?")
  if text:sub(1, #path) ~= path then text = ("%s: %s"):format(path, text) end
  failure.raise(2, text)
end

--- Checks a lattice of so many voxels.
---@param path string
---@param lattice integer[]
function input.check_lattice(path, lattice)
  local voxels = 1
  for axis, name in ipairs { "x", "y", "z" } do
    local count = lattice[axis]
    if not count or count < 1 or count ~= math.floor(count) then
      input.refuse(path, "%s voxels along %s; legal are whole numbers from 1", tostring(count),
        name)
    end
    voxels = voxels * count
  end
  if voxels > input.MOST_VOXELS then
    input.refuse(path, "%g x %g x %g voxels; at most %d are read", lattice[1], lattice[2],
      lattice[3], input.MOST_VOXELS)
  end
end

return input
