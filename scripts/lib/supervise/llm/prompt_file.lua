--- prompt_file.lua: a prompt on disk: read when a run starts, read again before each generation if
--- the run is live, and every version that was used kept in the run folder under its hash.

local host = require "limax.host"
local source = require "limax.base.source"
local template = require "limax.supervise.llm.template"

local prompt_file = {}

--- The folder of versions in a run folder.
prompt_file.FOLDER = "prompts"

---@class limax.llm.prompt_file
---@field path string
---@field template limax.llm.template the version in use
local File = {}
File.__index = File

local function read(path)
  local text, message = source.read(path)
  if not text then return nil, message end
  return template.read(text, source.name_of(path))
end

--- Opens a prompt: a file beside the experiment, or one of limax's own in prompts/.
---@param name string
---@param folder string|nil of the experiment
---@return limax.llm.prompt_file|nil
---@return string|nil message
function prompt_file.open(name, folder)
  local path = source.beside(name, folder)
  if host.file.exists(path) ~= "file" then path = host.home .. "/prompts/" .. name end
  if host.file.exists(path) ~= "file" then
    local beside = folder and " beside the experiment or" or ""
    return nil, ("prompt: there is no %s%s in %s/prompts"):format(name, beside, host.home)
  end
  local made, message = read(path)
  if not made then return nil, "prompt: " .. message end
  return setmetatable({ path = path, template = made }, File)
end

--- A version that a run folder keeps.
---@param folder string
---@param sha256 string
---@return limax.llm.template|nil
---@return string|nil message
function prompt_file.version(folder, sha256)
  return read(("%s/%s/%s.md"):format(folder, prompt_file.FOLDER, sha256))
end

--- Reads the file again. What cannot be used leaves the version before in its place.
---@return string|nil message why
function File:refresh()
  local made, message = read(self.path)
  if made then self.template = made end
  return message
end

--- Keeps the version in use in a run folder.
---@param folder limax.run_folder|nil
---@return string|nil message why it could not be kept
function File:keep(folder)
  local sha256 = self.template.sha256
  if not folder or self.kept == sha256 then return nil end
  local place = folder.path .. "/" .. prompt_file.FOLDER
  local ok, message = host.file.mkdir(place)
  local name = ("%s/%s.md"):format(place, sha256)
  if ok and not host.file.exists(name) then
    ok, message = host.file.write_atomic(name, self.template.original)
  end
  if not ok then return message end
  self.kept = sha256
end

return prompt_file
