--- options.lua: parses the arguments of a command by its table of options, which also gives its
--- help page.

local failure = require "limax.base.failure"
local schema = require "limax.engine.schema"
local suggest = require "limax.engine.suggest"

local options = {}

---@class limax.option
---@field name string the long form, without "--"; also the name of its value, with "_" for "-"
---@field short? string one letter, without "-"
---@field argument? string name of the value on the help page ("DIR"); nil for a switch
---@field text? string one line of help
---@field many? boolean may be repeated: the value is a list
---@field kind? "number"|"integer" the value is converted and checked
---@field minimum? number
---@field maximum? number
---@field choices? string[] the only valid values
---@field value? any the default

---@class limax.positional
---@field name string in messages ("FILE")
---@field least? integer smallest number of positional arguments (0)
---@field most? integer largest number (no limit)

---@class limax.command
---@field name? string set when the command is loaded
---@field summary string one line
---@field usage? string the line after "usage:", "limax run FILE [options]"
---@field text? string further paragraphs of the help page
---@field options? limax.option[]
---@field positional? limax.positional absent: none
---@field exclusive? string[][] lists of options of which at most one may be given
---@field run fun(arguments: table): integer|nil exit status, 0 if nil

local help = { name = "help", short = "h", text = "show this page" }

local exit_usage = 2

local function all_options(command)
  local list = {}
  for i, option in ipairs(command.options or {}) do list[i] = option end
  list[#list + 1] = help
  return list
end

local function refuse(command, message)
  failure.raise(exit_usage, ("%s; see limax %s --help"):format(message, command.name))
end

-- The value of an option from its text.
local function convert(command, option, text)
  if not option.choices and not option.kind then return text end
  local rule = option.choices and schema.choice(option.choices)
    or schema.number { integer = option.kind == "integer", minimum = option.minimum,
      maximum = option.maximum }
  local result, message = rule(option.kind and tonumber(text) or text, "--" .. option.name)
  if message then refuse(command, message) end
  return result
end

local function field(option) return (option.name:gsub("-", "_")) end

local function check_positional(command, arguments)
  local rule = command.positional or { most = 0 }
  local count = #arguments
  if count < (rule.least or 0) then
    refuse(command, ("limax %s needs %s"):format(command.name, rule.name))
  end
  if count > (rule.most or math.huge) then
    refuse(command, ('unexpected "%s"'):format(arguments[rule.most + 1]))
  end
end

--- Parses `argv` by the table of `command` (its `name` must be set). An error ends the command with
--- status 2. Switches are true or nil; `many` options are lists, possibly empty; positional
--- arguments are arguments[1], [2], ... With --help nothing else is checked and `arguments.help` is
--- true.
function options.parse(command, argv)
  local by_form, long_forms, arguments, i = {}, {}, {}, 0
  for _, option in ipairs(all_options(command)) do
    long_forms[#long_forms + 1] = "--" .. option.name
    by_form["--" .. option.name] = option
    if option.short then by_form["-" .. option.short] = option end
    arguments[field(option)] = option.many and {} or option.value
  end

  -- The word after an option. Another option there means that the value is missing.
  local function next_word(form, option)
    i = i + 1
    local word = argv[i]
    if not word or word:sub(1, 2) == "--" or by_form[word] then
      refuse(command, ("%s needs %s"):format(form, option.argument))
    end
    return word
  end

  -- Stores one option: "--name" or "-n", with its value if that is in the same word.
  local function take(form, text)
    local option = by_form[form]
    if not option then
      local ending = form:sub(1, 2) == "--" and suggest.ending(form, long_forms) or ""
      local meant = command.instead and command.instead(form:sub(3))
      if meant then ending = "; did you mean " .. meant .. "?" end
      refuse(command, ("unknown option %s%s"):format(form, ending))
    end
    local value = true
    if option.argument then
      value = convert(command, option, text or next_word(form, option))
    elseif text then
      refuse(command, ("%s takes no value"):format(form))
    end
    if option.many then
      table.insert(arguments[field(option)], value)
    else
      arguments[field(option)] = value
    end
  end

  local only_words = false
  while i < #argv do
    i = i + 1
    local word = argv[i]
    if only_words or word == "-" or word:sub(1, 1) ~= "-" then
      arguments[#arguments + 1] = word
    elseif word == "--" then
      only_words = true
    elseif word == "--help" or word == "-h" then
      return { help = true }
    elseif word:sub(1, 2) == "--" then
      take(word:match "^[^=]*", word:match "=(.*)$")
    else
      -- several switches ("-qv"), the last of which may take a value ("-oDIR", "-o DIR")
      for at = 2, #word do
        local form = "-" .. word:sub(at, at)
        local takes_value = (by_form[form] or {}).argument
        take(form, takes_value and at < #word and word:sub(at + 1) or nil)
        if takes_value then break end
      end
    end
  end
  check_positional(command, arguments)
  for _, list in ipairs(command.exclusive or {}) do
    local chosen
    for _, name in ipairs(list) do
      if arguments[field(by_form["--" .. name])] then
        if chosen then
          refuse(command, ("--%s and --%s exclude each other"):format(chosen, name))
        end
        chosen = name
      end
    end
  end
  return arguments
end

--- Rows of two aligned columns.
function options.columns(rows)
  local width = 0
  for _, row in ipairs(rows) do width = math.max(width, #row[1]) end
  local lines = {}
  for i, row in ipairs(rows) do
    lines[i] = ("  %-" .. width .. "s  %s"):format(row[1], row[2]):gsub("%s+$", "")
  end
  return table.concat(lines, "\n") .. "\n"
end

--- The help page of a command.
function options.help(command)
  local rows = {}
  for i, option in ipairs(all_options(command)) do
    local form = (option.short and "-" .. option.short .. ", " or "    ") .. "--" .. option.name
    if option.argument then form = form .. " " .. option.argument end
    local text = option.text or ""
    if option.value ~= nil then text = text .. " [" .. tostring(option.value) .. "]" end
    rows[i] = { form, text }
  end
  local usage = command.usage or ("limax " .. command.name .. " [options]")
  local parts = { "usage: ", usage, "\n\n", command.summary, "\n" }
  if command.text then
    parts[#parts + 1] = "\n" .. command.text .. "\n"
  end
  parts[#parts + 1] = "\noptions:\n" .. options.columns(rows)
  return table.concat(parts)
end

return options
