--- figures.lua: figures of the sections: colours for integrators, dashes and markers for
--- precisions, and a name at the end of every curve.

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

local function curve_of(row)
  local look = LOOKS[row.precision]
  return { name = ("%s, %s"):format(SHORT[row.integrator], row.precision), points = {},
    failures = {}, color = COLORS[row.integrator], dash = look.dash, marker = look.marker,
    width = look.width, key = row.integrator .. row.precision }
end

-- The curve of a key, new at its first use.
local function curve_in(curves, key, make)
  if not curves[key] then
    curves[key] = make()
    curves[#curves + 1] = curves[key]
  end
  return curves[key]
end

-- Adds the wall time that failed runs would have taken: that of the method's longest successful
-- step, scaled by the number of steps.
local function add_failures(rows, curve)
  local done
  for _, row in ipairs(rows) do done = done or row.seconds_per_second and row end
  for _, row in ipairs(done and rows or {}) do
    if row.status ~= "done" and row.time_step then
      curve.failures[#curve.failures + 1] = done.seconds_per_second * done.time_step
        / row.time_step
    end
  end
end

local function scene_panel(rows, scene)
  local panel = { title = subjects.TITLES[scene], curves = {}, points = {},
    x = { label = "wall time per simulated second, s" },
    y = { label = "error of the masses' places, m" } }
  local refused = {}
  for _, row in ipairs(rows) do
    if row.scene == scene then
      panel.floor = { y = row.reference_error, text = "the reference's own error" }
      panel.note = "reference: " .. row.reference
      if row.tier then
        if row.error then
          panel.points[#panel.points + 1] = { x = row.seconds_per_second, y = row.error,
            name = row.tier, color = TIER_COLOR }
        end
      elseif row.status == "refused" then
        refused[row.integrator] = row.reason
      else
        local curve = curve_in(panel.curves, row.integrator .. row.precision,
          function() return curve_of(row) end)
        curve.rows = curve.rows or {}
        table.insert(curve.rows, row)
        if row.error and row.error > 0 then
          table.insert(curve.points, { row.seconds_per_second, row.error })
        end
      end
    end
  end
  for _, curve in ipairs(panel.curves) do add_failures(curve.rows, curve) end
  -- errors below the reference's own are drawn on the axis
  panel.y.low = panel.floor.y / 2
  for _, integrator in ipairs(trial.INTEGRATORS) do
    local why = refused[integrator]
    if why then
      -- the first part of a refusal is its reason
      panel.note = ("%s; %s: %s"):format(panel.note, trial.LABELS[integrator],
        why:gsub("^integrator: ", ""):match "^[^;]*")
    end
  end
  return panel
end

-- Every function takes a section's result and returns a limax.chart.figure.

--- Error against wall time, a panel for each scene.
function figures.work_precision(result)
  local panels, seen = {}, {}
  for _, row in ipairs(result.rows) do
    if not seen[row.scene] then
      seen[row.scene] = true
      panels[#panels + 1] = scene_panel(result.rows, row.scene)
    end
  end
  return { name = "work_precision", title = "What accuracy costs", panels = panels,
    subtitle = ("Root mean square error of the masses' places at the end, against the wall time of"
      .. " %s; shorter steps to the right. Rings: the tiers."):format(result.where) }
end

-- ---- ranking ------------------------------------------------------------------------------------

-- Curves over the price: leapfrog and symplectic Euler by precision.
local function ranked_curves(rows, value_of)
  local curves = {}
  for _, row in ipairs(rows) do
    local value = value_of(row)
    if value and row.seconds_per_second and row.integrator and not row.tier
      and row.setting ~= "finest" and row.setting ~= "chaos floor" then
      local curve = curve_in(curves, row.integrator .. row.precision,
        function() return curve_of(row) end)
      table.insert(curve.points, { row.seconds_per_second, value })
      if row.failed > 0 then table.insert(curve.failures, row.seconds_per_second) end
    end
  end
  for _, curve in ipairs(curves) do
    table.sort(curve.points, function(a, b) return a[1] < b[1] end)
  end
  return curves
end

-- A panel for each case and population; `look` makes the axes.
local function ranked_panels(result, value_of, look)
  local panels, groups = {}, {}
  for _, row in ipairs(result.rows) do
    local key = row.case .. row.population
    if row.status ~= "refused" and not groups[key] then
      groups[key] = { title = ("%s, %s bodies"):format(row.case, row.population) }
      groups[#groups + 1] = groups[key]
    end
    if row.status ~= "refused" then table.insert(groups[key], row) end
  end
  for k, group in ipairs(groups) do
    local panel = { title = group.title, points = {}, curves = ranked_curves(group, value_of),
      x = { label = "wall time of a robot and simulated second, s" } }
    for _, row in ipairs(group) do
      local value = value_of(row)
      if row.tier and value and row.seconds_per_second then
        panel.points[#panel.points + 1] = { x = row.seconds_per_second, y = value, name = row.tier,
          color = TIER_COLOR }
      end
    end
    look(panel, group)
    panels[k] = panel
  end
  return panels
end

local function floor_of(group)
  for _, row in ipairs(group) do
    if row.setting == "chaos floor" then return row end
  end
end

-- Regrets below this are drawn on the axis.
local LEAST_REGRET = 1e-3

--- What elites chosen by cheap scores lose, against what the scores cost.
function figures.elite_regret(result)
  local function value_of(row)
    return row.elite_regret and math.max(row.elite_regret, LEAST_REGRET)
  end
  local panels = ranked_panels(result, value_of, function(panel, group)
    panel.y = { label = "elite regret", low = LEAST_REGRET, high = 1,
      text = function(value)
        return ("%s%g %%"):format(value <= LEAST_REGRET and "≤ " or "", 100 * value)
      end }
    panel.limits = { { y = 0.05, text = "5 %: what a choice may lose", color = "#b3261e" } }
    local floor = floor_of(group)
    if floor and floor.elite_regret then
      panel.floor = { y = math.max(floor.elite_regret, LEAST_REGRET), text = "chaos floor" }
    end
  end)
  return { name = "elite_regret", title = "What a cheap setting costs a researcher",
    panels = panels,
    subtitle = "Share of the finest setting's fitness that is lost by breeding from the best 30 %"
      .. " of the cheap one. Rings: the tiers." }
end

--- Kendall's tau of the robots' order, against what the scores cost.
function figures.kendall_tau(result)
  local panels = ranked_panels(result, function(row) return row.tau end, function(panel, group)
    panel.y = { label = "Kendall's tau", linear = true, high = 1.01 }
    local floor = floor_of(group)
    if floor and floor.tau then
      panel.limits = { { y = floor.tau, text = ("chaos floor: %.3f"):format(floor.tau) } }
    end
  end)
  return { name = "kendall_tau", title = "How far a cheap setting keeps the order", panels = panels,
    subtitle = "Kendall's tau of the fitness against the finest setting's; 1 is the same order."
      .. " Rings: the tiers." }
end

-- ---- rounding -----------------------------------------------------------------------------------

-- Rings of different sizes at one point: if all are visible, the start makes no difference.
local START_LOOKS = { [10] = { marker = "wide ring", color = "#8a5a9e" },
  [1000] = { marker = "wider ring", color = "#b58a1b" } }

local function sweep_panel(rows)
  local panel = { title = "at the origin, 10 m and 1 km away", curves = {},
    x = { label = "time step, s" }, y = { label = "error of the masses' places, m" } }
  for _, row in ipairs(rows) do
    if row.same_bits == nil and row.way == 0 and row.duration == rows[1].duration
      and row.error and row.error > row.reference_error then
      local curve = curve_in(panel.curves, row.integrator .. row.precision .. row.start, function()
        local curve, look = curve_of(row), START_LOOKS[row.start]
        if look then
          curve.marker, curve.color, curve.dash, curve.name = look.marker, look.color, "none", nil
        end
        return curve
      end)
      table.insert(curve.points, { row.time_step, row.error })
    end
  end
  panel.x.reversed = true
  panel.floor = { y = rows[1].reference_error, text = "the reference's own error" }
  panel.key = { { marker = "wide ring", color = START_LOOKS[10].color, text = "started at 10 m" },
    { marker = "wider ring", color = START_LOOKS[1000].color, text = "started at 1 km" } }
  return panel
end

local function moving_panel(rows)
  local panel = { curves = {}, x = { label = "time step, s", reversed = true },
    y = { label = "error of the masses' places, m" } }
  for _, row in ipairs(rows) do
    if row.duration ~= rows[1].duration and row.error then
      if row.way > 0 then
        panel.title = ("over a distance of %g m at 1 m/s, %d bodies"):format(row.way, row.bodies)
      end
      local curve = curve_in(panel.curves, row.precision .. row.way, function()
        local curve = curve_of(row)
        curve.name = ("%s, %s"):format(row.precision, row.way > 0 and "moving" or "at rest")
        curve.color = row.way > 0 and "#8a5a9e" or COLORS.leapfrog
        return curve
      end)
      table.insert(curve.points, { row.time_step, row.error })
      panel.floor = { y = row.reference_error, text = "the reference's own error" }
    end
  end
  return panel
end

--- The rounding floor of fp32: error against step, by place and precision.
function figures.rounding(result)
  local same = {}
  for _, row in ipairs(result.rows) do
    if row.same_bits ~= nil then
      same[#same + 1] = ("%s %s"):format(row.precision,
        row.same_bits and "the same bits" or "OTHER bits")
    end
  end
  return { name = "rounding", title = "What rounding costs",
    panels = { sweep_panel(result.rows), moving_panel(result.rows) },
    subtitle = "Error against the time step, shorter steps to the right. Started 1024 m away: "
      .. table.concat(same, ", ") .. "." }
end

-- ---- conservation -------------------------------------------------------------------------------

local function drift_panel(rows, scene, field, title)
  local panel = { title = title, curves = {}, right = 110,
    x = { label = "precision", linear = true, low = 0.5, high = 4.5,
      text = function(value) return trial.PRECISIONS[value] end },
    y = { label = "relative drift" } }
  for _, row in ipairs(rows) do
    local value = row.scene == scene and row[field]
    if value then
      local curve = curve_in(panel.curves, row.integrator, function()
        return { name = SHORT[row.integrator], points = {}, color = COLORS[row.integrator],
          marker = "dot" }
      end)
      for place, precision in ipairs(trial.PRECISIONS) do
        if precision == row.precision and value ~= 0 then
          table.insert(curve.points, { place, math.abs(value) })
        end
      end
      panel.note = ("%g steps of %g s"):format(row.steps, row.time_step)
    end
  end
  return panel
end

--- What is lost of energy and angular momentum where nothing should be.
function figures.conservation(result)
  return { name = "conservation", title = "What is kept", columns = 3, width = 420, height = 330,
    panels = {
      drift_panel(result.rows, "vibration", "energy_drift", "energy, vibrating"),
      drift_panel(result.rows, "spin", "energy_drift", "energy, spinning freely"),
      drift_panel(result.rows, "spin", "momentum_drift", "angular momentum, spinning"),
    },
    subtitle = "Size of the relative change in a body without damping and muscles; energies are"
      .. " means over the first and the last 20 000 steps." }
end

-- ---- evolutions ---------------------------------------------------------------------------------

--- The final best of each evolution at the finest setting, against the time that it took.
function figures.evolutions(result)
  local hues = { paper = "#c8501e", preview = "#8a5a9e", evolve = "#1a6fae", publish = "#0f8a66" }
  local curves = {}
  for _, row in ipairs(result.rows) do
    local curve = curve_in(curves, row.setting, function()
      return { name = row.setting, points = {}, dash = "none", marker = "dot",
        color = hues[row.setting] }
    end)
    if row.best_at_finest then
      table.insert(curve.points, { row.seconds, row.best_at_finest })
    end
  end
  return { name = "evolutions", title = "Where whole evolutions end", columns = 1, width = 760,
    panels = { { title = result.rows[1].case, curves = curves,
      x = { label = "wall time of all simulations, s" },
      y = { label = "final best at the finest setting, m", linear = true, low = 0 } } },
    subtitle = "The last best of each seed, scored again at the finest setting, by what it was"
      .. " evolved under." }
end

return figures
