--- help.lua: `?name` at the prompt: what a public name is, from the API table: its signature, its
--- arguments, units and an example.

local api = require "limax.tools.reference.api"
local experiment_fields = require "limax.tools.reference.experiment_fields"
local failure = require "limax.base.failure"
local kind = require "limax.tools.repl.kind"
local suggest = require "limax.engine.suggest"

local help = {}

local WIDTH = 96

-- A text in lines of at most WIDTH, each indented.
local function wrapped(text, indent)
  local lines, line = {}, nil
  for word in text:gmatch "%S+" do
    if line and #line + #word + 1 > WIDTH - #indent then
      lines[#lines + 1] = indent .. line
      line = nil
    end
    line = line and line .. " " .. word or word
  end
  if line then lines[#lines + 1] = indent .. line end
  return lines
end

local function add(lines, more)
  for _, line in ipairs(more) do lines[#lines + 1] = line end
end

-- "  options?  { ... }  text" of one argument or result.
local function value_line(name, value)
  local text = ("%s  %s"):format(name, value.type)
  return value.text ~= "" and text .. "  " .. value.text or text
end

-- "name: type; text" of a field.
local function named_lines(name, value_type, text)
  local parts = {}
  if value_type then parts[1] = value_type end
  if text ~= "" then parts[#parts + 1] = text end
  return wrapped(("%s: %s"):format(name, table.concat(parts, "; ")), "      ")
end

-- What the table of an argument may hold. Experiments name their fields in their text, and each is
-- a topic of its own.
local function option_lines(entry, argument)
  local lines = {}
  for _, option in ipairs(entry.name == "limax.experiment" and {}
    or api.options(entry, argument)) do
    add(lines, named_lines(option.name, option.type, option.what))
  end
  return lines
end

-- The fields of a table that a function gives, or that a field is.
local function field_lines(type_text)
  local lines = {}
  -- an inline type says it all
  for _, field in ipairs(type_text:find("{", 1, true) and {} or api.fields_of(type_text)) do
    add(lines, named_lines(field.name .. (field.optional and "?" or ""), field.type, field.text))
  end
  return lines
end

--- The page of one entry.
---@param entry limax.api.entry
---@return string
function help.page(entry)
  local lines = { entry.signature }
  add(lines, wrapped(entry.what, "  "))
  if entry.doc then
    for _, param in ipairs(entry.doc.params) do
      add(lines, wrapped(value_line(param.name .. (param.optional and "?" or ""), param), "    "))
      -- an inline type says it all
      for i, argument in ipairs(param.type:find("{", 1, true) and {} or entry.doc.arguments) do
        if argument == param.name then add(lines, option_lines(entry, i)) end
      end
    end
    for _, result in ipairs(entry.doc.returns) do
      add(lines, wrapped(value_line("gives", result), "    "))
      add(lines, field_lines(result.type))
    end
  elseif entry.type then
    add(lines, field_lines(entry.type))
  end
  lines[#lines + 1] = "  example: " .. entry.example
  return table.concat(lines, "\n")
end

-- What there is, by groups.
local function overview()
  local lines = { "?name tells what a name is: ?limax.robot, ?distance, ?robot:trace. There are:" }
  for _, group in ipairs(api.groups()) do
    local names = {}
    for i, entry in ipairs(group.list) do names[i] = entry.short end
    lines[#lines + 1] = group.title
    add(lines, wrapped(table.concat(names, " "), "    "))
  end
  return table.concat(lines, "\n")
end

-- The group of a typed name's class, and what stands behind the name.
local function group_of_value(topic, names)
  local name, rest = topic:match "^([%a_][%w_]*)[.:]?(.*)$"
  local class = name and kind.of(names:get(name))
  if not class then return nil end
  for _, group in ipairs(api.groups()) do
    if group.class == class then return group, rest end
  end
end

-- A field of an experiment, by its path or the end of it: "scene.ground", "ground".
local function fields_called(topic)
  local pages = {}
  local function look(list, path)
    for _, option in ipairs(list) do
      local here = path .. option.name
      if here == topic or here:sub(-#topic - 1) == "." .. topic then
        local lines = { ("%s, a field of experiments"):format(here) }
        add(lines, wrapped(option.what, "  "))
        if option.units ~= "-" then lines[#lines + 1] = "  units:   " .. option.units end
        for _, inner in ipairs(option.fields or {}) do
          add(lines, wrapped(("%s, %s: %s"):format(inner.name, inner.units, inner.what), "    "))
        end
        pages[#pages + 1] = table.concat(lines, "\n")
      end
      if option.fields then look(option.fields, here .. ".") end
    end
  end
  look(experiment_fields.list(), "")
  return pages
end

local function refuse(topic)
  local names = {}
  for _, entry in ipairs(api.entries()) do
    names[#names + 1], names[#names + 2] = entry.name, entry.short
  end
  local nearest = suggest(topic, names)
  failure.raise(1, ("no help on %q%s"):format(topic,
    nearest and ("; did you mean %q?"):format(nearest) or "; ? alone says what there is"))
end

-- What a group is and has; `title` of a module is its name.
local function group_page(topic, group)
  local title = group.title:sub(1, 1):lower() .. group.title:sub(2)
  local lines = { title == topic and ("%s: %s"):format(topic, group.text)
    or ("%s is %s. %s"):format(topic, title, group.text) }
  local shorts = {}
  for i, entry in ipairs(group.list) do shorts[i] = entry.short end
  add(lines, wrapped(table.concat(shorts, " "), "    "))
  return table.concat(lines, "\n")
end

--- What is known of a topic, as pages; empty where nothing is.
---@param topic string
---@param names limax.repl.names
---@return string[]
function help.pages(topic, names)
  local group, rest = group_of_value(topic, names)
  if group and rest == "" then return { group_page(topic, group) } end
  local pages = {}
  if group then
    for _, entry in ipairs(group.list) do
      if entry.short == rest then pages[#pages + 1] = help.page(entry) end
    end
    if #pages > 0 then return pages end
  end
  for i, entry in ipairs(api.find(topic)) do pages[i] = help.page(entry) end
  for _, module in ipairs(api.groups()) do
    if module.prefix == topic .. "." then pages[#pages + 1] = group_page(topic, module) end
  end
  for _, page in ipairs(fields_called(topic)) do pages[#pages + 1] = page end
  for _, class in ipairs(api.tables()) do
    if class.name == topic then
      local lines = { topic .. ", a table" }
      add(lines, wrapped(class.text, "  "))
      add(lines, field_lines(topic))
      pages[#pages + 1] = table.concat(lines, "\n")
    end
  end
  return pages
end

--- Writes what a topic is; raises where nothing is known.
---@param topic string what stands after the `?`
---@param names limax.repl.names
function help.show(topic, names)
  -- a call is asked for by its name
  topic = topic:match("^%s*(.-)[%s;?]*$"):gsub("%s*%b()$", "")
  if topic == "" then
    io.write(overview(), "\n")
    return
  end
  local pages = help.pages(topic, names)
  if #pages == 0 and topic:match "^_%d?$" then
    pages[1] = "_ is the last value that was shown, _1 the one before, up to _9."
  end
  if #pages == 0 then refuse(topic) end
  io.write(table.concat(pages, "\n\n"), "\n")
end

return help
