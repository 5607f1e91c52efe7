--- help.lua: `?name` at the prompt: what a public name is, from the API table: its signature, its
--- arguments, units and an example.

local api = require "limax.api"
local failure = require "limax.failure"
local suggest = require "limax.suggest"

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

--- The page of one entry.
---@param entry limax.api.entry
---@return string
function help.page(entry)
  local lines = { entry.signature }
  add(lines, wrapped(entry.what, "  "))
  if entry.doc then
    for _, param in ipairs(entry.doc.params) do
      add(lines, wrapped(value_line(param.name .. (param.optional and "?" or ""), param), "    "))
    end
    for _, result in ipairs(entry.doc.returns) do
      add(lines, wrapped(value_line("gives", result), "    "))
    end
  end
  if entry.units then lines[#lines + 1] = "  units:   " .. entry.units end
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

--- Writes what a topic is; raises where nothing is known.
---@param topic string what stands after the `?`
function help.show(topic)
  topic = topic:match "^%s*(.-)[%s;?]*$"
  if topic == "" then
    io.write(overview(), "\n")
    return
  end
  local entries = api.find(topic)
  if #entries == 0 then
    local names = {}
    for _, entry in ipairs(api.entries()) do
      names[#names + 1], names[#names + 2] = entry.name, entry.short
    end
    local nearest = suggest(topic, names)
    failure.raise(1, ("no help on %q%s"):format(topic,
      nearest and ("; did you mean %q?"):format(nearest) or "; ? alone says what there is"))
  end
  local pages = {}
  for i, entry in ipairs(entries) do pages[i] = help.page(entry) end
  io.write(table.concat(pages, "\n\n"), "\n")
end

return help
