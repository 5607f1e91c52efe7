--- hard_cases.lua: what breaks other simulators, one case each, by kind. A case is a name, the row
--- of the table of hard cases that it answers, and a function that puts robots into a scene and
--- checks what physics says of them; `limax test tests/suites/hard` and `limax bench stability` run
--- the same ones. SI units.

local engine = require "limax.engine"
local host = require "limax.host"
local stage = require "limax.tools.bench.hard_cases.stage"

local hard_cases = {}

--- Modules of scripts/lib/tools/bench/hard_cases that hold cases.
hard_cases.KINDS = { "flight", "modes", "extremes", "contact", "friction", "loads", "shapes",
  "muscles", "sameness", "effects", "block" }

---@class limax.hard_case
---@field row integer|nil of the table of hard cases
---@field name string
---@field run fun(c: limax.hard_cases.context) raises where a check does not hold
---@field needs string[]|nil effects that the engine must have
---@field smooth boolean|nil no contact switches: integrators for smooth scenes do it too
---@field brief boolean|nil long: only `BRIEF` combinations unless the full ones are wanted
---@field full boolean|nil very long: only when the full ones are wanted
---@field except table<string, string>|nil why an integrator is not asked, by its name
---@field cpu boolean|nil it needs what the CPU alone has
---@field absent string|nil why the case cannot be put at all
---@field kind string

--- Cases of one kind, in order.
---@param kind string
---@return limax.hard_case[]
function hard_cases.of(kind)
  local cases = require("limax.tools.bench.hard_cases." .. kind)
  for _, case in ipairs(cases) do case.kind = kind end
  return cases
end

--- All cases, kind by kind.
---@return limax.hard_case[]
function hard_cases.all()
  local list = {}
  for _, kind in ipairs(hard_cases.KINDS) do
    for _, case in ipairs(hard_cases.of(kind)) do list[#list + 1] = case end
  end
  return list
end

-- Several precisions and the integrators of every scene meet in these.
local BRIEF = { ["leapfrog compensated"] = true, ["symplectic_euler double"] = true,
  ["xpbd single"] = true }
-- integrators that take contacts, and of them those that a GPU has too; what takes none does the
-- smooth cases, on the CPU
local CONTACTS = { leapfrog = true, symplectic_euler = true, xpbd = true }
local ON_GPU = { leapfrog = true, symplectic_euler = true }

---@class limax.hard_cases.combination
---@field integrator string
---@field precision string

--- The combinations of integrator and precision in which a case is run on a device.
---@param case limax.hard_case
---@param kind string of the device
---@param full boolean every one
---@param brief boolean|nil those of a long case, whatever the case
---@return limax.hard_cases.combination[]
function hard_cases.combinations(case, kind, full, brief)
  local list = {}
  for _, integrator in ipairs(engine.names.integrator.names) do
    for _, precision in ipairs(engine.names.precision.names) do
      local able = (kind == "cpu" and (CONTACTS[integrator] or case.smooth)
        or ON_GPU[integrator]) and not (case.except and case.except[integrator])
      if case.cpu and kind ~= "cpu" then able = false end
      local chosen = full or not (brief or case.brief) or BRIEF[integrator .. " " .. precision]
      if able and chosen then
        list[#list + 1] = { integrator = integrator, precision = precision }
      end
    end
  end
  return list
end

--- Why a case cannot be run with this engine, or nil.
---@param case limax.hard_case
---@return string|nil
function hard_cases.missing(case)
  if case.absent then return case.absent end
  local known = {}
  for _, effect in ipairs(engine.effects()) do known[effect.name] = true end
  for _, name in ipairs(case.needs or {}) do
    if not known[name] then return ("this engine has no effect %q"):format(name) end
  end
  return nil
end

---@class limax.hard_cases.verdict
---@field status "holds"|"reported"|"fails"
---@field text string|nil the reason of the divergence that was rightly reported, or what fails
---@field notes string[]
---@field seconds number

--- Runs one case in one combination.
---@param case limax.hard_case
---@param combination { device: limax.device, integrator: string, precision: string,
--- fraction: number|nil } `fraction` of the step's bound where a case has no choice of its own
---@param full boolean|nil
---@return limax.hard_cases.verdict
function hard_cases.run(case, combination, full)
  local started = host.clock()
  local c = stage.context { device = combination.device, integrator = combination.integrator,
    precision = combination.precision, fraction = combination.fraction, full = full }
  local fine, message = pcall(case.run, c)
  if not fine and message == host.interrupt then error(message, 0) end
  local verdict = { notes = c.notes, seconds = host.clock() - started }
  if not fine then
    verdict.status, verdict.text = "fails", tostring(message)
  elseif c.reported then
    verdict.status, verdict.text = "reported", c.reported
  else
    verdict.status = "holds"
  end
  collectgarbage "collect"
  return verdict
end

return hard_cases
