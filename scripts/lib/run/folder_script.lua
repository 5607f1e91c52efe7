--- folder_script.lua: runs the script of which a run folder keeps a copy. The folder may come from
--- somebody else, and a script runs with the rights of its user: so it runs only if that was asked
--- for, and only as it was recorded, with the same SHA-256 of every file below scripts/.

local failure = require "limax.base.failure"
local host = require "limax.host"
local script = require "limax.base.script"
local source = require "limax.base.source"

local folder_script = {}

-- Is this the path of a file below a folder? No part of it may be empty, "." or "..".
local function is_inside(name)
  return not ("/" .. name .. "/"):find("/%.?%.?/") and not name:find("%z")
end

local function refuse(text, ...) failure.raise(2, text:format(...)) end

-- The name of the experiment's script, and the text of each recorded script by name.
local function checked(path, run)
  local texts = {}
  for k, copy in ipairs(run.scripts) do
    local field = ("%s/config.json: run.scripts[%d]"):format(path, k)
    local name = copy.file
    if not is_inside(name) then refuse("%s.file: expected a file below scripts/", field) end
    local file = ("%s/scripts/%s"):format(path, name)
    if host.file.exists(file) ~= "file" then refuse("there is no file %s (%s)", file, field) end
    local text, message = source.read(file)
    if not text then refuse("%s", message) end
    if host.sha256(text) ~= copy.sha256 then
      refuse("%s is not the script that ran: its SHA-256 differs from %s.sha256; restore the file",
        file, field)
    end
    texts[name] = text
  end
  local chosen = run.script
  if not texts[chosen] then
    refuse("%s/config.json: run.script: expected one of the files of run.scripts", path)
  end
  return chosen, texts
end

-- A function that compiles one of the texts. Their `require` finds these texts first, so that
-- several folders may have modules of the same name.
local function compiler_of(path, texts)
  local environment, modules = setmetatable({}, { __index = _G, __newindex = _G }), {}
  local function compile(name)
    local file = ("%s/scripts/%s"):format(path, name)
    local chunk, message = loadstring(texts[name], "@" .. file)
    if not chunk then failure.raise(1, script.syntax_error(file, texts[name], message)) end
    return setfenv(chunk, environment)
  end
  rawset(environment, "require", function(name)
    local beginning = tostring(name):gsub("%.", "/")
    for _, ending in ipairs { ".lua", "/init.lua" } do
      if modules[name] == nil and texts[beginning .. ending] then
        local value = compile(beginning .. ending)(name)
        modules[name] = value == nil or value
        -- for the list of an experiment's scripts
        package.loaded[name] = modules[name]
      end
    end
    return modules[name] or require(name)
  end)
  return compile
end

--- Runs the copy of the experiment's script.
---@param path string of the run folder
---@param run table `run` of its configuration
---@param trust boolean|nil may it run?
---@param why string what needs it, for the refusal
---@return any value what the script returns
---@return string file
function folder_script.run(path, run, trust, why)
  if not trust then
    refuse("%s: %s, and a script of a run folder runs with your rights: read %s/scripts, then allow"
      .. " it with --trust", path, why, path)
  end
  local name, texts = checked(path, run)
  local compile = compiler_of(path, texts)
  local file = ("%s/scripts/%s"):format(path, name)
  rawset(_G, "arg", { [0] = file })
  return compile(name)(), file
end

return folder_script
