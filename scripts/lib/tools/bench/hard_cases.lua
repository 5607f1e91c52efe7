--- hard_cases.lua: scenes that break other simulators. A case is a test in tests/suites/hard, which
--- simulates robots and checks the result against physics. SI units.

local context = require "limax.tools.bench.hard_cases.context"
local engine = require "limax.engine"
local host = require "limax.host"
local test = require "limax.test"

local hard_cases = {}

---@class limax.hard_case
---@field row integer|nil row of the list of hard cases that it covers
---@field name string
---@field run fun(c: limax.hard_cases.context) raises if a check fails
---@field smooth boolean|nil no contact: RK4 runs it too
---@field brief boolean|nil slow: runs in few combinations, in all of them with --full
---@field cpu boolean|nil needs the CPU

-- For slow cases and GPUs, which compile a kernel for each combination.
local FEW = { ["leapfrog compensated"] = true, ["symplectic_euler double"] = true }
-- Every precision and every integrator; with the tag full every pair.
local SOME = { ["leapfrog single"] = true, ["leapfrog compensated"] = true,
  ["leapfrog double"] = true, ["symplectic_euler single"] = true,
  ["symplectic_euler double"] = true, ["rk4 double"] = true }

local function able(case, integrator, kind)
  if integrator == "rk4" then return kind == "cpu" and case.smooth end
  return kind == "cpu" or not case.cpu
end

-- The combinations of integrator and precision in which a case runs on a kind of device. `extent`:
-- "few", "some" or "all".
local function combinations(case, kind, extent)
  local list = {}
  local chosen = extent ~= "all" and (extent == "few" or case.brief) and FEW
    or extent == "some" and SOME
  for _, integrator in ipairs(engine.names.integrator.names) do
    for _, precision in ipairs(engine.names.precision.names) do
      if able(case, integrator, kind)
        and (not chosen or chosen[integrator .. " " .. precision]) then
        list[#list + 1] = { integrator = integrator, precision = precision }
      end
    end
  end
  return list
end

-- Runs a case's combinations on the test's device; all must hold, or diverge for the same reason.
local function run_test(t, case, extent)
  local first
  for _, each in ipairs(combinations(case, t.device.kind, extent)) do
    local name = ("%s %s"):format(each.integrator, each.precision)
    local c = context.new { device = t.device, integrator = each.integrator,
      precision = each.precision, full = extent == "all" }
    local fine, message = pcall(case.run, c)
    if message == host.interrupt then error(message, 0) end
    t:ok(fine, ("%s: %s"):format(name, tostring(message)))
    for _, note in ipairs(c.notes) do t:note(("%s: %s"):format(name, note)) end
    local verdict = c.reported and ("reported (%s)"):format(c.reported) or "holds"
    first = first or verdict
    t:ok(verdict == first, ("%s: %s; another combination: %s"):format(name, verdict, first))
    collectgarbage "collect"
  end
  if first ~= "holds" then t:note(first) end
end

--- Begins a suite of hard cases. The function that it returns adds one: a test on every device, and
--- a test tagged full that runs the long version in every combination.
---@return fun(case: limax.hard_case)
function hard_cases.suite(kind)
  local suite = test.suite("hard cases: " .. kind)
  return function(case)
    local name = (case.row and ("%d. "):format(case.row) or "") .. case.name
    local devices = case.cpu and "cpu" or "all"
    suite:test(name, { devices = devices },
      function(t) run_test(t, case, t.device.kind == "cpu" and "some" or "few") end)
    suite:test(name .. ", in full", { devices = devices, tags = "full" },
      function(t) run_test(t, case, "all") end)
  end
end

return hard_cases
