--- stub.lua: the file that editors read (LuaLS), made from the API table: `require "limax"` with
--- every public function and class, without bodies.

local api = require "limax.tools.reference.api"
local host = require "limax.host"
local types = require "limax.tools.reference.types"

local stub = {}

stub.path = "scripts/meta/limax.lua"

local head = [[
---@meta limax
--- limax.lua: what `require "limax"` gives, for editors. Made by scripts/dev/reference.lua from the
--- API table (scripts/lib/tools/reference/) and the comments in the code; do not edit. It is never run.

error "this file is for editors"
]]

-- Library modules: fields of `limax` that have functions.
local function module_of(group) return group.prefix:match "^limax%.([%w_]+)%.$" end

local function local_name(class) return (class:gsub("%.", "_")) end

-- Adds `name` and everything that its comments name.
local function reach(name, reached)
  if reached[name] then return end
  local class, alias = types.classes()[name], types.aliases()[name]
  if not class and not alias then return end
  reached[name] = true
  for _, line in ipairs(class and class.lines or alias) do
    for word in line:gmatch "[%a_][%w_]*%.[%w_.]*[%w_]" do reach(word, reached) end
  end
end

-- The classes that the public functions name, with those of the groups.
local function reached_types()
  local reached = {}
  for _, group in ipairs(api.groups()) do
    if group.class then reach(group.class, reached) end
    for _, entry in ipairs(group.list) do
      for _, line in ipairs(entry.doc and entry.doc.lines or {}) do
        for word in line:gmatch "[%a_][%w_]*%.[%w_.]*[%w_]" do reach(word, reached) end
      end
    end
  end
  reached.limax = nil
  -- the table of modules is written below
  reached["limax.engine"] = nil
  local list = {}
  for name in pairs(reached) do list[#list + 1] = name end
  table.sort(list)
  return list
end

local function add(lines, more)
  for _, line in ipairs(more) do lines[#lines + 1] = line end
end

-- Does a type go on in the next line?
local function is_open(line)
  local bare = line:gsub('"[^"]*"', "")
  local _, opened = bare:gsub("[%({%[]", "")
  local _, closed = bare:gsub("[%)}%]]", "")
  return opened > closed or bare:match "[:|]$" ~= nil
end

-- A comment as LuaLS reads it: an annotation is one line.
local function joined(comment)
  local lines = {}
  for _, line in ipairs(comment) do
    local last = lines[#lines]
    local goes_on = last and last:match "^%-%-%-%s?@" and is_open(last)
    local more = goes_on and line:match "^%-%-%-%s*([^%s@|].*)$"
    if more then
      lines[#lines] = last .. " " .. more
    else
      lines[#lines + 1] = line
    end
  end
  return lines
end

-- One function: its comment as it stands in the code, and its head.
local function add_function(lines, holder, entry)
  lines[#lines + 1] = ""
  add(lines, joined(entry.doc.lines))
  lines[#lines + 1] = ("function %s%s(%s) end"):format(holder, entry.short,
    table.concat(entry.doc.arguments, ", "))
end

local function group_of_class(name)
  for _, group in ipairs(api.groups()) do
    if group.class == name then return group end
  end
end

-- A comment may hold several classes: each comment is written once.
local function add_types(lines)
  local written = {}
  for _, name in ipairs(reached_types()) do
    local class = types.classes()[name]
    local comment = class and class.lines or types.aliases()[name]
    lines[#lines + 1] = ""
    if not written[comment] then
      written[comment] = true
      -- what stands over several classes belongs to the first
      add(lines, joined(comment))
    end
    local group = class and group_of_class(name)
    if group then
      lines[#lines + 1] = ("local %s = {}"):format(local_name(name))
      for _, entry in ipairs(group.list) do
        if entry.doc then add_function(lines, local_name(name) .. ":", entry) end
      end
    end
  end
end

local function add_modules(lines)
  lines[#lines + 1] = ""
  lines[#lines + 1] = "---@class limax"
  for _, entry in ipairs(group_of_class "limax".list) do
    if entry.kind == "field" and not entry.type:match "^table$" and entry.short ~= "engine" then
      lines[#lines + 1] = ("---@field %s %s %s"):format(entry.short, entry.type, entry.what)
    end
  end
  lines[#lines + 1] = "local limax = {}"
  for _, entry in ipairs(group_of_class "limax".list) do
    if entry.doc then add_function(lines, "limax.", entry) end
  end
  for _, group in ipairs(api.groups()) do
    local module = module_of(group)
    if module then
      lines[#lines + 1] = ""
      lines[#lines + 1] = "--- " .. group.text
      lines[#lines + 1] = ("limax.%s = {}"):format(module)
      for _, entry in ipairs(group.list) do
        if entry.doc then
          add_function(lines, ("limax.%s."):format(module), entry)
        elseif entry.kind == "value" and entry.signature:match "^limax%." then
          lines[#lines + 1] = ""
          lines[#lines + 1] = "--- " .. entry.what
          lines[#lines + 1] = ("limax.%s.%s = {}"):format(module, entry.short)
        end
      end
    end
  end
  lines[#lines + 1] = ""
  lines[#lines + 1] = "--- Every default of an experiment."
  lines[#lines + 1] = "limax.defaults = {}"
end

--- The text of the stub.
---@return string
function stub.text()
  local lines = {}
  add_types(lines)
  add_modules(lines)
  lines[#lines + 1] = ""
  lines[#lines + 1] = "return limax"
  return head .. table.concat(lines, "\n") .. "\n"
end

--- What stands in the file now; nil where there is none.
---@return string|nil
function stub.written()
  return (require("limax.base.source").read(host.home .. "/" .. stub.path))
end

return stub
