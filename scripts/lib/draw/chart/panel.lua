--- panel.lua: one pair of axes with curves, each named where it ends, bands around curves, limits,
--- single points with a name, and failures in a strip of their own above the axes. Pixels of 1/96
--- inch.

local axis = require "limax.draw.chart.axis"

local panel = {}

local ink = { text = "#26282b", faint = "#6b7076", grid = "#e4e6e9", fine = "#f1f2f4",
  frame = "#9aa0a6", strip = "#fbeeea", fail = "#b3261e", band = "#8c9198" }

-- px around the axes; the right margin holds the names of the curves
local LEFT, RIGHT, TOP, BOTTOM, STRIP, LINE = 62, 158, 34, 44, 20, 13.5
-- px, about the width of a letter
local LETTER = 6.4
-- more markers than these on one curve are drawn at half the size
local MANY = 200

---@class limax.chart.curve
---@field name string|nil stands at the curve's last point
---@field points number[][] { x, y }
---@field color string
---@field dash string|nil of the line, as SVG has it
---@field width number|nil px
---@field marker "dot"|"ring"|"square"|"diamond"|"wide ring"|"wider ring"|"none"|nil
---@field failures number[]|nil x of what failed

---@class limax.chart.band
---@field points number[][] { x, low, high }
---@field color string
---@field opacity number|nil 0.16
---@field name string|nil for tables of the numbers

---@class limax.chart.panel
---@field title string
---@field x table see axis.new
---@field y table
---@field curves limax.chart.curve[]
---@field bands limax.chart.band[]|nil behind the curves
---@field floor { y: number, text: string }|nil what lies below means nothing
---@field limits { y: number|nil, x: number|nil, text: string, color: string|nil }[]|nil
---@field points { x: number, y: number, name: string, color: string|nil }[]|nil
---@field note string|nil a line below the title
---@field key { marker: string, color: string, text: string }[]|nil markers that no curve names
---@field right number|nil px, the room for the names of the curves
---@field left number|nil px, the room for the ticks and the label of y
---@field title_size number|nil px

-- All values that an axis has to hold.
local function values_of(given, k, with)
  local values = {}
  for _, curve in ipairs(given.curves) do
    for _, point in ipairs(curve.points) do values[#values + 1] = point[k] end
    if k == 1 then
      for _, x in ipairs(curve.failures or {}) do values[#values + 1] = x end
    end
  end
  for _, point in ipairs(given.points or {}) do
    values[#values + 1] = k == 1 and point.x or point.y
  end
  for _, band in ipairs(given.bands or {}) do
    for _, point in ipairs(band.points) do
      values[#values + 1] = point[k]
      if k == 2 then values[#values + 1] = point[3] end
    end
  end
  for _, value in ipairs(with) do values[#values + 1] = value end
  return values
end

-- What lies between the lows and the highs of a band.
local function draw_band(out, box, x, y, band)
  local outline, count = {}, #band.points
  if count < 2 then return end
  for k, point in ipairs(band.points) do
    local across = box.left + x.place(point[1]) * box.width
    outline[k] = { across, box.bottom - y.place(point[3]) * box.height }
    outline[2 * count + 1 - k] = { across, box.bottom - y.place(point[2]) * box.height }
  end
  out:polygon(outline, ('fill="%s" fill-opacity="%.2f"'):format(band.color, band.opacity or 0.16))
end

local function draw_axes(out, box, x, y)
  for _, tick in ipairs(y.ticks) do
    local at = box.bottom - tick.at * box.height
    out:line({ box.left, at }, { box.right, at }, tick.text and ink.grid or ink.fine, 1)
    if tick.text then
      out:text(box.left - 7, at + 4, tick.text, ('text-anchor="end" fill="%s"'):format(ink.faint))
    end
  end
  for _, tick in ipairs(x.ticks) do
    local at = box.left + tick.at * box.width
    out:line({ at, box.top }, { at, box.bottom }, tick.text and ink.grid or ink.fine, 1)
    out:line({ at, box.bottom }, { at, box.bottom + (tick.text and 5 or 3) }, ink.frame, 1)
    if tick.text then
      out:text(at, box.bottom + 17, tick.text,
        ('text-anchor="middle" fill="%s"'):format(ink.faint))
    end
  end
  out:line({ box.left, box.bottom }, { box.right, box.bottom }, ink.frame, 1)
  out:line({ box.left, box.top }, { box.left, box.bottom }, ink.frame, 1)
  out:text((box.left + box.right) / 2, box.bottom + 35, x.label, 'text-anchor="middle"')
  -- a label that is longer than the axis has its unit in a line of its own
  local lines = { y.label }
  if #y.label * LETTER > box.height + TOP then
    lines = { y.label:match "^(.-) (%(.*%))$" }
    lines[1] = lines[1] or y.label
  end
  for k, line in ipairs(lines) do
    out:text(0, 0, line, ('text-anchor="middle" transform="translate(%.1f %.1f) rotate(-90)"')
      :format(box.left - box.room + (#lines == 1 and 15 or -1 + 12 * k),
      (box.top + box.bottom) / 2))
  end
end

-- px: rings around a marker, so that several series show at one place
local AROUND = { ["wide ring"] = 5.5, ["wider ring"] = 8 }

local function draw_marker(out, at, kind, color, size)
  if kind == "none" then return end
  if AROUND[kind] then
    out:add('<circle cx="%.1f" cy="%.1f" r="%.1f" fill="none" stroke="%s" stroke-width="1.2"/>',
      at[1], at[2], AROUND[kind], color)
  elseif kind == "ring" then
    out:add('<circle cx="%.1f" cy="%.1f" r="%.2g" fill="#ffffff" stroke="%s" stroke-width="1.4"/>',
      at[1], at[2], size, color)
  elseif kind == "square" then
    out:add('<rect x="%.1f" y="%.1f" width="%.2g" height="%.2g" fill="%s" stroke="#ffffff"'
      .. ' stroke-width="0.8"/>', at[1] - size, at[2] - size, 2 * size, 2 * size, color)
  elseif kind == "diamond" then
    local r = size * 1.35
    out:polygon({ { at[1], at[2] - r }, { at[1] + r, at[2] }, { at[1], at[2] + r },
      { at[1] - r, at[2] } }, ('fill="%s" stroke="#ffffff" stroke-width="0.8"'):format(color))
  else
    out:dot(at, size, color)
  end
end

--- A marker alone, for a key.
---@param out limax.svg
---@param at number[] { x, y }
---@param kind string
---@param color string
function panel.marker(out, at, kind, color) draw_marker(out, at, kind, color, 3) end

-- Heights of labels that would stand at `wanted`, moved as little as keeps them apart and inside.
local function spread(labels, low, high)
  table.sort(labels, function(a, b) return a.wanted < b.wanted end)
  local gap = math.min(LINE, (high - low) / math.max(#labels - 1, 1))
  for k, label in ipairs(labels) do
    label.y = math.max(label.wanted, k > 1 and labels[k - 1].y + gap or low)
  end
  local most = high
  for k = #labels, 1, -1 do
    labels[k].y = math.min(labels[k].y, most)
    most = labels[k].y - gap
  end
end

local function draw_names(out, box, labels)
  spread(labels, box.top + 4, box.bottom)
  for _, label in ipairs(labels) do
    out:add('<path d="M %.1f %.1f L %.1f %.1f L %.1f %.1f" fill="none" stroke="%s"'
      .. ' stroke-width="0.8" stroke-opacity="0.55"/>', label.from[1] + 4, label.from[2],
      box.right + 2, label.y, box.right + 8, label.y, label.color)
    out:text(box.right + 11, label.y + 4, label.name, ('fill="%s"'):format(label.color))
  end
end

-- What failed: crosses in a strip above the axes, so that no failure is lost and none has an error.
local function draw_failures(out, box, x, curves)
  local any = false
  for _, curve in ipairs(curves) do any = any or #(curve.failures or {}) > 0 end
  if not any then return end
  local top = box.top - STRIP
  out:add('<rect x="%.1f" y="%.1f" width="%.1f" height="%d" fill="%s"/>', box.left, top, box.width,
    STRIP - 3, ink.strip)
  out:text(box.right + 11, top + 13, "failed", ('fill="%s"'):format(ink.fail))
  for _, curve in ipairs(curves) do
    for _, value in ipairs(curve.failures or {}) do
      local cx, cy, r = box.left + x.place(value) * box.width, top + (STRIP - 3) / 2, 3.6
      for _, sign in ipairs { -1, 1 } do
        out:line({ cx - r, cy - sign * r }, { cx + r, cy + sign * r }, curve.color, 1.8)
      end
    end
  end
end

-- The room of a line of small text at the left edge, which no name may cross.
local function small_text(box, y, text)
  return { left = box.left + 6, right = box.left + 6 + 6 * #text, y = y }
end

local function draw_floor(out, box, y, floor, taken)
  local at = box.bottom - y.place(floor.y) * box.height
  out:add('<rect x="%.1f" y="%.1f" width="%.1f" height="%.1f" fill="%s" fill-opacity="0.13"/>',
    box.left, at, box.width, box.bottom - at, ink.band)
  out:line({ box.left, at }, { box.right, at }, ink.band, 1)
  -- within the band where it is high enough, else just above it
  local inside = box.bottom - at > 16
  out:text(box.left + 6, inside and at + 12 or at - 4, floor.text,
    ('font-size="10" fill="%s"'):format(ink.faint))
  taken[#taken + 1] = small_text(box, inside and at + 12 or at - 4, floor.text)
end

local function draw_limits(out, box, x, y, limits, taken)
  for _, limit in ipairs(limits) do
    local color = limit.color or ink.faint
    local from, to
    if limit.y then
      local at = box.bottom - y.place(limit.y) * box.height
      from, to = { box.left, at }, { box.right, at }
      out:text(box.left + 6, at - 4, limit.text, ('font-size="10" fill="%s"'):format(color))
      taken[#taken + 1] = small_text(box, at - 4, limit.text)
    else
      local at = box.left + x.place(limit.x) * box.width
      from, to = { at, box.top }, { at, box.bottom }
      out:text(at + 4, box.top + 11, limit.text, ('font-size="10" fill="%s"'):format(color))
    end
    out:add('<line x1="%.1f" y1="%.1f" x2="%.1f" y2="%.1f" stroke="%s" stroke-width="1.2"'
      .. ' stroke-dasharray="5 4"/>', from[1], from[2], to[1], to[2], color)
  end
end

-- Where a name may stand beside its ring: right or left of it, above or below, or a line higher.
local SIDES = { { 10, -6 }, { 10, 15 }, { -10, -6 }, { -10, 15 }, { 10, -20 }, { -10, -20 },
  { 10, -34 }, { -10, -34 } }

-- The first side on which a name stays inside and crosses no other name.
local function free_side(box, cx, cy, text, taken)
  -- a bold letter is about 7 px wide
  local wide, best = 7 * #text, nil
  for _, side in ipairs(SIDES) do
    local left = side[1] > 0 and cx + side[1] or cx + side[1] - wide
    local spot = { left = left, right = left + wide, y = cy + side[2], side = side }
    best = best or spot
    local fits = spot.left > box.left and spot.right < box.right and spot.y < box.bottom
    for _, other in ipairs(taken) do
      fits = fits and (spot.right < other.left or spot.left > other.right
        or math.abs(spot.y - other.y) > LINE)
    end
    if fits then
      best = spot
      break
    end
  end
  taken[#taken + 1] = best
  return best
end

-- Single settings, ringed, their names on a white halo so that curves may pass below; names keep
-- out of each other's way and of the room that is taken.
local function draw_points(out, box, x, y, points, taken)
  for _, point in ipairs(points) do
    local cx = box.left + x.place(point.x) * box.width
    local cy = box.bottom - y.place(point.y) * box.height
    local color = point.color or ink.text
    out:add('<circle cx="%.1f" cy="%.1f" r="7" fill="none" stroke="%s" stroke-width="1.8"/>', cx,
      cy, color)
    local spot = free_side(box, cx, cy, point.name, taken)
    local place = ('text-anchor="%s" font-weight="bold"'):format(
      spot.side[1] > 0 and "start" or "end")
    out:text(cx + spot.side[1], spot.y, point.name, place
      .. ' stroke="#ffffff" stroke-width="3.5" stroke-linejoin="round"')
    out:text(cx + spot.side[1], spot.y, point.name, place .. (' fill="%s"'):format(color))
  end
end

--- Draws a panel into a page.
---@param out limax.svg
---@param given limax.chart.panel
---@param left number
---@param top number
---@param width number
---@param height number
---@return { box: table, x: limax.chart.axis, y: limax.chart.axis } where values stand on the page
function panel.draw(out, given, left, top, width, height)
  local fails = 0
  for _, curve in ipairs(given.curves) do fails = fails + #(curve.failures or {}) end
  local head = TOP + (given.note and 14 or 0) + (fails > 0 and STRIP or 0)
  local room = given.left or LEFT
  local box = { left = left + room, room = room, right = left + width - (given.right or RIGHT),
    top = top + head, bottom = top + height - BOTTOM }
  box.width, box.height = box.right - box.left, box.bottom - box.top
  local with_x, with_y = {}, {}
  if given.floor then with_y[1] = given.floor.y end
  for _, limit in ipairs(given.limits or {}) do
    if limit.y then with_y[#with_y + 1] = limit.y else with_x[#with_x + 1] = limit.x end
  end
  local x = axis.new(given.x, values_of(given, 1, with_x))
  local y = axis.new(given.y, values_of(given, 2, with_y))
  out:text(left + 8, top + 17, given.title, ('font-size="%.4g" font-weight="bold"'):format(
    given.title_size or 13.5))
  if given.note then out:text(left + 8, top + 33, given.note, ('fill="%s"'):format(ink.faint)) end
  draw_axes(out, box, x, y)
  for _, band in ipairs(given.bands or {}) do draw_band(out, box, x, y, band) end
  -- room of texts that the names of points must not cross
  local taken = {}
  if given.floor then draw_floor(out, box, y, given.floor, taken) end
  draw_limits(out, box, x, y, given.limits or {}, taken)
  draw_failures(out, box, x, given.curves)
  local labels = {}
  for _, curve in ipairs(given.curves) do
    local path = {}
    for k, point in ipairs(curve.points) do
      path[k] = { box.left + x.place(point[1]) * box.width,
        box.bottom - y.place(point[2]) * box.height }
    end
    local style = ('fill="none" stroke="%s" stroke-width="%.2g"%s stroke-linejoin="round"'):format(
      curve.color, curve.width or 1.7,
      curve.dash and (' stroke-dasharray="%s"'):format(curve.dash) or "")
    if #path > 1 and curve.dash ~= "none" then
      local texts = {}
      for k, at in ipairs(path) do texts[k] = ("%.1f,%.1f"):format(at[1], at[2]) end
      out:add('<polyline points="%s" %s/>', table.concat(texts, " "), style)
    end
    local size = #path > MANY and 1.5 or 3
    for _, at in ipairs(path) do draw_marker(out, at, curve.marker, curve.color, size) end
    if curve.name and #path > 0 then
      labels[#labels + 1] = { name = curve.name, color = curve.color, wanted = path[#path][2],
        from = path[#path] }
    end
  end
  draw_names(out, box, labels)
  for k, entry in ipairs(given.key or {}) do
    local at = { box.left + 16, box.bottom - 34 - LINE * 1.4 * (#given.key - k) }
    draw_marker(out, at, entry.marker, entry.color, 3)
    out:text(at[1] + 14, at[2] + 4, entry.text, ('fill="%s"'):format(entry.color))
  end
  draw_points(out, box, x, y, given.points or {}, taken)
  return { box = box, x = x, y = y }
end

return panel
