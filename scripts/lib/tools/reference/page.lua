--- page.lua: the text of scripts/REFERENCE.md: every public name with its signature and an example,
--- and every field of an experiment.

local api = require "limax.tools.reference.api"
local experiment_fields = require "limax.tools.reference.experiment_fields"

local page = {}

page.path = "scripts/REFERENCE.md"

local WIDTH = 160

local head = "Every public name. Made by `limax scripts/dev/reference.lua` from the comments in "
  .. "the code; do not edit. `?name` in `limax repl` also lists arguments and results. "
  .. "Files and fields of a run: [RUN_FOLDER.md](RUN_FOLDER.md). For editors with LuaLS the build "
  .. "writes `scripts/meta`: add it to the setting `Lua.workspace.library`."

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
  return text:find("`", 1, true) and "`` " .. text .. " ``" or "`" .. text .. "`"
end

local function of_entry(entry)
  local text = ("- %s: %s"):format(code(entry.signature), entry.what)
  if entry.kind ~= "field" then text = ("%s %s"):format(text, code(entry.example)) end
  return wrapped(text, "  ")
end

local function add_fields(lines, list, prefix)
  for _, option in ipairs(list) do
    lines[#lines + 1] = ("| `%s%s` | %s | %s |"):format(prefix, option.name,
      (option.units:gsub("|", "\\|")), (option.what:gsub("|", "\\|")))
    if option.fields then add_fields(lines, option.fields, prefix .. option.name .. ".") end
  end
end

--- The text of the page.
---@return string
function page.text()
  local lines = { "# Reference\n", wrapped(head, "") .. "\n" }
  for _, group in ipairs(api.groups()) do
    lines[#lines + 1] = ("## %s\n\n%s\n"):format(group.title, wrapped(group.text, ""))
    for _, entry in ipairs(group.list) do lines[#lines + 1] = of_entry(entry) end
    lines[#lines + 1] = ""
  end
  lines[#lines + 1] = "## Fields of an experiment\n\n| field | unit | what |\n|---|---|---|"
  add_fields(lines, experiment_fields.list(), "")
  return table.concat(lines, "\n") .. "\n"
end

return page
