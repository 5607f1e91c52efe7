--- letters.lua: the few letters that pictures of pixels need, 5 x 7 dots each.

local letters = {}

letters.WIDTH, letters.HEIGHT = 5, 7

-- Rows from the top; "#" is a dot.
local ROWS = {
  ["0"] = { " ### ", "#   #", "#  ##", "# # #", "##  #", "#   #", " ### " },
  ["1"] = { "  #  ", " ##  ", "  #  ", "  #  ", "  #  ", "  #  ", " ### " },
  ["2"] = { " ### ", "#   #", "    #", "   # ", "  #  ", " #   ", "#####" },
  ["3"] = { " ### ", "#   #", "    #", "  ## ", "    #", "#   #", " ### " },
  ["4"] = { "   # ", "  ## ", " # # ", "#  # ", "#####", "   # ", "   # " },
  ["5"] = { "#####", "#    ", "#### ", "    #", "    #", "#   #", " ### " },
  ["6"] = { " ### ", "#    ", "#    ", "#### ", "#   #", "#   #", " ### " },
  ["7"] = { "#####", "    #", "   # ", "   # ", "  #  ", "  #  ", "  #  " },
  ["8"] = { " ### ", "#   #", "#   #", " ### ", "#   #", "#   #", " ### " },
  ["9"] = { " ### ", "#   #", "#   #", " ####", "    #", "    #", " ### " },
  ["."] = { "     ", "     ", "     ", "     ", "     ", " ##  ", " ##  " },
  ["-"] = { "     ", "     ", "     ", "#####", "     ", "     ", "     " },
  ["+"] = { "     ", "  #  ", "  #  ", "#####", "  #  ", "  #  ", "     " },
  ["m"] = { "     ", "     ", "## # ", "# # #", "# # #", "# # #", "# # #" },
  ["s"] = { "     ", "     ", " ####", "#    ", " ### ", "    #", "#### " },
  ["e"] = { "     ", "     ", " ### ", "#   #", "#####", "#    ", " ### " },
  ["w"] = { "     ", "     ", "#   #", "#   #", "# # #", "# # #", " # # " },
  ["i"] = { "  #  ", "     ", " ##  ", "  #  ", "  #  ", "  #  ", " ### " },
  ["n"] = { "     ", "     ", "# ## ", "##  #", "#   #", "#   #", "#   #" },
  ["d"] = { "    #", "    #", " ## #", "#  ##", "#   #", "#  ##", " ## #" },
  ["c"] = { "     ", "     ", " ### ", "#    ", "#    ", "#   #", " ### " },
  ["u"] = { "     ", "     ", "#   #", "#   #", "#   #", "#  ##", " ## #" },
  ["r"] = { "     ", "     ", "# ## ", "##  #", "#    ", "#    ", "#    " },
  ["t"] = { " #   ", " #   ", "###  ", " #   ", " #   ", " #  #", "  ## " },
  ["/"] = { "    #", "    #", "   # ", "  #  ", " #   ", "#    ", "#    " },
  [" "] = { "     ", "     ", "     ", "     ", "     ", "     ", "     " },
}

--- Calls `dot(column, row)` for each dot of a text, columns and rows from 0; a letter takes six
--- columns.
---@param text string
---@param dot fun(column: integer, row: integer)
function letters.draw(text, dot)
  for k = 1, #text do
    local rows = ROWS[text:sub(k, k)]
    if not rows then error(("no letter for %q"):format(text:sub(k, k)), 2) end
    for row, line in ipairs(rows) do
      for column = 1, letters.WIDTH do
        if line:sub(column, column) == "#" then
          dot((k - 1) * (letters.WIDTH + 1) + column - 1, row - 1)
        end
      end
    end
  end
end

--- Columns that a text takes.
---@param text string
---@return integer
function letters.columns(text) return #text * (letters.WIDTH + 1) - 1 end

return letters
