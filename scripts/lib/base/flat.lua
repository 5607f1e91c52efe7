--- flat.lua: nested tables as a flat one: what stands at the end of each path, as
--- "scene.ground.height", and where two of them differ.

local choice = require "limax.base.choice"
local schema = require "limax.engine.schema"

local flat = {}

--- How a configuration's values are shown: as in messages; an empty table as "{}".
---@param value any
---@return string|nil nil: the table is gone into
function flat.text(value)
  if type(value) ~= "table" then return schema.show(value) end
  if next(value) == nil then return "{}" end
end

--- Adds what a value holds. `show` says what becomes of each value on the way: anything but nil
--- ends the path there; of nil a table is gone into, and anything else is left out.
---@param value any
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

--- Where two flat tables of texts differ, in the order of the alphabet.
---@param before table<string, string>
---@param now table<string, string>
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
