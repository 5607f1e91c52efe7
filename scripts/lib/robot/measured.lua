--- measured.lua: the data from which the measures of a simulated robot are computed: its outcome in
--- the engine, and its traces. SI units.

local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local output = require "limax.base.output"
local plausible = require "limax.settings.plausible"
local rows = require "limax.robot.rows"

local measured = {}

local function fail(pattern, ...) engine.fail(pattern:format(...)) end

--- The engine's outcome of a robot that ended well; only such a robot has measures.
---@param what string names the measure in a message
---@return ffi.cdata* limax_outcome
function measured.outcome(self, what)
  local row = self.row
  local done = rows.done(row)
  if done then return done end
  local outcome = row.outcome
  local when = outcome and outcome.status == "diverged" and outcome.time
    and (" at t = %.4g s"):format(outcome.time + 0) or "" -- + 0: -0 becomes 0
  fail("robot %s has no %s: it is %s%s%s", row.id, what, row.status,
    row.reason and " (" .. rows.explained(row.reason, self.context.options) .. ")" or "", when)
end

--- The experiment's `record` with one more entry, as a script writes it.
function measured.entry_to_add(self, kind)
  local parts, record = {}, self.context.options.record or {}
  for _, name in ipairs(defaults.traces) do
    local rate = record[name] or 0
    if name == kind then rate = 50 end
    if rate > 0 then parts[#parts + 1] = ("%s = %d"):format(name, rate) end
  end
  return "record = { " .. table.concat(parts, ", ") .. " }"
end

--- Is a trace recorded?
function measured.is_recorded(self, kind)
  local record = self.context.options.record
  return record ~= nil and (record[kind] or 0) > 0
end

local warned = {}

-- Warns of a trace with too few samples; an experiment has the same note of its own.
local function check_rate(context, kind)
  if not context.by_hand then return end
  local note = plausible.sparse(kind, context.options.record[kind], context.scene)
  if note and not warned[note] then output.warn("! ", note, "\n") end
  if note then warned[note] = true end
end

--- A number that the engine computes from a trace.
function measured.summary(self, what, field, kind)
  local value = measured.outcome(self, what)[field]
  -- NaN where the trace is not recorded
  if value == value then
    check_rate(self.context, kind)
    return value
  end
  fail("%s reads the trace %q, which was not recorded; add the entry %s (samples per second)", what,
    kind, measured.entry_to_add(self, kind))
end

local starts = { start = "center_start", middle = "center_middle" }

--- The distance that the centre of mass moved.
---@return number dx m
---@return number dy
---@return number dz
function measured.moved(self, what, from)
  local outcome = measured.outcome(self, what)
  local first, last = outcome[starts[from or "start"]], outcome.center_end
  return last[0] - first[0], last[1] - first[1], last[2] - first[2]
end

--- `robot:distance`, for options that were checked before.
---@return number m
function measured.distance(robot, from, axis)
  local dx, dy, dz = measured.moved(robot, "distance", from)
  if axis then return axis == "x" and dx or axis == "y" and dy or dz end
  return math.sqrt(dx * dx + dy * dy)
end

return measured
