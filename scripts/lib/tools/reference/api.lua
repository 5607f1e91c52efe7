--- api.lua: every public name: groups.lua lists them with examples, and the LuaLS comments in the
--- code describe them. Help, completion, the stub for editors and the reference page read this.

local annotations = require "limax.tools.reference.annotations"
local experiment_fields = require "limax.tools.reference.experiment_fields"
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
    parts[i] = argument
    for _, param in ipairs(doc.params) do
      if param.name == argument then parts[i] = argument .. (param.optional and "?" or "") end
    end
  end
  for i, result in ipairs(doc.returns) do results[i] = result.type end
  return ("%s(%s)%s"):format(name, table.concat(parts, ", "),
    #results > 0 and " -> " .. table.concat(results, ", ") or "")
end

-- A piece of the library that an experiment names: `supervisor = { "rules", patience = 5 }`.
local function named_entry(entry, group, place)
  local text = group.named .. " = " .. entry.example
  local path = group.folder and group.folder .. entry.short .. ".lua" or group.files[1]
  local file = annotations.of(path)
  entry.kind, entry.signature = "value", text
  entry.what = place and file.values[place] or file.top
  entry.example = ('limax.experiment { fitness = "walk", generations = 2, %s }'):format(text)
end

-- A line of `examples`.
local function entry_of(group, line)
  local name, place, example = line:match "^([%w_:]+)=?(%S*)  (.*)$"
  local entry = { short = name:match "[^:]*$", group = group, example = example,
    name = group.prefix .. name }
  if group.named and example:match '^[{"]' then
    named_entry(entry, group, place ~= "" and place)
    return entry
  end
  local at = place ~= "" and place or (group.holder or "") .. name
  for _, path in ipairs(group.files) do
    local file = annotations.of(path)
    local doc = entry.signature == nil and file.functions[at]
    if doc then
      entry.kind, entry.doc = "function", doc
      entry.what, entry.signature = doc.text, signature_of(entry.name, doc)
    elseif entry.signature == nil and file.values[at] then
      entry.kind, entry.what, entry.signature = "value", file.values[at], entry.name
    end
  end
  if not entry.signature then error(("api: no comment describes %s"):format(entry.name), 0) end
  return entry
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
---@return limax.api.group[]
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
---@return limax.api.entry[]
function api.entries()
  local list = {}
  for _, group in ipairs(api.groups()) do
    for _, entry in ipairs(group.list) do list[#list + 1] = entry end
  end
  return list
end

-- The classes of tables that a user writes; those of objects have groups of their own.
local function table_classes()
  local classes = {}
  for name, class in pairs(annotations.classes()) do classes[name] = class end
  for _, group in ipairs(groups) do
    if group.class then classes[group.class] = nil end
  end
  return classes
end

--- The fields of `scene` or `record`, which many tables have.
---@return limax.api.option[]|nil
function api.nested(name)
  for _, option in ipairs(experiment_fields.list()) do
    if option.name == name then return option.fields end
  end
end

--- The names that the table of one argument of a function may hold.
---@param argument integer
---@return limax.api.option[]
function api.options(entry, argument)
  if entry.name == "limax.experiment" or entry.name == "evolve" then
    return argument == 1 and experiment_fields.list() or {}
  end
  -- a ready scene takes the fields of every scene
  local list = entry.group.prefix == "limax.scenes." and { unpack(api.nested "scene") } or {}
  for _, param in ipairs(entry.doc.params) do
    if param.name == entry.doc.arguments[argument] then
      for _, field in ipairs(api.fields_of(param.type)) do
        list[#list + 1] = { name = field.name, what = field.text, type = field.type, units = "-",
          fields = (field.name == "scene" or field.name == "record") and api.nested(field.name) }
      end
    end
  end
  return list
end

--- The fields of a type: of a table without a group of its own.
---@param type_text string
---@return limax.api.value[]
function api.fields_of(type_text)
  return annotations.fields_of(type_text, table_classes())
end

--- Every class of plain tables that public names mention, and those that they mention, by name.
---@return limax.api.class[]
function api.tables()
  local classes, list, seen = table_classes(), {}, {}
  local function mention(type_text)
    for name in type_text:gmatch "[%a_][%w_%.]*" do
      local class = classes[name]
      if class and not seen[name] and #class.fields > 0 then
        seen[name] = true
        list[#list + 1] = class
        for _, field in ipairs(class.fields) do mention(field.type) end
      end
    end
  end
  for _, entry in ipairs(api.entries()) do
    if entry.type then mention(entry.type) end
    for _, values in ipairs(entry.doc and { entry.doc.params, entry.doc.returns } or {}) do
      for _, value in ipairs(values) do mention(value.type) end
    end
  end
  table.sort(list, function(a, b) return a.name < b.name end)
  return list
end

--- The entries of a name: the whole one, or its last part.
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
