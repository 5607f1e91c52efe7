--- scripts.lua: runs the script of a run folder, the only place that does. A folder may come from
--- somebody else, and a script runs with the rights of its user: what a folder names takes effect
--- only under the user's own seal (base/seal.lua), and a copy only as it was recorded.

local failure = require "limax.base.failure"
local host = require "limax.host"
local script = require "limax.base.script"
local seal = require "limax.base.seal"
local shell = require "limax.base.shell"
local source = require "limax.base.source"

local scripts = {}

local function refuse(text, ...) failure.raise(2, text:format(...)) end

--- A message about a document that is not under the user's own seal.
---@param path string of its folder
---@param file string its name
---@param owner "other"|"edited"|"none"
---@param key string|nil name of the key that sealed it
function scripts.distrust(path, file, owner, key)
  local trust = "limax trust " .. shell.path(path)
  if owner == "edited" then
    return ("%s/%s was changed since it was sealed. Restore it; to change fields of a run: %s"
      .. " --changed --set FIELD=VALUE"):format(path, file, shell.resume_command(path))
  end
  local own = seal.key_name()
  local whose = key and ("was sealed with key %s, %s"):format(key, own and "yours is " .. own
    or "you have none") or "is not sealed"
  return ("%s %s: its script would run with your rights. Look at it and trust it: %s"):format(path,
    whose, trust)
end

--- Ends the command unless a folder is under the user's own seal.
function scripts.require_own(folder)
  if folder.owner == "own" then return end
  refuse("%s", scripts.distrust(folder.path, folder.config_name, folder.owner, folder.key))
end

-- Refuses a file below a folder that is not in a list.
local function refuse_unlisted(path, listed, prefix)
  for _, name in ipairs(host.file.list(path) or {}) do
    local inner, kind = prefix .. name, host.file.exists(path .. "/" .. name, true)
    if kind == "folder" then
      refuse_unlisted(path .. "/" .. name, listed, inner .. "/")
    elseif not listed[inner] and not name:match "^%..*%.part$" then
      refuse("%s/%s is not one of the scripts that ran: remove it", path, name)
    end
  end
end

--- The copies of a folder's scripts and prompts, each as it was recorded.
---@return table<string, string> texts by their names
---@return string path of the folder that holds them
function scripts.texts(folder)
  local texts, path = {}, folder:scripts_path()
  for k, copy in ipairs(folder.config.run.scripts) do
    local field = ("%s/%s: run.scripts[%d]"):format(folder.path, folder.config_name, k)
    local file = path .. "/" .. copy.file
    local text, message = source.read_own(file)
    if not text then refuse("%s (%s)", message, field) end
    if host.sha256(text) ~= copy.sha256 then
      refuse("%s is not the script that ran: its SHA-256 differs from %s.sha256; restore the file",
        file, field)
    end
    texts[copy.file] = text
  end
  refuse_unlisted(path, texts, "")
  return texts, path
end

-- A function that compiles one of the texts. Their `require` finds these texts first, so that
-- several folders may have modules of the same name.
local function compiler_of(place, texts)
  local environment, modules = setmetatable({}, { __index = _G, __newindex = _G }), {}
  local function compile(name)
    local file = ("%s/%s"):format(place, name)
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
---@return any value what the script returns
---@return string file
function scripts.run_copy(folder)
  scripts.require_own(folder)
  local texts, place = scripts.texts(folder)
  local name = folder.config.run.script
  if not name or not texts[name] then
    refuse("%s/%s: run.script: expected one of the files of run.scripts", folder.path,
      folder.config_name)
  end
  local compile, file = compiler_of(place, texts), place .. "/" .. name
  rawset(_G, "arg", { [0] = file })
  return compile(name)(), file
end

-- Is this an absolute path that does not depend on the process that reads it?
local function is_fixed(path)
  return path:sub(1, 1) == "/" and source.is_below(path:sub(2)) and not path:find "^/proc/"
    and not path:find "^/dev/"
end

--- Is the original of a recorded script there?
function scripts.is_there(path)
  return is_fixed(path) and host.file.exists(path) == "file"
end

--- The file that a resumed run executes: the original if it is there, else the copy.
---@return string path
---@return boolean is_original
function scripts.chosen(folder)
  local original, inside = folder.config.run.path, host.file.absolute(folder.path) .. "/"
  -- a run that was continued with its copy has no other original
  if original and scripts.is_there(original) and original:sub(1, #inside) ~= inside then
    return original, true
  end
  return folder:scripts_path() .. "/" .. tostring(folder.config.run.script), false
end

--- The recorded scripts whose originals, beside the script at `path`, have another text now.
---@param recorded { file: string, sha256: string }[]
function scripts.changed(path, recorded)
  local list, base = {}, source.folder_of(path)
  for _, each in ipairs(recorded) do
    local text = source.read(base .. "/" .. each.file)
    if text and host.sha256(text) ~= each.sha256 then list[#list + 1] = each.file end
  end
  return list
end

--- Runs the script of a folder: the original, else the copy.
---@return any value what it returns
---@return string path
---@return string|nil note
function scripts.run(folder)
  local run = folder.config.run
  if not run.path or run.path:sub(1, 1) ~= "/" then
    refuse("%s was not started from a script that returns an experiment, so it cannot be continued",
      folder.path)
  elseif run.own_loop then
    refuse("%s was made by the loop of %s, and only that continues it: run\n  %s %s\n"
      .. "with limax.start(experiment, { out = %q, resume = true }); if `resume = true` is new in"
      .. " the script, also `changed = true`", folder.path, run.path, shell.program(),
      shell.path(run.path), folder.path)
  end
  scripts.require_own(folder)
  local path, is_original = scripts.chosen(folder)
  if is_original then return script.run(path), path end
  local value, copy = scripts.run_copy(folder)
  return value, copy, ("%s is gone; continuing with the copy %s"):format(run.path, copy)
end

return scripts
