--- annotations.lua: the LuaLS comments of limax's Lua files as tables.

local host = require "limax.host"
local record_rules = require "limax.settings.record_rules"
local records = require "limax.settings.records"
local source = require "limax.base.source"

local annotations = {}

---@class limax.api.value of a parameter, a result or a field
---@field name string|nil
---@field optional boolean|nil
---@field type string|nil
---@field text string
---@field unit string|nil
---@field list boolean|nil a table may be a list of such tables
---@field fields limax.api.value[]|nil of its table

---@class limax.api.doc of a function
---@field text string
---@field params limax.api.value[]
---@field param table<string, limax.api.value> the same by name
---@field returns limax.api.value[]
---@field arguments string[] names in the definition

---@class limax.api.class
---@field name string
---@field text string
---@field parent string|nil
---@field fields limax.api.value[]

-- The last index of the text from `at` on before a letter outside brackets and quotes for which
-- `stops(letter, index)` holds.
local function scan(text, at, stops)
  local depth, quoted = 0, nil
  for i = at, #text do
    local letter = text:sub(i, i)
    if quoted then
      if letter == quoted then quoted = nil end
    elseif letter == '"' or letter == "'" then
      quoted = letter
    elseif letter:match "[%(%[{<]" then
      depth = depth + 1
    elseif letter:match "[%)%]}>]" then
      depth = depth - 1
    elseif depth == 0 and stops(letter, i) then
      return i - 1
    end
  end
  return #text
end

-- The end of the type at the beginning of a text: before a blank that is not beside a "|", ":" or
-- ",".
local function type_end(text)
  return scan(text, 1, function(letter, i)
    return letter:match "%s" and not text:sub(i - 1, i - 1):match "[|:,]"
      and not text:match("^%s*|", i)
  end)
end

-- "type text" in its two parts.
local function typed(text)
  local last = type_end(text)
  return text:sub(1, last), (text:sub(last + 1):gsub("^%s+", ""))
end

local function named(text)
  local name, optional, rest = text:match "^([%w_%.]+)(%??)%s+(.*)$"
  if not name then return nil end
  local type_text, explanation = typed(rest)
  return { name = name, optional = optional == "?" or type_text:match "|nil$" ~= nil
    or type_text:match "%?$" ~= nil, type = type_text, text = explanation }
end

-- The tags of a comment, each with the lines that continue it, and the text above them.
local function tags_of(lines)
  local text, tags = {}, {}
  for _, line in ipairs(lines) do
    local tag, rest = line:match "^%-%-%-%s?@(%w+)%s*(.*)$"
    if tag then
      tags[#tags + 1] = { tag = tag, text = rest }
    else
      local words = line:match "^%-%-%-%s?(.*)$"
      local open = tags[#tags]
      -- lines below @class are its text
      if open and open.tag ~= "class" then
        open.text = open.text .. " " .. words
      else
        text[#text + 1] = words
      end
    end
  end
  return (table.concat(text, " "):gsub("^%s+", ""):gsub("%s+$", "")), tags
end

-- The comment of a function.
local function document(lines, arguments)
  local text, tags = tags_of(lines)
  local doc = { text = text, params = {}, param = {}, returns = {}, arguments = {} }
  for name in arguments:gmatch "[%w_%.]+" do doc.arguments[#doc.arguments + 1] = name end
  for _, tag in ipairs(tags) do
    if tag.tag == "param" then
      local param = named(tag.text)
      doc.params[#doc.params + 1], doc.param[param.name] = param, param
    elseif tag.tag == "return" then
      local type_text, explanation = typed(tag.text)
      doc.returns[#doc.returns + 1] = { type = type_text, text = explanation }
    end
  end
  return doc
end

-- The classes of a comment: usually one.
local function add_classes(classes, lines)
  local text, tags = tags_of(lines)
  local class
  for _, tag in ipairs(tags) do
    if tag.tag == "class" then
      local name, parent, own = tag.text:match "^([%w_%.]+)%s*:%s*([%w_%.]*)%s*(.*)$"
      if not name then name, own = tag.text:match "^(%S+)%s*(.*)$" end
      class = { name = name, parent = parent, text = own ~= "" and own or text, fields = {} }
      classes[name] = class
    elseif tag.tag == "field" and class then
      class.fields[#class.fields + 1] = named(tag.text)
    end
  end
end

---@class limax.api.file
---@field functions table<string, limax.api.doc> by the name in the definition: "methods:distance"
---@field values table<string, string> text above "a.b = ..." that is not a function
---@field top string the comment at the top, without the file's name
---@field classes table<string, limax.api.class>

-- Adds the fields of tables of settings/records.lua, whose names follow "---@fields".
local function add_declared(lines, names)
  local tables = {}
  for name in names:gmatch "%S+" do tables[#tables + 1] = assert(records[name], name) end
  for _, line in ipairs(record_rules.annotations(unpack(tables))) do lines[#lines + 1] = line end
end

local read = {}

--- The comments of a file of this installation.
---@param path string from the home folder: "scripts/lib/robot/robot.lua"
function annotations.of(path)
  if read[path] then return read[path] end
  local file = { functions = {}, values = {}, classes = {} }
  local lines = {}
  for line in (assert(source.read(host.home .. "/" .. path)) .. "\n"):gmatch "([^\n]*)\n" do
    local bare = line:gsub("^%s+", "")
    local tables = bare:match "^%-%-%-@fields%s+(.*)$"
    if tables then
      add_declared(lines, tables)
    elseif bare:match "^%-%-%-[^-]" or bare == "---" then
      lines[#lines + 1] = bare
    else
      local name, arguments = bare:match "^function%s+([%w_%.:]+)%s*(%b())"
      if not name then name, arguments = bare:match "^local function%s+([%w_]+)%s*(%b())" end
      if #lines > 0 then
        file.top = file.top or (tags_of(lines):gsub("^[%w_]+%.lua: ", ""))
        local value = bare:match "^([%a_][%w_.]*)%s*="
        if value then file.values[value] = (tags_of(lines):gsub("^[%w_]+: ", "")) end
        if name then file.functions[name] = document(lines, arguments) end
        add_classes(file.classes, lines)
      end
      lines = {}
    end
  end
  read[path] = file
  return file
end

-- Every Lua file below a folder of the installation.
local function files_below(folder, list)
  for _, name in ipairs(host.file.list(host.home .. "/" .. folder)) do
    local path = folder .. "/" .. name
    if name:match "%.lua$" then
      list[#list + 1] = path
    elseif host.file.exists(host.home .. "/" .. path) == "folder" then
      files_below(path, list)
    end
  end
  return list
end

local all

--- Every class of limax, by name.
function annotations.classes()
  if all then return all end
  all = {}
  for _, path in ipairs(files_below("scripts/lib", files_below("bindings", {}))) do
    for name, class in pairs(annotations.of(path).classes) do all[name] = class end
  end
  return all
end

--- The names that a table of a type may have: those of an inline type, or of a class of `classes`.
---@param classes table<string, limax.api.class>
function annotations.fields_of(type_text, classes)
  local fields = {}
  local inner = type_text:match "{(.*)}"
  if inner then
    local at = 1
    while at <= #inner do
      local first, last, name, optional = inner:find("([%a_][%w_]*)(%??)%s*:%s*", at)
      if not first then break end
      local stop = scan(inner, last + 1, function(letter) return letter == "," end)
      fields[#fields + 1] = { name = name, optional = optional == "?",
        type = inner:sub(last + 1, stop), text = "" }
      at = stop + 2
    end
    return fields
  end
  for name in type_text:gmatch "[%a_][%w_%.]*" do
    for _, field in ipairs(classes[name] and classes[name].fields or {}) do
      fields[#fields + 1] = field
    end
  end
  return fields
end

return annotations
