--- api.lua: every public name, from one table: the files of api/ list the names with a unit and an
--- example, and the LuaLS comments in the code say the rest. Help, completion, the stub for editors
--- and the reference page all read this.

local annotations = require "limax.tools.reference.annotations"
local host = require "limax.host"
local types = require "limax.tools.reference.types"

local api = {}

--- A file of api/. An entry is { name, units or false, example }. It may say where its comment
--- stands: `file` and `at`, the name in the definition ("the top": what the file opens with), and
--- bring its own `signature` and `what`.
---@class limax.api.group
---@field title string
---@field text string
---@field file string where the comments stand
---@field class string|nil whose fields are entries too
---@field prefix string what stands before a name: "limax.", "robot:"
---@field holder string|nil what stands before a name in the file: "methods:"
---@field entries table[]
---@field also string[]|nil more files with functions of the holder
---@field internal string[]|nil functions of the holder that are nobody's
---@field keys string|nil the field of the module whose keys are entries too
---@field stage string|nil Lua that makes what the examples name

---@class limax.api.entry
---@field name string "robot:distance"
---@field short string "distance"
---@field kind "function"|"field"|"value"
---@field group limax.api.group
---@field file string where its comment stands
---@field doc limax.api.doc|nil of a function
---@field type string|nil of a field
---@field what string
---@field units string|nil
---@field example string
---@field signature string

-- In the order of the reference page.
local files = { "prompt", "limax", "robot", "robot_in_motion", "scored_robot", "body", "view",
  "experiment", "run", "population", "fitness", "selection", "supervise", "scenes", "diversity",
  "rescore", "random", "test", "suite", "test_context", "engine", "engine_simulation",
  "engine_population", "engine_materials", "engine_others" }

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
  local path = given.file or group.file
  local file = annotations.of(path, host.home)
  local at = given.at or (group.holder or "") .. short
  local entry = { short = short:match "[^:.]*$", group = group, file = path, at = at,
    units = given[2] or nil, example = given[3], kind = "value", name = group.prefix .. short }
  local field = not given.at and group.class and find_field(file, group.class, short)
  local doc = file.functions[at]
  if doc then
    entry.kind, entry.doc = "function", doc
    entry.what, entry.signature = doc.text, signature_of(entry.name, doc)
  elseif field then
    entry.kind, entry.type = "field", field.type
    entry.name = group.prefix:gsub(":$", ".") .. short
    entry.what, entry.signature = field.text, ("%s: %s"):format(entry.name, field.type)
  else
    entry.what = at == "the top" and file.top or file.values[at]
  end
  entry.what, entry.signature = given.what or entry.what, given.signature or entry.signature
  if not entry.what or not entry.signature then
    error(("api: %s%s: there is no comment for %s in %s"):format(group.prefix, short, at, path), 0)
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
    local group = require("limax.tools.reference." .. name)
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

-- The classes of tables that a user writes: those of objects have pages of their own.
local function table_classes()
  local classes = {}
  for name, class in pairs(types.classes()) do classes[name] = class end
  for _, group in ipairs(api.groups()) do
    if group.class then classes[group.class] = nil end
  end
  return classes
end

--- The names that the table of one argument of a function may hold.
---@param entry limax.api.entry
---@param argument integer
---@return limax.api.option[]
function api.options(entry, argument)
  if entry.name == "limax.experiment" or entry.name == "evolve" then
    return argument == 1 and require("limax.tools.reference.experiment_fields").list() or {}
  end
  local name = entry.doc.arguments[argument]
  local list = {}
  -- a ready scene takes what every scene does
  if entry.group.prefix == "limax.scenes." then list = { unpack(api.nested "scene") } end
  for _, param in ipairs(entry.doc.params) do
    if param.name == name then
      for _, field in ipairs(annotations.fields_of(param.type, table_classes())) do
        local inner = field.name == "scene" or field.name == "record"
        local option = { name = field.name, what = field.text, type = field.type, units = "-" }
        if inner then option.fields = api.nested(field.name) end
        list[#list + 1] = option
      end
    end
  end
  return list
end

--- The fields of what a function gives or a field is: those of a table without a page of its own.
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

--- The fields of `scene` or `record`, which many tables have.
---@param name string
---@return limax.api.option[]|nil
function api.nested(name)
  for _, option in ipairs(require("limax.tools.reference.experiment_fields").list()) do
    if option.name == name then return option.fields end
  end
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
