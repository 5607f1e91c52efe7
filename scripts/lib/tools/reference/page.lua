--- page.lua: scripts/REFERENCE.md, made from the API table: every public name with its signature,
--- unit and example, and every field of an experiment.

local api = require "limax.tools.reference.api"
local experiment_fields = require "limax.tools.reference.experiment_fields"
local host = require "limax.host"

local page = {}

page.path = "scripts/REFERENCE.md"

local WIDTH = 160

local head = "Every public name. Made by `scripts/dev/reference.lua` from the API table "
  .. "(`scripts/lib/tools/reference/`) and the comments in the code; do not edit. `?name` at the prompt of "
  .. "`limax repl` shows the same. Files and fields of a run: [RUN_FOLDER.md](RUN_FOLDER.md). "
  .. "An editor with LuaLS knows all this once its setting `Lua.workspace.library` names the "
  .. "folder `scripts/meta`."

-- A text in lines of at most WIDTH; those after the first are indented.
local function wrapped(text, indent)
  local lines, line = {}, nil
  for word in text:gmatch "%S+" do
    if line and #line + #word + 1 > WIDTH then
      lines[#lines + 1] = line
      line = indent .. word
    else
      line = line and line .. " " .. word or word
    end
  end
  lines[#lines + 1] = line
  return table.concat(lines, "\n")
end

local function code(text)
  -- a text with backticks stands between two of them
  return text:find("`", 1, true) and "`` " .. text .. " ``" or "`" .. text .. "`"
end

local function sentence(text) return text:match "[.:!?]$" and text or text .. "." end

local function of_entry(entry)
  local parts = { "- " .. code(entry.signature) }
  if entry.units then parts[1] = parts[1] .. ", " .. entry.units end
  parts[1] = parts[1] .. ":"
  parts[2] = sentence(entry.what)
  for _, param in ipairs(entry.doc and entry.doc.params or {}) do
    local text = code(("%s%s: %s"):format(param.name, param.optional and "?" or "", param.type))
    parts[#parts + 1] = param.text ~= "" and ("%s, %s;"):format(text, param.text) or text .. ";"
  end
  for _, result in ipairs(entry.doc and entry.doc.returns or {}) do
    local text = "gives " .. code(result.type)
    parts[#parts + 1] = result.text ~= "" and ("%s, %s;"):format(text, result.text) or text .. ";"
  end
  parts[#parts] = parts[#parts]:gsub(";$", ".")
  parts[#parts + 1] = code(entry.example)
  return wrapped(table.concat(parts, " "), "  ")
end

local function of_table(class)
  local parts = { "- " .. code(class.name) .. ":" }
  if class.text ~= "" then parts[2] = sentence(class.text) end
  for _, field in ipairs(class.fields) do
    local text = code(("%s%s: %s"):format(field.name, field.optional and "?" or "", field.type))
    parts[#parts + 1] = field.text ~= "" and ("%s, %s;"):format(text, field.text) or text .. ";"
  end
  parts[#parts] = parts[#parts]:gsub(";$", ".")
  return wrapped(table.concat(parts, " "), "  ")
end

local function cell(text) return (text:gsub("|", "\\|")) end

local function add_fields(lines, list, prefix)
  for _, option in ipairs(list) do
    lines[#lines + 1] = ("| `%s%s` | %s | %s |"):format(prefix, option.name, cell(option.units),
      cell(option.what))
    if option.fields then add_fields(lines, option.fields, prefix .. option.name .. ".") end
  end
end

--- The text of the page.
---@return string
function page.text()
  local lines = { "# Reference\n", wrapped(head, "") .. "\n" }
  for _, group in ipairs(api.groups()) do
    lines[#lines + 1] = "## " .. group.title .. "\n"
    lines[#lines + 1] = wrapped(group.text, "") .. "\n"
    for _, entry in ipairs(group.list) do lines[#lines + 1] = of_entry(entry) end
    lines[#lines + 1] = ""
  end
  lines[#lines + 1] = "## Tables\n"
  lines[#lines + 1] = "What is given and taken above, by the name of its type; `?` marks what may"
    .. " be absent.\n"
  for _, class in ipairs(api.tables()) do lines[#lines + 1] = of_table(class) end
  lines[#lines + 1] = ""
  lines[#lines + 1] = "## Fields of an experiment\n"
  lines[#lines + 1] = "| field | unit | what |\n|---|---|---|"
  add_fields(lines, experiment_fields.list(), "")
  return table.concat(lines, "\n") .. "\n"
end

--- What stands in the file now; nil where there is none.
---@return string|nil
function page.written()
  return (require("limax.base.source").read(host.home .. "/" .. page.path))
end

return page
