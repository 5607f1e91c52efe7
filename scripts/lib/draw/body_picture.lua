--- body_picture.lua: bodies as letters in the terminal, coloured by material: layers side by side,
--- the lowest first. Every function returns text.

local palette = require "limax.draw.palette"
local terminal = require "limax.base.terminal"

local body_picture = {}

-- columns between two bodies, and between two layers
local GAP, BETWEEN = 4, 2

---@class limax.body_picture
---@field title string
---@field layers string[][] letters, [z][y], lowest first
---@field materials { kind: string, letter: string, name: string }[]

-- One letter of a body, `cell` columns wide.
local function cell_text(letter, colors, cell, style)
  local text = letter .. (" "):rep(cell - 1)
  if not style.color then return text end
  if letter == "." then return terminal.dim(text, style) end
  local color = colors[letter]
  return color and ("\27[48;5;%d;38;5;16m%s\27[0m"):format(color.terminal, text) or text
end

-- Columns of one layer.
local function layer_width(picture, cell)
  return math.max(#picture.layers[1][1] * cell, #("z=" .. #picture.layers))
end

-- Columns of a body whose layers are all in one row.
local function full_width(picture, cell)
  return math.max(#picture.layers * (layer_width(picture, cell) + BETWEEN) - BETWEEN,
    terminal.width(picture.title))
end

-- The lines of one body: title, numbers of the layers, and the layers side by side in rows that
-- fit.
local function picture_lines(picture, cell, columns, style)
  local layers, colors = picture.layers, palette.of(picture.materials)
  local wide = layer_width(picture, cell)
  local per_row = math.max(1, math.floor((columns + BETWEEN) / (wide + BETWEEN)))
  local lines = { terminal.bold(picture.title, style) }
  for first = 1, #layers, per_row do
    local last = math.min(#layers, first + per_row - 1)
    local head = {}
    for z = first, last do head[#head + 1] = terminal.pad("z=" .. z, wide) end
    lines[#lines + 1] = terminal.dim(table.concat(head, "  "), style)
    for y = 1, #layers[1] do
      local parts = {}
      for z = first, last do
        local row = layers[z][y]:gsub(".", function(letter)
          return cell_text(letter, colors, cell, style)
        end)
        parts[#parts + 1] = terminal.pad(row, wide)
      end
      lines[#lines + 1] = table.concat(parts, "  ")
    end
  end
  return lines
end

--- Bodies as layers of letters, side by side where the width allows, else one below the other.
function body_picture.side_by_side(pictures, style)
  -- two columns per letter look square; one column is enough where room is short
  for cell = 2, 1, -1 do
    local total, blocks, rows = -GAP, {}, 0
    for k, picture in ipairs(pictures) do
      total = total + full_width(picture, cell) + GAP
      blocks[k] = picture_lines(picture, cell, style.width, style)
      rows = math.max(rows, #blocks[k])
    end
    if total <= style.width then
      local lines = {}
      for row = 1, rows do
        local parts = {}
        for k, picture in ipairs(pictures) do
          parts[k] = terminal.pad(blocks[k][row] or "", full_width(picture, cell))
        end
        lines[row] = table.concat(parts, (" "):rep(GAP))
      end
      return table.concat(lines, "\n")
    end
  end
  local texts = {}
  for k, picture in ipairs(pictures) do
    local cell = full_width(picture, 2) <= style.width and 2 or 1
    texts[k] = table.concat(picture_lines(picture, cell, style.width, style), "\n")
  end
  return table.concat(texts, "\n\n")
end

--- Explains the letters: "e expanding muscle   c contracting muscle".
---@param materials { kind: string, letter: string, name: string }[]
function body_picture.legend(materials, style)
  local colors, parts = palette.of(materials), {}
  for _, material in ipairs(materials) do
    if material.kind ~= "empty" then
      parts[#parts + 1] = cell_text(material.letter, colors, 1, style) .. " " .. material.name
    end
  end
  return table.concat(parts, "   ")
end

return body_picture
