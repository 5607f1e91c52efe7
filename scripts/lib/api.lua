--- api.lua: every public name, from one table: the files of api/ list the names with a unit and an
--- example, and the LuaLS comments in the code say the rest. Help, completion, the stub for editors
--- and the reference page all read this.

local annotations = require "limax.api.annotations"
local host = require "limax.host"

local api = {}

--- A file of api/. An entry is { name, units or false, example }, and may say where its comment
--- stands: `file` and `at`, the name in the function's definition.
---@class limax.api.group
---@field title string
---@field text string
---@field file string where the comments stand
---@field class string|nil whose fields are entries too
---@field prefix string what stands before a name: "limax.", "robot:"
---@field holder string|nil what stands before a name in the file: "methods:"
---@field entries table[]
---@field stage string|nil Lua that makes what the examples name

---@class limax.api.entry
---@field name string "robot:distance"
---@field short string "distance"
---@field kind "function"|"field"
---@field group limax.api.group
---@field doc limax.api.doc|nil of a function
---@field type string|nil of a field
---@field what string
---@field units string|nil
---@field example string
---@field signature string

-- In the order of the reference page.
local files = { "prompt", "limax", "robot", "scored_robot" }

-- "options?: { axis?: ... }" of each argument; what the comment leaves out has no type.
local function signature_of(name, doc)
  local parts = {}
  for i, argument in ipairs(doc.arguments) do
    parts[i] = argument
    for _, param in ipairs(doc.params) do
      if param.name == argument then parts[i] = argument .. (param.optional and "?" or "") end
    end
  end
  local results = {}
  for i, result in ipairs(doc.returns) do results[i] = result.type end
  return ("%s(%s)%s"):format(name, table.concat(parts, ", "),
    #results > 0 and " -> " .. table.concat(results, ", ") or "")
end

local function find_field(file, class, name)
  for _, field in ipairs(file.classes[class] and file.classes[class].fields or {}) do
    if field.name == name then return field end
  end
end

local function entry_of(group, given)
  local short = given[1]
  local file = annotations.of(given.file or group.file, host.home)
  local at = given.at or (group.holder or "") .. short
  local field = not given.at and group.class and find_field(file, group.class, short)
  local doc = file.functions[at]
  local dotted = group.prefix:gsub(":$", ".")
  local entry = { short = short, group = group, units = given[2] or nil, example = given[3] }
  if doc then
    entry.kind, entry.doc, entry.name = "function", doc, group.prefix .. short
    entry.what, entry.signature = doc.text, signature_of(entry.name, doc)
  elseif field then
    entry.kind, entry.name, entry.type = "field", dotted .. short, field.type
    entry.what, entry.signature = field.text, ("%s: %s"):format(dotted .. short, field.type)
  else
    error(("api: %s%s: there is no comment for %s in %s"):format(group.prefix, short, at,
      given.file or group.file))
  end
  return entry
end

local loaded

--- All groups, each with `list`, its entries.
---@return limax.api.group[]
function api.groups()
  if loaded then return loaded end
  loaded = {}
  for i, name in ipairs(files) do
    local group = require("limax.api." .. name)
    group.list = {}
    for k, given in ipairs(group.entries) do group.list[k] = entry_of(group, given) end
    loaded[i] = group
  end
  return loaded
end

--- All entries in the order of the page.
---@return limax.api.entry[]
function api.entries()
  local list = {}
  for _, group in ipairs(api.groups()) do
    for _, entry in ipairs(group.list) do list[#list + 1] = entry end
  end
  return list
end

--- The entries of a name: the whole one, or its last part.
---@param name string
---@return limax.api.entry[]
function api.find(name)
  local whole, parts = {}, {}
  local plain = name:gsub(":", ".")
  for _, entry in ipairs(api.entries()) do
    if entry.name:gsub(":", ".") == plain then whole[#whole + 1] = entry end
    if entry.short == name then parts[#parts + 1] = entry end
  end
  return #whole > 0 and whole or parts
end

return api
