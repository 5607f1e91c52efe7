--- parameters.lua: the parameters generation by generation, and who set them: a marker for each
--- proposed field of ledger.jsonl, with a colour and a shape by who proposed it.

local arms = require "limax.tools.report.arms"
local choice = require "limax.base.choice"
local supervise = require "limax.supervise"

local parameters = {}

-- Who may set a field, and how a marker shows it.
local SETTERS = {
  { name = "model", color = "#cc79a7", marker = "diamond" },
  { name = "rules", color = "#0072b2", marker = "square" },
  { name = "replayed", color = "#009e73", marker = "ring" },
  { name = "other", color = "#26282b", marker = "dot" },
  { name = "clamped", color = "#d55e00", marker = "wide ring" },
}

--- The markers in words.
parameters.MARKERS = "Diamond: a model; square: rules; ring: replayed; dot: another supervisor, or"
  .. " the script; wide ring: clamped, rate-limited or rejected."

local BOUND = { clamped = true, ["rate-limited"] = true, rejected = true }

-- Who set a field in a generation: names of SETTERS; none where it was kept.
local function setters_of(config, line, entry)
  if entry.outcome == "kept" or entry.applied == nil then return {} end
  local supervisor, who = config.supervisor, line.source or line.supervisor
  local name = type(supervisor) == "table" and supervisor.name or supervisor
  if arms.REPEATS[name] then
    who = "replayed"
  elseif who ~= "model" and who ~= "rules" then
    who = "other"
  end
  return { who, BOUND[entry.outcome] and "clamped" or nil }
end

-- Reads a field, "mutation_rate" or "materials.NAME.FIELD", in a line of metrics.
local function reader(path)
  local material, field = path:match "^materials%.(.*)%.([^.]*)$"
  if not material then return function(line) return line.parameters[path] end end
  return function(line) return line.materials[material] and line.materials[material][field] end
end

--- Fields that change in any run of an arm: the parameters first, then materials by name.
function parameters.changed(arm)
  local names, of_materials, changed = { unpack(supervise.parameters) }, {}, {}
  for _, run in ipairs(arm.runs) do
    for material, fields in pairs(run.lines[1].materials) do
      for field in pairs(fields) do of_materials["materials." .. material .. "." .. field] = 1 end
    end
  end
  for _, path in ipairs(choice.sorted_keys(of_materials)) do names[#names + 1] = path end
  for _, path in ipairs(names) do
    local value_of, changes = reader(path), false
    for _, run in ipairs(arm.runs) do
      for _, line in ipairs(run.lines) do
        if value_of(line) ~= value_of(run.lines[1]) then changes = true end
      end
    end
    if changes then changed[#changed + 1] = path end
  end
  return changed
end

-- The unit of a field as the axis shows it.
local UNITS = { mutation_rate = "per gene", mutation_scale = "1", crossover_rate = "per gene",
  elite_fraction = "of the population", control_mutation_rate = "per gene", stiffness = "N/m",
  amplitude = "of the rest length", phase = "rad" }

--- One field in all repetitions of an arm: thin lines, and a marker where somebody set it.
function parameters.panel(arm, path)
  local field = path:match "[^.]*$"
  local panel = { title = path:gsub("^materials%.", ""), curves = {}, right = 20,
    x = { label = "generation", whole = true },
    y = { label = ("%s (%s)"):format(field, UNITS[field] or "1") } }
  local value_of, by_setter = reader(path), {}
  for _, setter in ipairs(SETTERS) do by_setter[setter.name] = {} end
  for _, run in ipairs(arm.runs) do
    local points, at = {}, {}
    for k, line in ipairs(run.lines) do
      points[k] = { line.generation, value_of(line) }
      at[line.generation] = points[k]
    end
    panel.curves[#panel.curves + 1] = { points = points, color = "#8c9198", width = 1.1,
      marker = "none", title = ("repetition %d"):format(run.repetition) }
    for _, line in ipairs(run.ledger) do
      for _, entry in ipairs(at[line.generation] and line.entries or {}) do
        for _, name in ipairs(entry.field == path and setters_of(run.config, line, entry) or {}) do
          table.insert(by_setter[name], at[line.generation])
        end
      end
    end
  end
  for _, setter in ipairs(SETTERS) do
    if #by_setter[setter.name] > 0 then
      panel.curves[#panel.curves + 1] = { points = by_setter[setter.name], color = setter.color,
        dash = "none", marker = setter.marker, title = "set by: " .. setter.name }
    end
  end
  return panel
end

return parameters
