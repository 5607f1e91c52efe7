--- flat.lua: nested tables as flat ones, with paths such as "scene.ground.height" as keys, and the
--- differences of two of them.

local choice = require "limax.base.choice"
local schema = require "limax.engine.schema"

local flat = {}

--- A value of a configuration as text, an empty table as "{}".
---@return string|nil nil for any other table
function flat.text(value)
  if type(value) ~= "table" then return schema.show(value) end
  if next(value) == nil then return "{}" end
end

--- Adds the entries of a value. Where `show` gives nil, a table is entered and anything else is
--- left out.
---@param path string of the value, "" for none
---@param into table<string, any> by path
---@param show fun(value: any): any
---@return table<string, any> into
function flat.add(value, path, into, show)
  local shown = show(value)
  if shown ~= nil then
    into[path] = shown
  elseif type(value) == "table" then
    for key, entry in pairs(value) do
      flat.add(entry, path == "" and tostring(key) or path .. "." .. tostring(key), into, show)
    end
  end
  return into
end

--- The differences of two flat tables of texts, sorted by path.
---@return { path: string, before: string, now: string }[]
function flat.differences(before, now)
  local paths, list = {}, {}
  for path in pairs(before) do paths[path] = true end
  for path in pairs(now) do paths[path] = true end
  for _, path in ipairs(choice.sorted_keys(paths)) do
    if before[path] ~= now[path] then
      list[#list + 1] = { path = path, before = before[path] or "absent",
        now = now[path] or "absent" }
    end
  end
  return list
end

return flat
