--- population_file.lua: the robots of one generation of a run folder: lines of JSON, or the same
--- robots as a NumPy array of records, which reads as the same lines.

local failure = require "limax.base.failure"
local host = require "limax.host"
local source = require "limax.base.source"
local verify = require "limax.run.verify"

local population_file = {}

--- The lines of a population file; nil and the error of reading it where there is none.
---@param folder string
---@return string|nil text
---@return string path
---@return string|nil message
---@return boolean|nil missing
function population_file.read(folder, repetition, generation)
  local function path_of(kind)
    return folder .. "/" .. verify.place(kind, repetition, generation)
  end
  local path = path_of "columns"
  local packed = source.read(path)
  if packed then
    local text, message = host.rows.lines(packed)
    if not text then failure.raise_damaged(("%s: %s"):format(path, message)) end
    return text, path
  end
  path = path_of "population"
  local text, message, missing = source.read(path)
  return text, path, message, missing
end

return population_file
