--- annotations.lua: the LuaLS comments of a Lua file as tables: what stands above each function and
--- each class. Help, completion, the stub for editors and the reference page are made of them.

local source = require "limax.base.source"

local annotations = {}

---@class limax.api.value of a parameter, a result or a field
---@field name string|nil
---@field optional boolean|nil
---@field type string
---@field text string

---@class limax.api.doc of a function
---@field text string
---@field params limax.api.value[]
---@field returns limax.api.value[]
---@field arguments string[] names in the definition
---@field lines string[] the comment as it stands in the file, without its indent
---@field line integer of the definition

---@class limax.api.class
---@field name string
---@field text string
---@field parent string|nil
---@field fields limax.api.value[]
---@field lines string[] the comment as it stands in the file

-- Where a type that begins at `at` ends: the first blank outside brackets that joins nothing.
local function type_end(text, at)
  local depth, i, quoted = 0, at, nil
  while i <= #text do
    local letter = text:sub(i, i)
    if quoted then
      if letter == quoted then quoted = nil end
    elseif letter == '"' or letter == "'" then
      quoted = letter
    elseif letter:match "[%(%[{<]" then
      depth = depth + 1
    elseif letter:match "[%)%]}>]" then
      depth = depth - 1
    elseif letter:match "%s" and depth == 0 then
      local joins = text:sub(i - 1, i - 1):match "[|:,]" or text:match("^%s*|", i)
      if not joins then return i - 1 end
    end
    i = i + 1
  end
  return #text
end

-- "type text" in its two parts.
local function typed(text)
  local last = type_end(text, 1)
  return text:sub(1, last), (text:sub(last + 1):gsub("^%s+", ""))
end

local function named(text)
  local name, optional, rest = text:match "^([%w_%.]+)(%??)%s+(.*)$"
  if not name then return nil end
  local type_text, said = typed(rest)
  return { name = name, optional = optional == "?" or type_text:match "|nil$" ~= nil
    or type_text:match "%?$" ~= nil, type = type_text, text = said }
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
      -- the text of a class may stand below its first line
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
local function document(lines, arguments, line)
  local text, tags = tags_of(lines)
  local doc = { text = text, params = {}, returns = {}, arguments = {}, lines = lines, line = line }
  for name in arguments:gmatch "[%w_%.]+" do doc.arguments[#doc.arguments + 1] = name end
  for _, tag in ipairs(tags) do
    if tag.tag == "param" then
      doc.params[#doc.params + 1] = named(tag.text)
    elseif tag.tag == "return" then
      local type_text, said = typed(tag.text)
      doc.returns[#doc.returns + 1] = { type = type_text, text = said }
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
      local name, parent, said = tag.text:match "^([%w_%.]+)%s*:?%s*([%w_%.]*)%s*(.*)$"
      -- without a colon what follows the name is text
      if not tag.text:match "^[%w_%.]+%s*:" then
        parent, said = nil, tag.text:match "^%S+%s*(.*)$"
      end
      class = { name = name, parent = parent, text = said ~= "" and said or text, fields = {},
        lines = lines }
      classes[name] = class
    elseif tag.tag == "field" and class then
      class.fields[#class.fields + 1] = named(tag.text)
    end
  end
end

---@class limax.api.file
---@field functions table<string, limax.api.doc> by the name in the definition: "methods:distance"
---@field values table<string, string> text above "a.b = ..." that is no function
---@field top string what the file opens with, without its name
---@field defined string[] names of all functions, in order, with a comment or without
---@field classes table<string, limax.api.class>
---@field aliases string[][] comments with an alias

local read = {}

--- What a file of this installation says about its functions and classes.
---@param path string from the home folder: "scripts/lib/robot/robot.lua"
---@param home string
---@return limax.api.file
function annotations.of(path, home)
  local full = home .. "/" .. path
  if read[full] then return read[full] end
  local file = { functions = {}, values = {}, classes = {}, aliases = {}, defined = {} }
  local lines, number = {}, 0
  for line in (assert(source.read(full)) .. "\n"):gmatch "([^\n]*)\n" do
    number = number + 1
    local bare = line:gsub("^%s+", "")
    if bare:match "^%-%-%-[^-]" or bare == "---" then
      lines[#lines + 1] = bare
    else
      local name, arguments = bare:match "^function%s+([%w_%.:]+)%s*(%b())"
      if not name then name, arguments = bare:match "^local function%s+([%w_]+)%s*(%b())" end
      if name then file.defined[#file.defined + 1] = name end
      if #lines > 0 then
        file.top = file.top or (tags_of(lines):gsub("^[%w_]+%.lua: ", ""))
        local value = bare:match "^([%a_][%w_.]*)%s*="
        if value then file.values[value] = (tags_of(lines):gsub("^[%w_]+: ", "")) end
        if name then file.functions[name] = document(lines, arguments, number) end
        local text = table.concat(lines, "\n")
        if text:find("@class", 1, true) then add_classes(file.classes, lines) end
        if text:find("@alias", 1, true) then file.aliases[#file.aliases + 1] = lines end
      end
      lines = {}
    end
  end
  read[full] = file
  return file
end

--- The names that a table of a type may have: those of an inline type, or of a class of `classes`.
---@param type_text string
---@param classes table<string, limax.api.class>
---@return limax.api.value[]
function annotations.fields_of(type_text, classes)
  local fields = {}
  local inner = type_text:match "{(.*)}"
  if inner then
    local at = 1
    while at <= #inner do
      local first, last, name, optional = inner:find("([%a_][%w_]*)(%??)%s*:%s*", at)
      if not first then break end
      local stop = last
      local depth = 0
      while stop < #inner do
        local letter = inner:sub(stop + 1, stop + 1)
        if letter:match "[%({%[<]" then depth = depth + 1 end
        if letter:match "[%)}%]>]" then depth = depth - 1 end
        if letter == "," and depth == 0 then break end
        stop = stop + 1
      end
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
