--- run_folder.lua: the tables of scripts/RUN_FOLDER.md that the engine and the settings describe:
--- Scene, Simulation and Record.

local choice = require "limax.base.choice"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local host = require "limax.host"
local source = require "limax.base.source"

local run_folder = {}

run_folder.path = "scripts/RUN_FOLDER.md"

local WORDS = {
  { "integrator", "the integrator: %s", defaults.integrators },
  { "precision", "of the arithmetic: %s", defaults.precisions },
  { "sharing", "%s of the stiffnesses of voxels that share a spring", defaults.sharings },
}
local OPTIONAL = { bound_fraction = true, time_step_most = true }

local function row(name, unit, meaning)
  return (("| `%s` | %s | %s |"):format(name, unit, meaning):gsub("|  |", "| |"))
end

local function scene()
  local rows = {}
  for _, effect in ipairs(engine.effects()) do
    local name = effect.instances > 1 and effect.name .. "[]" or effect.name
    if effect.name ~= "springs" then
      rows[#rows + 1] = row(name, "", "*optional*: " .. effect.summary)
      for _, field in ipairs(effect.fields) do
        rows[#rows + 1] = row(name .. "." .. field.name, field.unit, field.note)
      end
    end
  end
  return rows
end

local function simulation()
  local rows = {}
  for i, word in ipairs(WORDS) do
    rows[i] = row(word[1], "", word[2]:format("`" .. table.concat(word[3], "`, `") .. "`"))
  end
  for _, name in ipairs(choice.sorted_keys(defaults.fields.simulation)) do
    local field = defaults.fields.simulation[name]
    rows[#rows + 1] = row(name, field.unit,
      OPTIONAL[name] and ("*optional*: %s; absent for a number"):format(field.note) or field.note)
  end
  return rows
end

local function record()
  local names = "`" .. table.concat(defaults.traces, "`, `") .. "`"
  return { ("| %s | Hz | of the trace of that name |"):format(names) }
end

--- The page with these tables regenerated.
---@return string
function run_folder.text()
  local text = assert(source.read(host.home .. "/" .. run_folder.path))
  for heading, rows in pairs { Scene = scene(), Simulation = simulation(), Record = record() } do
    local pattern = "(\n## " .. heading .. "\n.-\n|%-%-%-|%-%-%-|%-%-%-|\n).-(\n\n)"
    local first, last, before, after = text:find(pattern)
    text = text:sub(1, first - 1) .. before .. table.concat(rows, "\n") .. after
      .. text:sub(last + 1)
  end
  return text
end

return run_folder
