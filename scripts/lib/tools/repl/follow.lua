--- follow.lua: scripts whose top-level names remain defined at the prompt. They run again when
--- their text changes: within half a second at an idle prompt, else before the next line.

local failure = require "limax.base.failure"
local host = require "limax.host"
local names = require "limax.tools.repl.names"
local output = require "limax.base.output"
local script = require "limax.base.script"
local source = require "limax.base.source"
local tokens = require "limax.tools.repl.tokens"

local follow = {}

-- the followed files: { path, text, value }
local followed = {}

local function compiled(path)
  -- raises errors of the file, and makes `require` search its folder first
  local before = package.path
  script.load(path)
  package.path = before:find(package.path, 1, true) and before or package.path .. ";" .. before
  local text = assert(source.read(path))
  -- without a first line for the shell
  local kept, declared = tokens.keep_locals((text:gsub("^#[^\n]*", "")))
  local chunk = assert(loadstring(kept, "@" .. path))
  names.declare(declared)
  jit.off(chunk, true)
  return setfenv(chunk, names.environment), text
end

--- Runs a file with the names of the prompt; its top-level `local` names remain defined.
---@return any ... what it returns
function follow.run(path) return compiled(path)() end

-- Copies the table that a script returned into the one that it returned before, so that references
-- to it see the change.
local function renew(old, new)
  if type(old) ~= "table" or type(new) ~= "table" or rawequal(old, new) then return new end
  for key in pairs(old) do
    if rawget(new, key) == nil then rawset(old, key, nil) end
  end
  for key, value in pairs(new) do rawset(old, key, value) end
  return setmetatable(old, getmetatable(new))
end

--- Runs a file now, and again before the next line after its text has changed.
---@return any what it returned
function follow.begin(path)
  local chunk, text = compiled(path)
  path = host.file.absolute(path)
  local entry
  for _, each in ipairs(followed) do entry = each.path == path and each or entry end
  if not entry then
    entry = { path = path }
    table.insert(followed, entry)
  end
  entry.text = text
  entry.value = chunk()
  return entry.value
end

local function changed_text(entry)
  local text = source.read(entry.path)
  return text ~= entry.text and text or nil
end

--- Has the text of a followed file changed since it ran?
function follow.has_changed()
  for _, entry in ipairs(followed) do
    if changed_text(entry) then return true end
  end
  return false
end

-- Runs a followed file again; after an error its old value remains.
local function again(entry)
  local fine, value, trace = host.protect(function()
    return renew(entry.value, follow.run(entry.path))
  end)
  if fine then
    entry.value = value
    output.write("reloaded: ", entry.path, "\n")
  else
    if value == host.interrupt then error(value, 0) end
    io.stdout:flush()
    output.warn(failure.status(value) and tostring(value) or trace, "\n")
  end
end

--- Runs the followed files again whose text has changed.
function follow.refresh()
  for _, entry in ipairs(followed) do
    local text = changed_text(entry)
    entry.text = text or entry.text
    if text then again(entry) end
  end
end

return follow
