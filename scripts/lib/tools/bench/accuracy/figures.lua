--- figures.lua: figures of the sections: colours for integrators, dashes and markers for
--- precisions, and a name at the end of every curve. Every public function takes a section's result
--- and returns a limax.chart.figure.

local subjects = require "limax.tools.bench.accuracy.subjects"
local trial = require "limax.tools.bench.accuracy.trial"

local figures = {}

-- Colours for readers with red-green colour blindness (after Okabe and Ito).
local COLORS = { symplectic_euler = "#c8501e", leapfrog = "#1a6fae", rk4 = "#0f8a66",
  xpbd = "#8a5a9e" }
local SHORT = { symplectic_euler = "Euler", leapfrog = "leapfrog", rk4 = "RK4", xpbd = "XPBD" }
local LOOKS = {
  single = { dash = { 2, 3 }, marker = "ring" },
  compensated = { marker = "dot", width = 2.2 },
  mixed = { dash = { 7, 3 }, marker = "diamond" },
  double = { marker = "square", width = 1.1 },
}
local TIER_COLOR = "#3d3a5c"
local ERROR_LABEL = "error of the positions of the masses, m"

local function method_of(row) return row.integrator .. row.precision end

local function method_look(row)
  local look = LOOKS[row.precision]
  return { name = ("%s, %s"):format(SHORT[row.integrator], row.precision), dash = look.dash,
    color = COLORS[row.integrator], marker = look.marker, width = look.width }
end

-- Curves in the order of their first rows. `place(row)` returns the key of the row's curve, nil
-- where the row is not drawn, and its point if it has one; `look(row)` describes a new curve.
local function curves_of(rows, place, look)
  local curves, by_key = {}, {}
  for _, row in ipairs(rows) do
    local key, x, y = place(row)
    if key and not by_key[key] then
      local curve = look(row)
      curve.points, curve.failures, curve.rows = {}, {}, {}
      by_key[key], curves[#curves + 1] = curve, curve
    end
    if key then table.insert(by_key[key].rows, row) end
    if x and y then table.insert(by_key[key].points, { x, y }) end
  end
  return curves
end

-- Rows grouped by a key, in the order of the first rows.
local function grouped(rows, key_of)
  local groups, by_key = {}, {}
  for _, row in ipairs(rows) do
    local key = key_of(row)
    if key and not by_key[key] then
      by_key[key] = {}
      groups[#groups + 1] = by_key[key]
    end
    if key then table.insert(by_key[key], row) end
  end
  return groups
end

-- `along`: the column of the horizontal axis.
local function tier_points(rows, value_of, along)
  local points = {}
  for _, row in ipairs(rows) do
    local value = value_of(row)
    if row.tier and value and row[along] then
      points[#points + 1] = { x = row[along], y = value, name = row.tier,
        color = TIER_COLOR }
    end
  end
  return points
end

-- ---- work and precision -------------------------------------------------------------------------

-- Adds the wall time that failed runs would have taken: that of the method's longest successful
-- step, scaled by the number of steps.
local function add_failures(curve)
  local done
  for _, row in ipairs(curve.rows) do done = done or row.seconds_per_second and row end
  for _, row in ipairs(done and curve.rows or {}) do
    if row.status ~= "done" then
      table.insert(curve.failures, done.seconds_per_second * done.time_step / row.time_step)
    end
  end
end

local function scene_panel(rows)
  local first, refused = rows[1], {}
  local curves = curves_of(rows, function(row)
    if row.tier or row.status == "refused" then return nil end
    return method_of(row), row.seconds_per_second, row.error and row.error > 0 and row.error
  end, method_look)
  for _, curve in ipairs(curves) do add_failures(curve) end
  local note = "reference: " .. first.reference
  for _, row in ipairs(rows) do
    if row.status == "refused" and not row.tier and not refused[row.integrator] then
      refused[row.integrator] = true
      -- the first part of a refusal is its reason
      note = ("%s; %s: %s"):format(note, trial.LABELS[row.integrator],
        row.reason:gsub("^integrator: ", ""):match "^[^;]*")
    end
  end
  return { title = subjects.TITLES[first.scene], curves = curves, note = note,
    points = tier_points(rows, function(row) return row.error end, "seconds_per_second"),
    floor = { y = first.reference_error, text = "the reference's own error" },
    x = { label = "wall time per simulated second, s" },
    -- errors below the reference's own are drawn on the axis
    y = { label = ERROR_LABEL, low = first.reference_error / 2 } }
end

--- Error against wall time, a panel for each scene.
function figures.work_precision(result)
  local panels = grouped(result.rows, function(row) return row.scene end)
  for k, rows in ipairs(panels) do panels[k] = scene_panel(rows) end
  return { name = "work_precision", title = "What accuracy costs", panels = panels,
    subtitle = ("Root mean square error of the masses' positions at the end, against the wall time"
      .. " of %s; shorter steps to the right. Rings: the tiers."):format(result.where) }
end

-- ---- ranking ------------------------------------------------------------------------------------

local LABELS = { seconds_per_second = "wall time of a robot and simulated second, s",
  time_step = "time step, s; of a tier the longest of the bodies" }

-- A panel for each case and population, along wall time or another column; `add_axes(panel, chaos
-- floor)` completes it.
local function ranked_panels(result, value_of, add_axes, along)
  along = along or "seconds_per_second"
  local panels = grouped(result.rows, function(row)
    return row.status ~= "refused" and row.case .. row.population
  end)
  for k, rows in ipairs(panels) do
    local floor = {}
    local curves = curves_of(rows, function(row)
      if row.setting == "chaos floor" then floor = row end
      local value = value_of(row)
      if value and row[along] and row.integrator and not row.tier
        and row.setting ~= "finest" and row.setting ~= "chaos floor" then
        return method_of(row), row[along], value
      end
    end, method_look)
    for _, curve in ipairs(curves) do
      table.sort(curve.points, function(a, b) return a[1] < b[1] end)
      for _, row in ipairs(curve.rows) do
        if row.failed > 0 then table.insert(curve.failures, row[along]) end
      end
    end
    panels[k] = { title = ("%s, %s bodies"):format(rows[1].case, rows[1].population),
      points = tier_points(rows, value_of, along), curves = curves,
      x = { label = LABELS[along] } }
    add_axes(panels[k], floor)
  end
  return panels
end

-- Regrets below this are drawn on the axis.
local LEAST_REGRET = 1e-3

--- What elites chosen by cheap scores lose, against what the scores cost.
function figures.elite_regret(result)
  local function value_of(row)
    return row.elite_regret and math.max(row.elite_regret, LEAST_REGRET)
  end
  local panels = ranked_panels(result, value_of, function(panel, floor)
    panel.y = { label = "elite regret", low = LEAST_REGRET, high = 1,
      text = function(value)
        return ("%s%g %%"):format(value <= LEAST_REGRET and "≤ " or "", 100 * value)
      end }
    panel.limits = { { y = 0.05, text = "5 %: the most that tuning accepts", color = "#b3261e" } }
    panel.floor = value_of(floor) and { y = value_of(floor), text = "chaos floor" }
  end)
  return { name = "elite_regret", title = "Fitness lost by a cheap setting",
    panels = panels,
    subtitle = "Share of the finest setting's fitness that is lost by breeding from the best 30 %"
      .. " of the cheap one. Rings: the tiers." }
end

--- Kendall's tau of the robots' order, against what the scores cost.
function figures.kendall_tau(result)
  local panels = ranked_panels(result, function(row) return row.tau end, function(panel, floor)
    panel.y = { label = "Kendall's tau", linear = true, high = 1.01 }
    panel.limits = floor.tau
      and { { y = floor.tau, text = ("chaos floor: %.3f"):format(floor.tau) } }
  end)
  return { name = "kendall_tau", title = "Order of robots under a cheap setting", panels = panels,
    subtitle = "Kendall's tau of the fitness against the finest setting's; 1 is the same order."
      .. " Rings: the tiers." }
end

--- The mean error of the distance that the robots travel, against the time step.
function figures.distance_error(result)
  local function value_of(row) return row.distance_error end
  local panels = ranked_panels(result, value_of, function(panel, floor)
    panel.y = { label = "mean error of the distance, m" }
    panel.floor = floor.distance_error and { y = floor.distance_error, text = "chaos floor" }
  end, "time_step")
  return { name = "distance_error", title = "Error of a walk against its time step",
    panels = panels, subtitle = "Mean difference of the robots' distances from those under the"
      .. " finest setting. Rings: the tiers." }
end

-- ---- evolutions ---------------------------------------------------------------------------------

--- The final best of each evolution at the finest setting, against the time that it took.
function figures.evolutions(result)
  local hues = { paper = "#c8501e", preview = "#8a5a9e", evolve = "#1a6fae", publish = "#0f8a66" }
  local curves = curves_of(result.rows,
    function(row) return row.setting, row.seconds, row.best_at_finest end,
    function(row)
      return { name = row.setting, dash = "none", marker = "dot", color = hues[row.setting] }
    end)
  return { name = "evolutions", title = "Final fitness of whole evolutions", columns = 1,
    width = 760,
    panels = { { title = result.rows[1].case, curves = curves,
      x = { label = "wall time of all simulations, s" },
      y = { label = "final best at the finest setting, m", linear = true, low = 0 } } },
    subtitle = "The last best of each seed, scored again at the finest setting, by what it was"
      .. " evolved under." }
end

return figures
