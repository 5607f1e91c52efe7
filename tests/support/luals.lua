--- luals.lua: a strict reader of the comments that the Lua language server (LuaLS) takes from a
--- stub: its annotations, one to a line, and its types
--- (https://luals.github.io/wiki/annotations/). The server is lenient and takes a type that it
--- cannot read for `unknown`; here each such place is a problem.

local luals = {}

local BUILT_IN = {}
for name in ([[any boolean false function integer lightuserdata nil number self string table thread
  true unknown userdata void ffi.cdata*]]):gmatch "%S+" do
  BUILT_IN[name] = true
end

-- ---- types --------------------------------------------------------------------------------------

local Reader = {}
Reader.__index = Reader

function Reader:blank() self.at = self.text:find("%S", self.at) or #self.text + 1 end

-- Takes what a pattern matches here, behind blanks.
function Reader:take(pattern)
  self:blank()
  local first, last = self.text:find("^" .. pattern, self.at)
  if not first then return nil end
  self.at = last + 1
  return self.text:sub(first, last)
end

function Reader:need(pattern, what)
  local taken = self:take(pattern)
  if not taken then
    error(("expected %s at %q"):format(what, self.text:sub(self.at, self.at + 30)), 0)
  end
  return taken
end

-- name?: type, ... up to the closing bracket
function Reader:entries(closing, what, is_entry)
  if self:take(closing) then return end
  repeat
    is_entry()
    local more = self:take "[,;]"
    if more and self:take(closing) then return end
  until not more
  self:need(closing, what)
end

function Reader:parameter()
  if not self:take "%.%.%." then
    self:need("[%a_][%w_]*", "a parameter's name")
    self:take "%?"
  end
  if self:take ":" then self:union() end
end

function Reader:field()
  if self:take "%[" then
    self:union()
    self:need("%]", "]")
  else
    self:need("[%a_][%w_]*", "a field's name")
    self:take "%?"
  end
  self:need(":", "a colon and the field's type")
  self:union()
end

function Reader:primary()
  if self:take "%(" then
    self:union()
    self:need("%)", ")")
  elseif self:take "{" then
    self:entries("}", "}", function() self:field() end)
  elseif self:take "fun%f[^%w_]" then
    self:need("%(", "( of a function's type")
    self:entries("%)", ") of a function's type", function() self:parameter() end)
    if self:take ":" then
      repeat self:union() until not self:take ","
    end
  elseif not (self:take '"[^"]*"' or self:take "'[^']*'" or self:take "%-?%d[%d.]*") then
    -- LuaLS calls its own classes so: ffi.cdata*
    local name = self:need("[%a_][%w_.]*%*?", "a type")
    self.names[#self.names + 1] = name
    if self:take "<" then
      repeat self:union() until not self:take ","
      self:need(">", ">")
    end
  end
  -- a bracket that stands apart is text
  while self.text:find("^%[%]", self.at) do self.at = self.at + 2 end
  if self.text:find("^%?", self.at) then self.at = self.at + 1 end
end

function Reader:union()
  repeat self:primary() until not self:take "|"
end

-- A reader of a text that adds the names of types to `names`.
local function reader(text, names)
  return setmetatable({ text = text, at = 1, names = names }, Reader)
end

-- ---- annotations --------------------------------------------------------------------------------

local tags = {}

function tags.meta(read) read:need("[%w_.]+$", "a module's name") end

function tags.class(read, state)
  local name = read:need("[%a_][%w_.]*", "a class's name")
  if state.defined[name] then error(("%s is defined twice"):format(name), 0) end
  state.defined[name], state.class, state.fields = true, name, {}
  if read:take ":" then
    repeat read.names[#read.names + 1] = read:need("[%a_][%w_.]*", "a parent's name")
    until not read:take ","
  end
end

function tags.field(read, state)
  if not state.class then error("a field of no class", 0) end
  local name = read:need("[%a_][%w_]*", "a field's name")
  read:take "%?"
  if state.fields[name] then error(("%s has a field %s already"):format(state.class, name), 0) end
  state.fields[name] = true
  read:union()
end

function tags.param(read, state)
  local name = read:take "%.%.%." or read:need("[%a_][%w_]*", "an argument's name")
  read:take "%?"
  if state.params[name] then error(("the argument %s stands twice"):format(name), 0) end
  state.params[name] = true
  read:union()
end

-- types with or without names, then text
tags["return"] = function(read)
  repeat
    read:union()
    read:take "[%a_][%w_]*%f[,]"
  until not read:take ","
end

function tags.alias(read, state)
  local name = read:need("[%a_][%w_.]*", "an alias's name")
  if state.defined[name] then error(("%s is defined twice"):format(name), 0) end
  state.defined[name], state.alias = true, true
  if read.text:find("%S", read.at) then read:union() end
end

function tags.overload(read)
  if not read.text:find("^%s*fun%(", read.at) then error("expected fun(...)", 0) end
  read:union()
end

-- ---- a stub -------------------------------------------------------------------------------------

-- Names of arguments at a definition.
local function check_arguments(code, state)
  local arguments = code:match "^function [%w_.:]+(%b())"
  if arguments then
    local known = {}
    for name in arguments:gmatch "[%w_.]+" do known[name] = true end
    for name in pairs(state.params) do
      if not known[name] then error(("%s is no argument of it"):format(name), 0) end
    end
    for name in pairs(known) do
      if not state.params[name] then error(("the argument %s has no @param"):format(name), 0) end
    end
  elseif next(state.params) then
    error("arguments of no function", 0)
  end
end

local function forget(state)
  state.class, state.fields, state.params, state.alias = nil, {}, {}, false
end

--- What is wrong with a stub, as "LINE: what" texts; empty where nothing is.
---@param text string
---@return string[]
function luals.problems(text)
  local problems, names = {}, {}
  local state = { defined = {} }
  forget(state)
  local number = 0
  local function try(check, ...)
    local fine, message = pcall(check, ...)
    if not fine then problems[#problems + 1] = ("%d: %s"):format(number, message) end
  end
  for line in text:gmatch "([^\n]*)\n" do
    number = number + 1
    local tag, rest = line:match "^%s*%-%-%-%s?@(%a+)(.*)$"
    local option = line:match "^%s*%-%-%-|%s*(.*)$"
    local used = {}
    if tag then
      local read = tags[tag]
      if read then
        try(read, reader(rest, used), state)
      else
        problems[#problems + 1] = ("%d: @%s is not known"):format(number, tag)
      end
    elseif option then
      if not state.alias then problems[#problems + 1] = number .. ": an option of no alias" end
      local read = reader(option, used)
      try(read.union, read)
    elseif not line:match "^%s*%-%-%-" then
      try(check_arguments, line, state)
      forget(state)
    end
    for _, name in ipairs(used) do names[#names + 1] = { name, number } end
  end
  for _, each in ipairs(names) do
    if not BUILT_IN[each[1]] and not state.defined[each[1]] then
      problems[#problems + 1] = ("%d: the type %s is not defined"):format(each[2], each[1])
    end
  end
  return problems
end

return luals
