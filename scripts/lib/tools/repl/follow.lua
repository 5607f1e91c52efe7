--- follow.lua: scripts whose top-level names remain defined at the prompt. They run again when
--- their text changes: within half a second at an idle prompt, else before the next line.

local failure = require "limax.base.failure"
local host = require "limax.host"
local script = require "limax.base.script"
local source = require "limax.base.source"
local tokens = require "limax.tools.repl.tokens"

local follow = {}

-- { text, names, value } of each followed file by its path, and the paths in order
local followed, order = {}, {}

local function compiled(path, names)
  -- raises errors of the file, and makes `require` search its folder first
  local before = package.path
  script.load(path)
  if not before:find(package.path, 1, true) then
    package.path = package.path .. ";" .. before
  else
    package.path = before
  end
  local text = assert(source.read(path))
  -- without a first line for the shell
  local code = text:gsub("^#[^\n]*", "")
  local kept, declared = tokens.keep_locals(code)
  local chunk = assert(loadstring(kept, "@" .. path))
  names:declare(declared)
  jit.off(chunk, true)
  return setfenv(chunk, names.environment), text
end

--- Runs a file with the names of a prompt; its top-level `local` names remain defined.
---@return any ... what it returns
function follow.run(path, names) return compiled(path, names)() end

-- Copies a reloaded module into its old table, so that references to it see the change.
local function renew(old, new)
  if type(old) ~= "table" or type(new) ~= "table" or rawequal(old, new) then return new end
  for key in pairs(old) do
    if rawget(new, key) == nil then rawset(old, key, nil) end
  end
  for key, value in pairs(new) do rawset(old, key, value) end
  return setmetatable(old, getmetatable(new))
end
follow.renew = renew

--- Runs a file now, and again before the next line after its text has changed.
---@return any what it returned
function follow.begin(path, names)
  local chunk, text = compiled(path, names)
  local full = host.file.absolute(path)
  if not followed[full] then order[#order + 1] = full end
  followed[full] = { text = text, names = names }
  followed[full].value = chunk()
  return followed[full].value
end

-- Runs a followed file again; after an error its old value remains.
local function again(path, entry)
  local fine, value, trace = host.protect(function()
    return renew(entry.value, follow.run(path, entry.names))
  end)
  if fine then
    entry.value = value
    io.write("reloaded: ", path, "\n")
  else
    if value == host.interrupt then error(value, 0) end
    io.stdout:flush()
    io.stderr:write(failure.status(value) and tostring(value) or trace, "\n")
  end
end

--- Has the text of a followed file changed since it ran?
function follow.has_changed()
  for _, path in ipairs(order) do
    local text = source.read(path)
    if text and text ~= followed[path].text then return true end
  end
  return false
end

--- Runs the followed files again whose text has changed.
function follow.refresh()
  for _, path in ipairs(order) do
    local entry, text = followed[path], source.read(path)
    if text and text ~= entry.text then
      entry.text = text
      again(path, entry)
    end
  end
end

return follow
