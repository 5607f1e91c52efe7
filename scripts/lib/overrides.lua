--- overrides.lua: `--set path=value`, which changes any field of an experiment before it is
--- checked. Paths are field names joined by dots (`scene.actuation.frequency`, `lattice.3`); values
--- are JSON where they parse as JSON, else text.

local host = require "limax.host"

local overrides = {}

--- Splits "path=value".
---@param text string
---@return { path: string[], value: any, text: string }|nil
---@return string|nil message
function overrides.parse(text)
  local path, value = text:match "^([%w_%.%-]+)=(.*)$"
  if not path then
    return nil, ("--set %s: expected path=value, such as population=50 or"
      .. " scene.actuation.frequency=3"):format(text)
  end
  local steps = {}
  for step in (path .. "."):gmatch "(.-)%." do
    if step == "" then
      return nil, ("--set %s: the path %s has an empty step"):format(text, path)
    end
    steps[#steps + 1] = step
  end
  local decoded = host.json.decode(value, "--set")
  if decoded == nil then decoded = value end
  return { path = steps, value = decoded, text = text }
end

--- Splits a list of such texts.
---@param texts string[]
---@return table[]|nil
---@return string|nil message
function overrides.parse_all(texts)
  local list = {}
  for i, text in ipairs(texts) do
    local parsed, message = overrides.parse(text)
    if not parsed then return nil, message end
    list[i] = parsed
  end
  return list
end

-- JSON's null inside a value: an absent field.
local function without_null(value)
  if value == host.json.null then return nil end
  if type(value) ~= "table" then return value end
  local copy = {}
  for key, entry in pairs(value) do copy[key] = without_null(entry) end
  return copy
end

-- The table at `key` of `holder` that a longer path enters. A switch becomes its table (`actuation
-- = true`), and a name the table that names it (`selection = "tournament"`).
local function entered(holder, key)
  local value = holder[key]
  if type(value) ~= "table" then
    if type(value) == "string" then value = { value }
    elseif value == nil or type(value) == "boolean" then value = {}
    else return nil end
    holder[key] = value
  end
  return value
end

--- Applies parsed overrides to a table in place, in their order.
---@param given table
---@param list { path: string[], value: any, text: string }[]
---@return true|nil
---@return string|nil message
function overrides.apply(given, list)
  for _, override in ipairs(list) do
    local holder, path = given, override.path
    for i = 1, #path - 1 do
      local key = tonumber(path[i]) or path[i]
      holder = entered(holder, key)
      if not holder then
        return nil, ("--set %s: %s has no fields")
          :format(override.text, table.concat(path, ".", 1, i))
      end
    end
    holder[tonumber(path[#path]) or path[#path]] = without_null(override.value)
  end
  return true
end

return overrides
