--- figures.lua: what the sections measured, as figures: colours for integrators, dashes and markers
--- for precisions, every curve named where it ends.

local methods = require "limax.bench.accuracy.methods"
local subjects = require "limax.bench.accuracy.subjects"

local figures = {}

-- Hues that can be told apart without seeing red and green (after Okabe and Ito).
local COLORS = { symplectic_euler = "#c8501e", leapfrog = "#1a6fae", rk4 = "#0f8a66" }
local SHORT = { symplectic_euler = "Euler", leapfrog = "leapfrog", rk4 = "RK4" }
local LOOKS = {
  single = { dash = "2 3", marker = "ring" },
  compensated = { marker = "dot", width = 2.2 },
  mixed = { dash = "7 3", marker = "diamond" },
  double = { marker = "square", width = 1.1 },
}
local TIER_COLOR = "#3d3a5c"

local function curve_of(row)
  local look = LOOKS[row.precision]
  return { name = ("%s, %s"):format(SHORT[row.integrator], row.precision), points = {},
    failures = {}, color = COLORS[row.integrator], dash = look.dash, marker = look.marker,
    width = look.width, key = row.integrator .. row.precision }
end

-- Wall time that a failed run would have taken: that of the method's longest step that came
-- through, by the number of steps.
local function price_of_failures(rows, curve)
  local known
  for _, row in ipairs(rows) do
    if row.seconds_per_second then
      known = row
      break
    end
  end
  if not known then return end
  for _, row in ipairs(rows) do
    if row.status ~= "done" and row.time_step then
      curve.failures[#curve.failures + 1] = known.seconds_per_second * known.time_step
        / row.time_step
    end
  end
end

local function scene_panel(rows, scene)
  local panel = { title = subjects.TITLES[scene], curves = {}, points = {},
    x = { label = "wall time per simulated second, s" },
    y = { label = "error of the masses' places, m" } }
  local by_curve, absent = {}, {}
  for _, row in ipairs(rows) do
    if row.scene == scene then
      panel.floor = { y = row.reference_error, text = "the reference's own error" }
      panel.note = "reference: " .. row.reference:gsub("_", " ")
      if row.tier then
        if row.error then
          panel.points[#panel.points + 1] = { x = row.seconds_per_second, y = row.error,
            name = row.tier, color = TIER_COLOR }
        end
      elseif row.status == "refused" then
        absent[row.integrator] = row.reason
      else
        local key = row.integrator .. row.precision
        if not by_curve[key] then
          by_curve[key] = { curve = curve_of(row), rows = {} }
          panel.curves[#panel.curves + 1] = by_curve[key].curve
        end
        local entry = by_curve[key]
        entry.rows[#entry.rows + 1] = row
        if row.error and row.error > 0 then
          table.insert(entry.curve.points, { row.seconds_per_second, row.error })
        end
      end
    end
  end
  for _, entry in pairs(by_curve) do price_of_failures(entry.rows, entry.curve) end
  for _, integrator in ipairs(methods.INTEGRATORS) do
    local why = absent[integrator]
    if why then
      panel.note = ("%s; %s: %s"):format(panel.note, methods.LABELS[integrator],
        #why > 24 and "not for scenes with contact" or why)
    end
  end
  return panel
end

--- Error against wall time, a panel for each scene.
---@param result { rows: table[] }
---@return limax.chart.figure
function figures.work_precision(result)
  local panels, seen = {}, {}
  for _, row in ipairs(result.rows) do
    if not seen[row.scene] then
      seen[row.scene] = true
      panels[#panels + 1] = scene_panel(result.rows, row.scene)
    end
  end
  return { name = "work_precision", title = "What accuracy costs", panels = panels,
    subtitle = "Root mean square error of the masses' places at the end, against the wall time of"
      .. " one body on one thread; shorter steps to the right. Rings: the tiers." }
end

return figures
