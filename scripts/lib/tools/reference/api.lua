--- api.lua: every public name: groups.lua lists them with examples, and the LuaLS comments in the
--- code describe them. Help, completion and the reference page read this.

local annotations = require "limax.tools.reference.annotations"
local groups = require "limax.tools.reference.groups"

local api = {}

---@class limax.api.group
---@field title string
---@field text string
---@field files string[] with the comments
---@field class string|nil whose fields are entries too
---@field prefix string before a name in scripts: "limax.", "robot:"
---@field holder string|nil before a name in the files: "methods:"
---@field examples string|nil
---@field stage string|nil Lua that makes what the examples use
---@field list limax.api.entry[]

---@class limax.api.entry
---@field name string "robot:distance"
---@field short string "distance"
---@field kind "function"|"field"|"value"
---@field group limax.api.group
---@field doc limax.api.doc|nil of a function
---@field type string|nil of a field
---@field what string
---@field example string
---@field signature string

-- "limax.start(experiment, options?) -> limax.run".
local function signature_of(name, doc)
  local parts, results = {}, {}
  for i, argument in ipairs(doc.arguments) do
    local param = doc.param[argument]
    parts[i] = argument .. (param and param.optional and "?" or "")
  end
  for i, result in ipairs(doc.returns) do results[i] = result.type end
  return ("%s(%s)%s"):format(name, table.concat(parts, ", "),
    #results > 0 and " -> " .. table.concat(results, ", ") or "")
end

-- A line of `examples`.
local function entry_of(group, line)
  local name, place, example = line:match "^([%w_:]+)=?(%S*)  (.*)$"
  local entry = { short = name:match "[^:]*$", group = group, example = example,
    name = group.prefix .. name, kind = "value" }
  local bare = group.named and example:match '^[{"]'
  if bare or example:match "^%l+ = {" then
    -- a piece of the library that an experiment names: `supervisor = { "rules", patience = 5 }`
    local path = group.folder and group.folder .. entry.short .. ".lua" or group.files[1]
    local file = annotations.of(path)
    entry.signature = bare and group.named .. " = " .. example or example
    entry.what = file.values[place] or file.top
    entry.example = ('limax.experiment { fitness = "walk", generations = 2, %s }'):format(
      entry.signature)
    return entry
  end
  local at = place ~= "" and place or (group.holder or "") .. name
  for _, path in ipairs(group.files) do
    local file = annotations.of(path)
    local doc, value = file.functions[at], file.values[at]
    if doc then
      entry.kind, entry.doc = "function", doc
      entry.what, entry.signature = doc.text, signature_of(entry.name, doc)
      return entry
    elseif value then
      entry.what, entry.signature = value, entry.name
      return entry
    end
  end
  error(("api: no comment describes %s"):format(entry.name), 0)
end

-- The fields of the group's class, with those of `taken` left out.
local function add_fields(group, taken)
  local class = annotations.classes()[group.class]
  for _, field in ipairs(class and class.fields or {}) do
    if not taken[field.name] then
      local name = group.prefix:gsub(":$", ".") .. field.name
      table.insert(group.list, { short = field.name, group = group, kind = "field", name = name,
        type = field.type, what = field.text, example = name,
        signature = ("%s: %s"):format(name, field.type) })
    end
  end
end

--- All groups, each with `list`, its entries.
function api.groups()
  if groups[1].list then return groups end
  for _, group in ipairs(groups) do
    local taken = {}
    group.list = {}
    for line in (group.examples or ""):gmatch "[^\n]+" do
      local entry = entry_of(group, line)
      table.insert(group.list, entry)
      taken[entry.short] = true
    end
    add_fields(group, taken)
  end
  return groups
end

--- All entries in the order of the page.
function api.entries()
  local list = {}
  for _, group in ipairs(api.groups()) do
    for _, entry in ipairs(group.list) do list[#list + 1] = entry end
  end
  return list
end

--- The group of the objects of a class.
function api.group_of(class)
  for _, group in ipairs(class and api.groups() or {}) do
    if group.class == class then return group end
  end
end

--- The classes of plain tables, by name; those of objects have groups of their own.
function api.tables()
  local classes = {}
  for name, class in pairs(annotations.classes()) do
    if not api.group_of(name) then classes[name] = class end
  end
  return classes
end

--- The fields of a type: of a table without a group of its own.
function api.fields_of(type_text)
  return annotations.fields_of(type_text, api.tables())
end

--- The entries of a name: the whole one, or its last part.
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
