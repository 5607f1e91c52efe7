--- palette.lua: the colours of materials and of the lines of charts, the same in terminals and in
--- figures. Hues differ for readers who do not see red and green (after Okabe and Ito); the first
--- of each kind of material differ in grey too.

local palette = {}

---@class limax.color
---@field hex string "#rrggbb"
---@field terminal integer of a terminal's 256

-- Muscles are warm when they expand and cool when they contract; passive tissue by its place in the
-- table.
local of_kind = {
  empty = { { hex = "#ffffff", terminal = 240 } },
  expanding = { { hex = "#e8743a", terminal = 208 }, { hex = "#c9408a", terminal = 205 } },
  contracting = { { hex = "#22669f", terminal = 39 }, { hex = "#6a5acd", terminal = 105 } },
  passive = { { hex = "#9fd3b2", terminal = 114 }, { hex = "#e6e0d0", terminal = 187 },
    { hex = "#e8c15a", terminal = 221 }, { hex = "#a9a9b8", terminal = 146 } },
}

--- The colour of each material of a table, by letter.
---@param list { kind: string, letter: string, name: string }[] in the table's order
function palette.of(list)
  local colors, used = {}, {}
  for _, material in ipairs(list) do
    local row = of_kind[material.kind] or of_kind.passive
    local k = (used[material.kind] or 0) % #row + 1
    used[material.kind] = k
    colors[material.letter] = row[k]
  end
  return colors
end

local function hex_of(parts)
  local texts = {}
  for k, value in ipairs(parts) do
    texts[k] = ("%02x"):format(math.floor(math.min(math.max(value, 0), 255) + 0.5))
  end
  return "#" .. table.concat(texts)
end

--- A colour darkened (share below 1) or lightened (above 1, towards white).
---@return string hex
function palette.shade(hex, share)
  local parts = {}
  for k = 0, 2 do
    local value = tonumber(hex:sub(2 + 2 * k, 3 + 2 * k), 16)
    parts[k + 1] = share <= 1 and value * share or value + (255 - value) * (share - 1)
  end
  return hex_of(parts)
end

-- Okabe and Ito's colours, except yellow, in an order whose greys differ; then the same with other
-- dashes.
local LINES = { "#0072b2", "#d55e00", "#009e73", "#26282b", "#cc79a7", "#e69f00", "#56b4e9" }
local DASHES = { false, { 6, 3 }, { 2, 3 } }

--- Colour and dash of the k-th of several lines of a chart.
function palette.line(k)
  return LINES[(k - 1) % #LINES + 1],
    DASHES[(math.floor((k - 1) / #LINES) + k - 1) % #DASHES + 1] or nil
end

-- Viridis, whose greys ascend, at equal distances.
local SCALE = { { 68, 1, 84 }, { 59, 82, 139 }, { 33, 145, 140 }, { 94, 201, 98 },
  { 253, 231, 37 } }

--- The colour of a value between the least (0) and the most (1).
---@return string hex
function palette.scale(share)
  local at = math.min(math.max(share, 0), 1) * (#SCALE - 1)
  local k = math.min(math.floor(at), #SCALE - 2)
  local parts = {}
  for c = 1, 3 do
    local from, to = SCALE[k + 1][c], SCALE[k + 2][c]
    parts[c] = from + (to - from) * (at - k)
  end
  return hex_of(parts)
end

return palette
