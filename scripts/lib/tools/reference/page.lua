--- page.lua: the text of scripts/REFERENCE.md: every public name with its signature and an example,
--- and every field of an experiment.

local api = require "limax.tools.reference.api"
local experiment_fields = require "limax.tools.reference.experiment_fields"
local terminal = require "limax.base.terminal"

local page = {}

page.path = "scripts/REFERENCE.md"

local WIDTH = 120

local head = "Every public name. Made by `limax scripts/dev/reference.lua` from the comments in "
  .. "the code; do not edit. `?name` in `limax repl` also lists arguments and results. "
  .. "Files and fields of a run: [RUN_FOLDER.md](RUN_FOLDER.md). Editors with LuaLS "
  .. "read `scripts/lib` and `bindings`: add both to the setting `Lua.workspace.library`."

local function wrapped(text) return table.concat(terminal.wrap(text, WIDTH, "  "), "\n") end

local function code(text)
  return text:find("`", 1, true) and "`` " .. text .. " ``" or "`" .. text .. "`"
end

-- An example is worth its line where it shows the form of an argument: a table, a text.
local function of_entry(entry)
  local text = ("- %s: %s"):format(code(entry.signature), entry.what)
  local telling = entry.kind == "function" and entry.example:find '[{"]'
  return wrapped(telling and ("%s %s"):format(text, code(entry.example)) or text)
end

local function add_fields(lines, list, prefix)
  for _, value in ipairs(list) do
    local name = prefix .. value.name .. (value.list and "[]" or "")
    lines[#lines + 1] = ("| `%s` | %s | %s |"):format(name, value.unit or "",
      (value.text:gsub("|", "\\|"))):gsub("|  |", "| |")
    if value.fields then add_fields(lines, value.fields, name .. ".") end
  end
end

--- The text of the page.
function page.text()
  local lines = { "# Reference\n", wrapped(head):gsub("\n  ", "\n") .. "\n" }
  for _, group in ipairs(api.groups()) do
    lines[#lines + 1] = ("## %s\n\n%s\n"):format(group.title, group.text)
    for _, entry in ipairs(group.list) do lines[#lines + 1] = of_entry(entry) end
    lines[#lines + 1] = ""
  end
  lines[#lines + 1] = "## Fields of an experiment\n\n| field | unit | what |\n|---|---|---|"
  add_fields(lines, experiment_fields.list(), "")
  return table.concat(lines, "\n") .. "\n"
end

return page
