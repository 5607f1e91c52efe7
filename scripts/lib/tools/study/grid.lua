--- grid.lua: the lists of `limax sweep --set PATH=VALUE,VALUE,...`, and their product.

local failure = require "limax.base.failure"
local host = require "limax.host"

local grid = {}

-- The longest name of a folder.
local LONGEST = 150

-- The values of a list: commas within brackets, braces and quotation marks belong to a value.
local function split(text, list)
  local parts, depth, is_quoted, part = {}, 0, false, ""
  local function take()
    part = part:match "^%s*(.-)%s*$"
    if part == "" then
      failure.raise(2, ("--set %s: a value is missing; expected PATH=VALUE,VALUE,..., such as"
        .. " breeding.mutation_rate=0.05,0.1"):format(text))
    end
    parts[#parts + 1], part = part, ""
  end
  local at = 1
  while at <= #list do
    local character = list:sub(at, at)
    if is_quoted and character == "\\" then
      character, at = list:sub(at, at + 1), at + 1
    elseif character == '"' then
      is_quoted = not is_quoted
    elseif not is_quoted and character:find "[%[{]" then
      depth = depth + 1
    elseif not is_quoted and character:find "[%]}]" then
      depth = depth - 1
    end
    if character == "," and depth == 0 and not is_quoted then
      take()
    else
      part = part .. character
    end
    at = at + 1
  end
  take()
  if depth ~= 0 or is_quoted then
    failure.raise(2, ("--set %s: a bracket, brace or quotation mark has no counterpart"):format(
      text))
  end
  return parts
end

-- A value as it is shown: 0.10 and 0.1 are the same.
local function shown(value)
  local decoded = host.json.decode(value, "")
  if type(decoded) == "string" then return decoded end
  return decoded == nil and value or host.json.encode(decoded)
end

---@class limax.sweep.field
---@field path string
---@field name string the last step of the path, if no other field has it
---@field values string[] as --set of `limax run` takes them

--- The fields of a grid.
---@param texts string[] "path=value,value"
function grid.fields(texts)
  local list, users, taken = {}, {}, { repetitions = "its number is that of --repetitions N" }
  for k, text in ipairs(texts) do
    local path, values = text:match "^([^=]+)=(.*)$"
    if not path then
      failure.raise(2, ("--set %s: expected PATH=VALUE,VALUE,..., such as"
        .. " breeding.mutation_rate=0.05,0.1"):format(text))
    end
    if taken[path] then failure.raise(2, ("--set %s: %s"):format(path, taken[path])) end
    taken[path] = "given twice; write all values as one list: --set PATH=VALUE,VALUE"
    local name = path:match "[^.]*$"
    if users[name] then users[name].name, name = users[name].path, path end
    list[k] = { path = path, name = name, values = split(text, values) }
    users[name] = list[k]
  end
  return list
end

---@class limax.sweep.point
---@field changes string[] "path=value"
---@field arm string what varies, except seeds, which are repetitions of an arm
---@field folder string

--- The points of a grid; the last field changes fastest.
---@param name string of the experiment, for a grid in which nothing varies
function grid.points(fields, name)
  local list, of_folder, count = {}, {}, 1
  for _, field in ipairs(fields) do count = count * #field.values end
  for k = 0, count - 1 do
    local changes, arm, folder, rest = {}, {}, {}, k
    for i = #fields, 1, -1 do
      local field = fields[i]
      local which = rest % #field.values + 1
      rest = math.floor(rest / #field.values)
      changes[i] = ("%s=%s"):format(field.path, field.values[which])
      if #field.values > 1 then
        local text = ("%s=%s"):format(field.name, shown(field.values[which]))
        table.insert(folder, 1, text)
        if field.path ~= "seed" then table.insert(arm, 1, text) end
      end
    end
    local place = (folder[1] and table.concat(folder, ",") or name):gsub("[^%w%._+,=%-]+", "")
    if #place > LONGEST then place = place:sub(1, LONGEST - 17) .. "-" .. host.xxh3(place) end
    if of_folder[place] then
      failure.raise(2, ("--set %s and --set %s are the same, or only differ in characters that"
        .. " the name of their folder, %s, cannot have"):format(of_folder[place],
        table.concat(changes, " --set "), place))
    end
    of_folder[place] = table.concat(changes, " --set ")
    list[k + 1] = { changes = changes, arm = arm[1] and table.concat(arm, ", ") or name,
      folder = place }
  end
  return list
end

return grid
