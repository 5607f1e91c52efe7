--- keep_former.lua: before a run is continued with changes: copies of the configuration and the
--- scripts that are replaced.

local source = require "limax.base.source"

--- Keeps them as config-N.json and scripts-N. The configuration comes after its scripts: where it
--- is there, all of N is.
---@param folder limax.run_folder
---@param text string of the configuration
return function(folder, text)
  local function path(n) return ("%s/config-%d.json"):format(folder.path, n) end
  local n, last = 1, nil
  local kept = source.read(path(n))
  while kept do
    n, last = n + 1, kept
    kept = source.read(path(n))
  end
  -- a process that was killed before its change was complete kept them already
  if last == text then return end
  local scripts = {}
  for k, copy in ipairs(folder.config.run.scripts) do
    local script, message = source.read(folder.path .. "/scripts/" .. copy.file)
    folder:check(script, message)
    scripts[k] = { file = copy.file, text = script }
  end
  folder:write_scripts("scripts-" .. n, scripts)
  folder:write(("config-%d.json"):format(n), text)
end
