--- types.lua: the classes and aliases that comments name, over all files of limax.

local annotations = require "limax.tools.reference.annotations"
local host = require "limax.host"

local types = {}

local folders = { "scripts/lib", "bindings/host", "bindings/engine", "scripts/lib/base",
  "scripts/lib/settings", "scripts/lib/robot", "scripts/lib/experiment", "scripts/lib/run",
  "scripts/lib/evolution", "scripts/lib/supervise", "scripts/lib/supervise/llm",
  "scripts/lib/tools/test" }

local classes, aliases

local function read_all()
  classes, aliases = {}, {}
  for _, folder in ipairs(folders) do
    for _, name in ipairs(host.file.list(host.home .. "/" .. folder)) do
      if name:match "%.lua$" then
        local file = annotations.of(folder .. "/" .. name, host.home)
        for class_name, class in pairs(file.classes) do classes[class_name] = class end
        for _, lines in ipairs(file.aliases) do
          for _, line in ipairs(lines) do
            local alias = line:match "@alias%s+([%w_.]+)"
            if alias then aliases[alias] = lines end
          end
        end
      end
    end
  end
end

--- Every class, by its name.
---@return table<string, limax.api.class>
function types.classes()
  if not classes then read_all() end
  return classes
end

--- The comments of every alias, by its name.
---@return table<string, string[]>
function types.aliases()
  if not aliases then read_all() end
  return aliases
end

return types
