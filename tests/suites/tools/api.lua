--- api.lua: the API table: every public name stands in it, its examples run, and what is made of it
--- (the reference page, the stub for editors) is what it says.

local annotations = require "limax.tools.reference.annotations"
local api = require "limax.tools.reference.api"
local defaults = require "limax.settings.defaults"
local experiment_fields = require "limax.tools.reference.experiment_fields"
local host = require "limax.host"
local limax = require "limax"
local luals = require "support.luals"
local page = require "limax.tools.reference.page"
local process = require "support.process"
local stub = require "limax.tools.reference.stub"

local suite = require("limax.test").suite "api"

local function has(group, name)
  for _, entry in ipairs(group.list) do
    if entry.short == name then return true end
  end
  return false
end

local function listed(list, name)
  for _, each in ipairs(list or {}) do
    if each == name then return true end
  end
  return false
end

-- Adds the names of a table that a group lacks.
local function miss(missing, group, names)
  for _, name in ipairs(names) do
    if not has(group, name) and not listed(group.internal, name) then
      missing[#missing + 1] = group.prefix .. name
    end
  end
end

local function keys_of(value)
  local keys = {}
  for key in pairs(value) do keys[#keys + 1] = key end
  table.sort(keys)
  return keys
end

-- Functions that a group's files define under its holder.
local function defined(group)
  local names = {}
  for _, path in ipairs { group.file, unpack(group.also or {}) } do
    for _, name in ipairs(annotations.of(path, host.home).defined) do
      local holder = group.holder and name:sub(1, #group.holder) == group.holder
      local short = name:match "[^.:]*$"
      -- an undocumented method is nobody's business
      local documented = annotations.of(path, host.home).functions[name]
      if holder and documented and short:sub(1, 2) ~= "__" then names[#names + 1] = short end
    end
  end
  return names
end

suite:test("every public name has an entry", function(t)
  local missing = {}
  for _, group in ipairs(api.groups()) do
    local module = group.prefix:match "^limax%.(%w+)%.$"
    if module then miss(missing, group, keys_of(limax[module])) end
    if group.prefix == "limax." then miss(missing, group, getmetatable(limax).__fields) end
    if group.keys then miss(missing, group, keys_of(limax[module][group.keys])) end
    if group.class then
      if group.holder then miss(missing, group, defined(group)) end
      local class = annotations.of(group.file, host.home).classes[group.class]
      local names = {}
      for i, field in ipairs(class.fields) do names[i] = field.name end
      miss(missing, group, names)
    end
  end
  t:equal(missing, {})
end)

suite:test("tables that public names mention are known by their fields", function(t)
  local by_name = {}
  for _, class in ipairs(api.tables()) do by_name[class.name] = class end
  for _, name in ipairs { "limax.generation", "limax.limit", "limax.robot.ledger",
    "limax.robot.block", "limax.run.options" } do
    t:ok(by_name[name], name .. " is not among them")
  end
  t:equal(by_name["limax.scored_robot"], nil) -- has entries of its own

  -- a real generation has the fields that are listed, and no others
  local run = limax.start(limax.experiment { fitness = function() return 1, { one = 1 } end,
    lattice = { 2, 2, 2 }, population = 4, generations = 1, repetitions = 1,
    simulation = { duration = 0.1, settle = 0, accuracy = "preview" } }, { device = "cpu" })
  local entry, fields = run:finish()[1], {}
  for _, field in ipairs(by_name["limax.generation"].fields) do
    fields[field.name] = true
    t:ok(entry[field.name] ~= nil, "a generation has no " .. field.name)
  end
  for _, key in ipairs(keys_of(entry)) do t:ok(fields[key], key .. " is not listed") end
end)

suite:test("the prompt's words have entries", function(t)
  local missing = {}
  local words = require("limax.tools.repl.words").of(function() end)
  miss(missing, api.groups()[1], keys_of(words))
  t:equal(missing, {})
end)

suite:test("every entry says what it is, its unit and an example", function(t)
  for _, group in ipairs(api.groups()) do
    for i, entry in ipairs(group.list) do
      local given = group.entries[i]
      t:ok(#entry.what >= 4, entry.name .. ": what is it?")
      t:ok(given[2] == false or type(given[2]) == "string" and #given[2] > 0,
        entry.name .. ": units, or false")
      t:ok(type(given[3]) == "string" and #given[3] > 0, entry.name .. ": an example")
      if entry.doc then
        for _, param in ipairs(entry.doc.params) do
          t:ok(listed(entry.doc.arguments, param.name) or param.name == "...",
            ("%s: its comment has an argument %s"):format(entry.name, param.name))
        end
        t:equal(#entry.doc.params >= #entry.doc.arguments or entry.doc.arguments[1] == nil
          or ("%s: the comment lacks an argument"):format(entry.name), true)
      end
    end
  end
end)

suite:test("every example runs at the prompt", { limit = 300 }, function(t)
  local folder = t:folder()
  process.write(folder .. "/mine.lua", "return { answer = 42 }\n")
  -- what examples of supervisors read: a finished run
  process.write(folder .. "/walk.lua", [[
return require("limax").experiment { name = "walk", fitness = "walk", generations = 2,
  repetitions = 1, simulation = { duration = 0.1, settle = 0 }, supervisor = "random" }
]])
  os.execute(("cd %s; %s run walk.lua -q >/dev/null 2>&1"):format(process.quote(folder),
    process.quote(host.executable)))
  for _, group in ipairs(api.groups()) do
    local lines = { group.stage or "" }
    for _, entry in ipairs(group.list) do
      -- an expression is muted; statements are as they stand
      lines[#lines + 1] = entry.example
    end
    process.write(folder .. "/input", table.concat(lines, "\n") .. "\n")
    local pipe = io.popen(("cd %s; TERM=dumb %s repl <input 2>&1 >output; echo status $?"):format(
      process.quote(folder), process.quote(host.executable)))
    t:equal(("%s: %s"):format(group.title, pipe:read "*a"), group.title .. ": status 0\n")
    pipe:close()
  end
end)

suite:test("fields of an experiment are those that it takes", function(t)
  local function known(path)
    local given = { fitness = "walk" }
    local inner = given
    for name in path:gmatch "[^.]+" do
      inner[name] = {}
      inner = inner[name]
    end
    inner.qqqqqqqqqqqqqqqq = 1
    local _, message = pcall(limax.experiment, given)
    return message:match "known are: (.*)$"
  end
  local function names_of(list)
    local names = {}
    for i, option in ipairs(list) do names[i] = option.name end
    return table.concat(names, ", ")
  end
  t:equal(names_of(experiment_fields.list()), known "")
  for _, option in ipairs(experiment_fields.list()) do
    if option.fields and option.name ~= "scene" and option.name ~= "record" then
      t:equal(option.name .. ": " .. names_of(option.fields),
        option.name .. ": " .. known(option.name))
    end
  end
end)

suite:test("words that a comment lists are those that the code takes", function(t)
  local class = annotations.of("scripts/lib/robot/prepared.lua", host.home)
    .classes["limax.robot.simulate_options"]
  local types = {}
  for _, field in ipairs(class.fields) do types[field.name] = field.type end
  for name, list in pairs { integrator = defaults.integrators, precision = defaults.precisions } do
    t:equal(types[name], '"' .. table.concat(list, '"|"') .. '"')
  end
  for word in types.accuracy:gmatch '"(%w+)"' do t:ok(defaults.tiers[word], word) end
end)

suite:test("the reference page is up to date", function(t)
  t:ok(page.written() == page.text(), page.path .. " differs from the API table: run limax "
    .. "scripts/dev/reference.lua")
end)

suite:test("the stub for editors is up to date, whole, and Lua", function(t)
  local text = stub.text()
  t:ok(stub.written() == text, stub.path .. " differs from the API table: run limax "
    .. "scripts/dev/reference.lua")
  t:ok(loadstring(text))
  t:equal(luals.problems(text), {})
end)

suite:test("what the reader of stubs refuses", function(t)
  local function problem(text) return table.concat(luals.problems(text .. "\n"), "; ") end
  for text, expected in pairs {
    ["---@clas a"] = "1: @clas is not known",
    ["---@class"] = "1: expected a class's name",
    ["---@class a\n---@class a"] = "2: a is defined twice",
    ["---@class a : b"] = "1: the type b is not defined",
    ["---@field x number"] = "1: a field of no class",
    ["---@class a\n---@field x"] = '2: expected a type at ""',
    ["---@class a\n---@field x nmber"] = "2: the type nmber is not defined",
    ["---@class a\n---@field x number\n---@field x? string"] = "3: a has a field x already",
    ["---@class a\n---@field x number|"] = '2: expected a type at ""',
    ["---@class a\n---@field x { y number }"] = "2: expected a colon and the field's type",
    ["---@class a\n---@field x { y: number,"] = "2: expected a field's name",
    ["---@class a\n---@field x { y: number"] = "2: expected }",
    ["---@class a\n---@field x table<string, number"] = "2: expected >",
    ["---@class a\n---@field x fun(y: number"] = "2: expected ) of a function's type",
    ["---@class a\n---@field x (number|string"] = "2: expected )",
    ["---@param x number\nlocal y"] = "2: arguments of no function",
    ["---@param y number\nfunction f(x) end"] = "2: y is no argument of it",
    ["---@param x number\nfunction f(x, y) end"] = "2: the argument y has no @param",
    ["---@param x number\n---@param x number\nfunction f(x) end"] = "2: the argument x stands",
    ["---@return"] = '1: expected a type at ""',
    ["---@overload number"] = "1: expected fun(...)",
    ["---| 'x'"] = "1: an option of no alias",
  } do
    t:ok(problem(text):find(expected, 1, true), ("%s: %s"):format(text, problem(text)))
  end
  for _, text in ipairs {
    "---@class a : table what it is\n---@field x? number|nil m\n---@field y integer[] { 1, 2 }",
    "---@class a\n---@field f fun(self: a, ...: any): boolean, string|nil text (of it",
    "---@alias a\n---| 'x' one\n---| { [string]: a, n?: fun() }",
    "---@alias a 'x'|\"y\"|-1",
    "---@param x table<string, (number|string)[]>? text\n---@param ... any\nfunction f(x, ...) end",
    "---@return number x, string|nil y text",
    "---@overload fun(x: number): ffi.cdata*",
  } do
    t:equal(problem(text), "")
  end
end)
