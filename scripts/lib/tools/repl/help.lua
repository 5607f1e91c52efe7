--- help.lua: `?name` at the prompt: the signature, arguments, units and an example of a public
--- name, from the API table.

local api = require "limax.tools.reference.api"
local experiment_fields = require "limax.tools.reference.experiment_fields"
local failure = require "limax.base.failure"
local output = require "limax.base.output"
local suggest = require "limax.engine.suggest"
local terminal = require "limax.base.terminal"

local help = {}

local WIDTH = 96

-- Adds a text in lines of at most WIDTH, each indented.
local function add(lines, indent, text)
  for _, line in ipairs(terminal.wrap(text, WIDTH - #indent, "")) do
    lines[#lines + 1] = indent .. line
  end
end

-- Adds a line "name?: type; text" for each field.
local function add_fields(lines, fields)
  for _, field in ipairs(fields) do
    add(lines, "      ", ("%s%s: %s%s"):format(field.name, field.optional and "?" or "",
      field.type, field.text ~= "" and "; " .. field.text or ""))
  end
end

-- Adds "options?  limax.run.options  text" of an argument or result, and the fields of its type
-- where that does not list them itself.
local function add_value(lines, name, value)
  add(lines, "    ", ("%s%s  %s  %s"):format(name, value.optional and "?" or "", value.type,
    value.text))
  if not value.type:find("{", 1, true) then add_fields(lines, api.fields_of(value.type)) end
end

--- The page of one entry.
function help.page(entry)
  local lines = { entry.signature }
  add(lines, "  ", entry.what)
  for _, param in ipairs(entry.doc and entry.doc.params or {}) do
    add_value(lines, param.name, param)
  end
  for _, result in ipairs(entry.doc and entry.doc.returns or {}) do
    add_value(lines, "gives", result)
  end
  lines[#lines + 1] = "  example: " .. entry.example
  return table.concat(lines, "\n")
end

-- A title and the names of a group.
local function add_group(lines, title, group)
  local shorts = {}
  for i, entry in ipairs(group.list) do shorts[i] = entry.short end
  lines[#lines + 1] = title
  add(lines, "    ", table.concat(shorts, " "))
end

-- All public names, by groups.
local function overview()
  local lines = { "?name describes a name: ?limax.robot, ?distance, ?robot:trace. Names:" }
  for _, group in ipairs(api.groups()) do add_group(lines, group.title, group) end
  return table.concat(lines, "\n")
end

-- The title without its article: "array".
local function plain_title(group) return (group.title:lower():gsub("^an? ", "")) end

-- The page of a group; the title of a module is its name.
local function group_page(topic, group)
  local lines, title = {}, group.title:sub(1, 1):lower() .. group.title:sub(2)
  add_group(lines, plain_title(group) == topic and ("%s: %s"):format(topic, group.text)
    or ("%s is %s. %s"):format(topic, title, group.text), group)
  return table.concat(lines, "\n")
end

-- Adds pages of the fields of experiments with this path or end of it: "scene.ground", "ground".
local function add_field_pages(pages, topic, list, path)
  for _, value in ipairs(list) do
    local here = path .. value.name
    if here == topic or here:sub(-#topic - 1) == "." .. topic then
      local lines = { ("%s, a field of experiments"):format(here) }
      add(lines, "  ", value.text)
      if (value.unit or "") ~= "" then lines[#lines + 1] = "  units:   " .. value.unit end
      for _, inner in ipairs(value.fields or {}) do
        add(lines, "    ", ("%s, %s: %s"):format(inner.name, inner.unit or "-", inner.text))
      end
      pages[#pages + 1] = table.concat(lines, "\n")
    end
    add_field_pages(pages, topic, value.fields or {}, here .. ".")
  end
end

-- Is the topic a class, with or without "limax."?
local function names_class(topic, class)
  return class ~= nil and (class == topic or class == "limax." .. topic)
end

--- The pages about a topic.
function help.pages(topic)
  local pages = {}
  for i, entry in ipairs(api.find(topic)) do pages[i] = help.page(entry) end
  for _, group in ipairs(api.groups()) do
    if group.prefix == topic .. "." or names_class(topic, group.class)
      or plain_title(group) == topic:lower() then
      pages[#pages + 1] = group_page(topic, group)
    end
  end
  add_field_pages(pages, topic, experiment_fields.list(), "")
  for name, class in pairs(api.tables()) do
    if names_class(topic, name) then
      local lines = { name .. ", a table" }
      add(lines, "  ", class.text)
      add_fields(lines, class.fields)
      pages[#pages + 1] = table.concat(lines, "\n")
    end
  end
  return pages
end

--- Writes the pages about a topic; an unknown topic is an error.
---@param topic string the text after the `?`
function help.show(topic)
  -- of a call its name
  topic = topic:match("^%s*(.-)[%s;?]*$"):gsub("%s*%b()$", "")
  local pages = topic == "" and { overview() } or help.pages(topic)
  if #pages == 0 then
    local topics = {}
    for _, entry in ipairs(api.entries()) do
      topics[#topics + 1], topics[#topics + 2] = entry.name, entry.short
    end
    for _, group in ipairs(api.groups()) do
      topics[#topics + 1] = plain_title(group)
    end
    local nearest = suggest.nearest(topic, topics)
    failure.raise(1, ("no help on %q%s"):format(topic,
      nearest and ("; did you mean %q?"):format(nearest) or "; ? lists all topics"))
  end
  output.write(table.concat(pages, "\n\n"), "\n")
end

return help
