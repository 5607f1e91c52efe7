--- stub.lua: the text that editors with LuaLS read: `require "limax"` with every public function
--- and class, without bodies. The build writes it (scripts/dev/stub.lua).

local annotations = require "limax.tools.reference.annotations"
local api = require "limax.tools.reference.api"
local choice = require "limax.base.choice"

local stub = {}

local head = [[
---@meta limax
--- The module `limax`, for editors. Made by the build; never run.

error "this file is for editors"
]]

-- Does a type continue in the next line?
local function is_open(line)
  local bare = line:gsub('"[^"]*"', "")
  local _, opened = bare:gsub("[%({%[]", "")
  local _, closed = bare:gsub("[%)}%]]", "")
  return opened > closed or bare:match "[:|]$" ~= nil
end

-- Adds a comment with each annotation in one line, as LuaLS reads it.
local function add_comment(lines, comment)
  for _, line in ipairs(comment) do
    local last = lines[#lines]
    local goes_on = last and last:match "^%-%-%-%s?@" and is_open(last)
    local more = goes_on and line:match "^%-%-%-%s*([^%s@|].*)$"
    if more then lines[#lines] = last .. " " .. more else lines[#lines + 1] = line end
  end
end

local function add_function(lines, holder, entry)
  lines[#lines + 1] = ""
  add_comment(lines, entry.doc.lines)
  lines[#lines + 1] = ("function %s%s(%s) end"):format(holder, entry.short,
    table.concat(entry.doc.arguments, ", "))
end

-- Every class and alias of limax, and the methods of those that have a group.
local function add_types(lines)
  local comments, written = {}, {}
  for name, class in pairs(annotations.all "classes") do comments[name] = class.lines end
  for name, comment in pairs(annotations.all "aliases") do comments[name] = comment end
  comments.limax, comments["limax.engine"] = nil, nil
  for _, name in ipairs(choice.sorted_keys(comments)) do
    lines[#lines + 1] = ""
    -- one comment may hold several classes
    if not written[comments[name]] then add_comment(lines, comments[name]) end
    written[comments[name]] = true
    local group, holder = api.group_of(name), name:gsub("%.", "_")
    if group then
      lines[#lines + 1] = ("local %s = {}"):format(holder)
      for _, entry in ipairs(group.list) do
        if entry.doc then add_function(lines, holder .. ":", entry) end
      end
    end
  end
end

-- The table `limax` and the modules in it.
local function add_modules(lines)
  lines[#lines + 1] = "\n---@class limax"
  for _, name in ipairs { "version", "home" } do
    lines[#lines + 1] = ("---@field %s string"):format(name)
  end
  lines[#lines + 1] = "local limax = {}\n\n--- Every default of an experiment.\nlimax.defaults = {}"
  for _, group in ipairs(api.groups()) do
    local module = group.prefix:match "^limax%.([%w_]+)%.$"
    if module then
      lines[#lines + 1] = ("\n--- %s\nlimax.%s = {}"):format(group.text, module)
    end
    for _, entry in ipairs(group.prefix:match "^limax%." and group.list or {}) do
      if entry.doc then
        add_function(lines, group.prefix, entry)
      elseif module and entry.kind == "value" and entry.signature:match "^limax%." then
        lines[#lines + 1] = ("\n--- %s\n%s = {}"):format(entry.what, entry.name)
      end
    end
  end
end

--- The text of the stub.
function stub.text()
  local lines = {}
  add_types(lines)
  add_modules(lines)
  return ("%s%s\n\nreturn limax\n"):format(head, table.concat(lines, "\n"))
end

return stub
