--- help.lua: `?name` at the prompt: the signature, arguments, units and an example of a public
--- name, from the API table.

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

-- "options?  { ... }  text" of an argument or result.
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

-- The options of a table argument. The fields of an experiment are topics of their own.
local function option_lines(entry, argument)
  local lines = {}
  for _, option in ipairs(entry.name == "limax.experiment" and {}
    or api.options(entry, argument)) do
    add(lines, named_lines(option.name, option.type, option.what))
  end
  return lines
end

-- The fields of a table type.
local function field_lines(type_text)
  local lines = {}
  -- an inline type is complete
  for _, field in ipairs(type_text:find("{", 1, true) and {} or api.fields_of(type_text)) do
    add(lines, named_lines(field.name .. (field.optional and "?" or ""), field.type, field.text))
  end
  return lines
end

--- The page of one entry.
function help.page(entry)
  local lines = { entry.signature }
  add(lines, wrapped(entry.what, "  "))
  if entry.doc then
    for _, param in ipairs(entry.doc.params) do
      add(lines, wrapped(value_line(param.name .. (param.optional and "?" or ""), param), "    "))
      -- an inline type is complete
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

-- All public names, by groups.
local function overview()
  local lines = { "?name describes a name: ?limax.robot, ?distance, ?robot:trace. Names:" }
  for _, group in ipairs(api.groups()) do
    local names = {}
    for i, entry in ipairs(group.list) do names[i] = entry.short end
    lines[#lines + 1] = group.title
    add(lines, wrapped(table.concat(names, " "), "    "))
  end
  return table.concat(lines, "\n")
end

-- The group of the class of a typed name, and the rest after the name.
local function group_of_value(topic, names)
  local name, rest = topic:match "^([%a_][%w_]*)[.:]?(.*)$"
  local class = name and kind.of(names:get(name))
  if not class then return nil end
  for _, group in ipairs(api.groups()) do
    if group.class == class then return group, rest end
  end
end

-- Pages of the fields of experiments with this path or end of it: "scene.ground", "ground".
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
    nearest and ("; did you mean %q?"):format(nearest) or "; ? lists all topics"))
end

-- The page of a group; the title of a module is its name.
local function group_page(topic, group)
  local title = group.title:sub(1, 1):lower() .. group.title:sub(2)
  local lines = { title == topic and ("%s: %s"):format(topic, group.text)
    or ("%s is %s. %s"):format(topic, title, group.text) }
  local shorts = {}
  for i, entry in ipairs(group.list) do shorts[i] = entry.short end
  add(lines, wrapped(table.concat(shorts, " "), "    "))
  return table.concat(lines, "\n")
end

--- The pages about a topic.
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

--- Writes the pages about a topic; an unknown topic is an error.
---@param topic string the text after the `?`
function help.show(topic, names)
  -- of a call its name
  topic = topic:match("^%s*(.-)[%s;?]*$"):gsub("%s*%b()$", "")
  if topic == "" then
    io.write(overview(), "\n")
    return
  end
  local pages = help.pages(topic, names)
  if #pages == 0 and topic:match "^_%d?$" then
    pages[1] = "_ is the last value that was shown, _1 the one before it, up to _9."
  end
  if #pages == 0 then refuse(topic) end
  io.write(table.concat(pages, "\n\n"), "\n")
end

return help
