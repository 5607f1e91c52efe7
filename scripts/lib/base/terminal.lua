--- terminal.lua: text for terminals: colours, visible widths, control characters, tables. Every
--- function returns text and writes nothing.

local host = require "limax.host"

local terminal = {}

---@class limax.terminal.style
---@field color boolean ANSI colours
---@field ascii boolean nothing beyond ASCII
---@field width integer columns

--- The style for this process's standard output; fields of `wish` override it.
---@param wish? { color?: boolean, ascii?: boolean, width?: integer }
function terminal.style(wish)
  wish = wish or {}
  local facts = host.terminal()
  local style = { color = wish.color, ascii = wish.ascii, width = wish.width }
  if style.color == nil then style.color = facts.stdout and facts.color end
  if style.ascii == nil then style.ascii = os.getenv "TERM" == "dumb" end
  local has_width = facts.stdout and facts.columns and facts.columns > 0
  if not style.width or style.width < 1 then style.width = has_width and facts.columns or 80 end
  return style
end

--- The text if it is UTF-8, else with a question mark for each byte above 127.
function terminal.utf8(text)
  return pcall(host.json.encode, text) and text or (text:gsub("[\128-\255]", "?"))
end

--- A text of a file or a folder's name on one line, with control characters shown.
function terminal.word(text)
  return (terminal.shown(text):gsub("[\n\t]", " "))
end

--- The beginning of a text in UTF-8, cut between characters.
---@param longest integer bytes
function terminal.beginning(text, longest)
  if #text <= longest then return text end
  while longest > 0 and text:find("^[\128-\191]", longest + 1) do longest = longest - 1 end
  return text:sub(1, longest)
end

--- The beginning of a text as `terminal.word`.
---@param longest integer bytes
function terminal.line(text, longest)
  return terminal.beginning(terminal.word(text), longest)
end

--- The visible width of a text: escape sequences count 0, a UTF-8 letter 1.
function terminal.width(text)
  local visible = text:gsub("\27%[[%d;]*m", "")
  local _, continuation = visible:gsub("[\128-\191]", "")
  return #visible - continuation
end

--- A text padded to `width` columns.
---@param right? boolean align at the right
function terminal.pad(text, width, right)
  local fill = (" "):rep(width - terminal.width(text))
  return right and fill .. text or text .. fill
end

--- A text in lines of at most `width` letters, or as `measure` counts; a longer word has a line of
--- its own. `indent` is before each line but the first.
---@param measure? fun(line: string): number
function terminal.wrap(text, width, indent, measure)
  local lines, line = {}, nil
  measure = measure or string.len
  for word in text:gmatch "%S+" do
    if line and measure(line .. " " .. word) > width then
      lines[#lines + 1] = line
      line = indent .. word
    else
      line = line and line .. " " .. word or word
    end
  end
  lines[#lines + 1] = line
  return lines
end

--- A text in one of the 256 colours, or plain.
function terminal.paint(text, code, style)
  return style.color and ("\27[38;5;%dm%s\27[0m"):format(code, text) or text
end

function terminal.bold(text, style) return style.color and "\27[1m" .. text .. "\27[0m" or text end

function terminal.dim(text, style) return style.color and "\27[2m" .. text .. "\27[0m" or text end

-- The colours that limax makes, as above and in body_picture.lua.
local OWN_COLORS = { "^%[[012]m$", "^%[38;5;%d+m$", "^%[48;5;%d+;38;5;16m$" }

-- Control characters as patterns of their bytes: the ASCII ones but line ends, tabs and escape, the
-- C1 ones, and those that change the direction of the text around them, which reorder a line.
local CONTROLS = { "[%z\1-\8\11-\26\28-\31\127]", "\194[\128-\159]", "\216\156",
  "\226\128[\142\143\170-\174]", "\226\129[\166-\169]" }

local function escape(character)
  local first, second, third = character:byte(1, -1)
  local code = first
  if third then
    code = (first % 16 * 64 + second % 64) * 64 + third % 64
  elseif second then
    code = first % 32 * 64 + second % 64
  end
  return ("\\u%04x"):format(code)
end

--- A text with names and messages of other people as it may be sent to a terminal: control
--- characters are shown as \u001b, which JSON reads as what it was. Line ends and tabs stay.
---@param color? boolean colours as limax makes them stay
function terminal.shown(text, color)
  if terminal.utf8(text) ~= text then
    text = text:gsub("[\128-\255]", function(byte) return ("\\x%02x"):format(byte:byte()) end)
  end
  for _, pattern in ipairs(CONTROLS) do text = text:gsub(pattern, escape) end
  return (text:gsub("\27(%[?[%d;]*m?)", function(rest)
    for _, pattern in ipairs(OWN_COLORS) do
      if color and rest:find(pattern) then return nil end
    end
    return escape "\27" .. rest
  end))
end

--- A table with a head: numbers aligned right, words left, two blanks between columns.
---@param rows (string|number)[][] numbers show as %.4g
function terminal.table(head, rows, style)
  local texts, widths, right = {}, {}, {}
  for c, title in ipairs(head) do widths[c], right[c] = terminal.width(title), #rows > 0 end
  for r, row in ipairs(rows) do
    texts[r] = {}
    for c = 1, #head do
      local value = row[c]
      if value == nil then value = "" end
      texts[r][c] = type(value) == "number" and ("%.4g"):format(value) or tostring(value)
      -- a dash or an empty cell does not make a column one of words
      if type(value) ~= "number" and value ~= "" and value ~= "-" then
        right[c] = tonumber(value) ~= nil and right[c]
      end
      widths[c] = math.max(widths[c], terminal.width(texts[r][c]))
    end
  end
  local lines = {}
  local function line(cells, dress)
    local parts = {}
    for c = 1, #head do parts[c] = terminal.pad(cells[c], widths[c], right[c]) end
    lines[#lines + 1] = dress((table.concat(parts, "  "):gsub("%s+$", "")), style)
  end
  line(head, terminal.bold)
  for _, cells in ipairs(texts) do line(cells, function(text) return text end) end
  return table.concat(lines, "\n")
end

--- The head and the cells of rows with fields. A column is { title, value, format }: `value` is a
--- field, or a function of a row.
---@param missing string for nil
function terminal.cells(columns, list, missing)
  local head, cells = {}, {}
  for c, column in ipairs(columns) do head[c] = column[1] end
  for r, row in ipairs(list) do
    cells[r] = {}
    for c, column in ipairs(columns) do
      local title, value, format = unpack(column, 1, 3)
      if type(value) == "function" then value = value(row) else value = row[value or title] end
      if value ~= nil and format then value = format:format(value) end
      cells[r][c] = value == nil and missing or value
    end
  end
  return head, cells
end

--- The same as a table; nil shows as a dash.
function terminal.rows(columns, list, style)
  local head, cells = terminal.cells(columns, list, "-")
  return terminal.table(head, cells, style)
end

return terminal
