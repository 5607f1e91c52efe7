--- csv.lua: rows of numbers and words as RFC 4180 text. Names may come from other people: words
--- that a spreadsheet would take for a formula begin with an apostrophe, and control characters are
--- shown.

local terminal = require "limax.base.terminal"

local csv = {}

local function cell(value)
  if value == nil then return "" end
  if type(value) == "number" then
    -- the shorter text where it is the same number
    local short = ("%.15g"):format(value)
    return tonumber(short) == value and short or ("%.17g"):format(value)
  end
  local text = terminal.shown(tostring(value))
  if text:find "^[=+%-@\t\r]" and not tonumber(text) then text = "'" .. text end
  if text:find '[",\r\n]' then text = '"' .. text:gsub('"', '""') .. '"' end
  return text
end

--- One line of names, then a line for each row.
---@param rows table[] values by column name
function csv.encode(columns, rows)
  local names = {}
  for i, column in ipairs(columns) do names[i] = cell(column) end
  local lines = { table.concat(names, ",") }
  for _, row in ipairs(rows) do
    local cells = {}
    for i, column in ipairs(columns) do cells[i] = cell(row[column]) end
    lines[#lines + 1] = table.concat(cells, ",")
  end
  return table.concat(lines, "\n") .. "\n"
end

return csv
