--- parameters.lua: the parameters generation by generation, and who set them: a marker for each
--- proposed field of ledger.jsonl, with a colour and a shape by who proposed it.

local arms = require "limax.tools.report.arms"
local choice = require "limax.base.choice"
local supervise = require "limax.supervise"

local parameters = {}

--- Who may set a field, in the order of the key.
parameters.SETTERS = {
  { name = "model", color = "#cc79a7", marker = "diamond", text = "model" },
  { name = "rules", color = "#0072b2", marker = "square", text = "rules" },
  { name = "replayed", color = "#009e73", marker = "ring", text = "replayed" },
  { name = "other", color = "#26282b", marker = "dot",
    text = "another supervisor, or the script" },
  { name = "clamped", color = "#d55e00", marker = "wide ring",
    text = "clamped, rate-limited or rejected" },
}

local function supervisor_of(config)
  local supervisor = config.supervisor
  return type(supervisor) == "table" and supervisor.name or supervisor
end

--- Who set this field in this generation: names of SETTERS; none where it was kept.
---@param line table of the ledger
---@return string|nil who
---@return boolean bound its value was limited or rejected
function parameters.setter(config, line, entry)
  local bound = entry.outcome == "clamped" or entry.outcome == "rate-limited"
    or entry.outcome == "rejected"
  if entry.outcome == "kept" or entry.applied == nil then return nil, false end
  if arms.REPEATS[supervisor_of(config)] then return "replayed", bound end
  local who = line.source or line.supervisor
  if who == "model" or who == "rules" then return who, bound end
  return "other", bound
end

--- Reads a field, "mutation_rate" or "materials.NAME.FIELD", in a line of metrics.
---@return fun(line: table): number|nil
function parameters.reader(path)
  local material, field = path:match "^materials%.(.*)%.([^.]*)$"
  if not material then return function(line) return line.parameters[path] end end
  return function(line) return line.materials[material] and line.materials[material][field] end
end

--- Does a field change in any run of an arm?
function parameters.changes(arm, path)
  local value_of = parameters.reader(path)
  for _, run in ipairs(arm.runs) do
    for _, line in ipairs(run.lines) do
      if value_of(line) ~= value_of(run.lines[1]) then return true end
    end
  end
  return false
end

--- Fields that change in any run of these arms, and those that do not: the four parameters first,
--- then materials by name.
---@return string[] changed
---@return string[] still
function parameters.fields(list)
  local names, of_materials, lists = { unpack(supervise.parameters) }, {}, { {}, {} }
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      for material, fields in pairs(run.lines[1].materials) do
        for field in pairs(fields) do of_materials["materials." .. material .. "." .. field] = 1 end
      end
    end
  end
  for _, path in ipairs(choice.sorted_keys(of_materials)) do names[#names + 1] = path end
  for _, path in ipairs(names) do
    local changed = false
    for _, arm in ipairs(list) do changed = changed or parameters.changes(arm, path) end
    table.insert(lists[changed and 1 or 2], path)
  end
  return lists[1], lists[2]
end

-- The unit of a field as the axis shows it.
local UNITS = { mutation_rate = "per gene", mutation_scale = "1", crossover_rate = "per gene",
  elite_fraction = "of the population", stiffness = "N/m", amplitude = "of the rest length",
  phase = "rad" }

--- A field's name with its unit.
function parameters.label(path)
  return ("%s (%s)"):format(path:match "[^.]*$", UNITS[path:match "[^.]*$"] or "1")
end

--- One field in all repetitions of an arm: thin lines, and a marker where somebody set it.
---@return limax.chart.panel
---@return table<string, boolean> seen setters, and "clamped"
function parameters.panel(arm, path)
  local panel = { title = path:gsub("^materials%.", ""), curves = {},
    x = { label = "generation", linear = true, whole = true },
    y = { label = parameters.label(path), linear = true } }
  local value_of, by_setter, seen = parameters.reader(path), {}, {}
  for _, run in ipairs(arm.runs) do
    local points, at = {}, {}
    for k, line in ipairs(run.lines) do
      points[k] = { line.generation, value_of(line) }
      at[line.generation] = points[k]
    end
    panel.curves[#panel.curves + 1] = { points = points, color = "#8c9198", width = 1.1,
      marker = "none", title = ("repetition %d"):format(run.repetition) }
    for _, line in ipairs(run.ledger) do
      for _, entry in ipairs(line.entries) do
        if entry.field == path and at[line.generation] then
          local who, bound = parameters.setter(run.config, line, entry)
          for _, name in ipairs { who, bound and "clamped" or nil } do
            seen[name] = true
            by_setter[name] = by_setter[name] or {}
            table.insert(by_setter[name], at[line.generation])
          end
        end
      end
    end
  end
  for _, setter in ipairs(parameters.SETTERS) do
    if by_setter[setter.name] then
      panel.curves[#panel.curves + 1] = { points = by_setter[setter.name], color = setter.color,
        dash = "none", marker = setter.marker, title = "set by: " .. setter.name }
    end
  end
  panel.right = 20
  return panel, seen
end

return parameters
