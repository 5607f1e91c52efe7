--- typed.lua: limax at a pseudo-terminal: keys and the resulting screen, and transcripts:
--- files of lines `text => value` or `text => ERROR message`. `=> more` continues the value and
--- `.. text` the text; `...` in a value matches anything.

local host = require "limax.host"
local process = require "support.process"

local typed = {}

-- limit of a step on a busy machine, s
local PATIENCE = 60

---@class typed.step
---@field keys string
---@field ends string|nil the expected line at the cursor; nil: the end of the program
---@field breaks boolean|nil after a line break
---@field signal integer|nil is sent to the program before the keys

--- Types steps at `limax repl`; a step without its expected end fails the test.
---@param t limax.test_context
---@param steps typed.step[]
---@param options? { words?: string[], folder?: string }
---@return { status: integer, echo: boolean, steps: { lines: string[] }[] }
function typed.run(t, steps, options)
  if os.execute "command -v python3 >/dev/null" ~= 0 then t:skip "python3 is not installed" end
  options = options or {}
  local folder = options.folder or t:folder()
  local list = {}
  for i, step in ipairs(steps) do
    list[i] = { keys = step.keys, ends = step.ends or host.json.null, breaks = step.breaks == true,
      signal = step.signal or 0 }
  end
  local command = { host.executable, "repl" }
  local environment = { TERM = "dumb", HOME = folder, XDG_STATE_HOME = folder .. "/state",
    XDG_CONFIG_HOME = folder .. "/config" }
  for _, word in ipairs(options.words or {}) do command[#command + 1] = word end
  process.write(folder .. "/steps.json", host.json.encode { command = command, columns = 200,
    seconds = PATIENCE, steps = list, environment = environment })
  local screen = process.output(("cd %s && python3 %s <steps.json"):format(process.quote(folder),
    process.quote(host.home .. "/tests/support/terminal.py")))
  local result = assert(host.json.decode(screen, "the terminal's answer"))
  for i, step in ipairs(result.steps) do
    if step.late then
      t:equal(table.concat(step.lines, "\n"), ("step %d: ... %s"):format(i,
        steps[i].ends or "(the end)"))
    end
  end
  return result
end

-- The entries of a transcript: typed lines and expected lines.
local function entries_of(path)
  local entries = {}
  for line in io.lines(path) do
    local last = entries[#entries]
    local more = line:match "^=> ?(.*)$"
    if more then
      last.value[#last.value + 1] = more
    elseif line:match "^%.%. " then
      local text, value = line:match "^%.%. (.-) => (.*)$"
      last.typed[#last.typed + 1] = text or line:sub(4)
      if value then last.value[1] = value end
    elseif line ~= "" and not line:match "^%-%-" then
      local text, value = line:match "^(.-) => (.*)$"
      entries[#entries + 1] = { typed = { text or line }, value = { value } }
    end
  end
  return entries
end

--- Types a transcript and compares the screen with it.
---@param t limax.test_context
---@param path string
function typed.transcript(t, path)
  local entries = entries_of(path)
  local steps, of_entry = { { keys = "", ends = ">" } }, {}
  for i, entry in ipairs(entries) do
    for k, line in ipairs(entry.typed) do
      local open = k < #entry.typed
      steps[#steps + 1] = { keys = line .. "\n", ends = open and ".." or ">", breaks = true }
    end
    of_entry[i] = #steps
  end
  steps[#steps + 1] = { keys = "\4" }
  local result = typed.run(t, steps)
  for i, entry in ipairs(entries) do
    local lines = result.steps[of_entry[i]].lines
    local shown = {}
    -- between the typed line and the next prompt
    for k = 2, #lines - 1 do
      -- a GPU may compile a kernel first
      if not lines[k]:find "^limax: compiled the kernel" then shown[#shown + 1] = lines[k] end
    end
    local expected = entry.value
    local message = expected[1] and expected[1]:match "^ERROR (.*)$"
    if message then
      expected, shown = { message }, { shown[1] }
    end
    local got, wanted = table.concat(shown, "\n"), table.concat(expected, "\n")
    local pattern = wanted:gsub("%p", "%%%0"):gsub("%%%.%%%.%%%.", ".*")
    if not got:find("^" .. pattern .. "$") then
      t:equal(("%s => %s"):format(entry.typed[1], got),
        ("%s => %s"):format(entry.typed[1], wanted))
    end
  end
  t:equal(result.status, 0)
end

return typed
