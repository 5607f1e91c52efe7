--- load.lua: runs a script at the prompt, so that its top-level names remain defined.

local names = require "limax.tools.repl.names"
local script = require "limax.base.script"
local source = require "limax.base.source"
local tokens = require "limax.tools.repl.tokens"

--- Runs a file with the names of the prompt; its top-level `local` names remain defined.
---@return any ... what it returns
return function(path)
  -- raises errors of the file, and makes `require` search its folder first
  local before = package.path
  script.load(path)
  package.path = before:find(package.path, 1, true) and before or package.path .. ";" .. before
  -- without a first line for the shell
  local text = assert(source.read(path)):gsub("^#[^\n]*", "")
  local kept, declared = tokens.keep_locals(text)
  local chunk = assert(loadstring(kept, "@" .. path))
  names.declare(declared)
  jit.off(chunk, true)
  return setfenv(chunk, names.environment)()
end
