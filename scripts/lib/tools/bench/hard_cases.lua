--- hard_cases.lua: scenes that break other simulators. A case is a test in tests/suites/hard, which
--- simulates robots and checks the result against physics. `limax test tests/suites/hard` and
--- `limax bench stability` run the same cases. SI units.

local context = require "limax.tools.bench.hard_cases.context"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local script = require "limax.base.script"
local test = require "limax.test"

local hard_cases = {}

---@class limax.hard_case
---@field row integer|nil row of the list of hard cases that it covers
---@field name string
---@field run fun(c: limax.hard_cases.context) raises if a check fails
---@field smooth boolean|nil no contact: RK4 runs it too
---@field brief boolean|nil slow: runs in few combinations, in all of them with --full
---@field cpu boolean|nil needs the CPU
---@field kind string name of its file

-- For slow cases and GPUs, which compile a kernel for each combination.
local FEW = { ["leapfrog compensated"] = true, ["symplectic_euler double"] = true }
-- For `limax test`: every precision and every integrator; `limax bench stability` runs every pair.
local SOME = { ["leapfrog single"] = true, ["leapfrog compensated"] = true,
  ["leapfrog double"] = true, ["symplectic_euler single"] = true,
  ["symplectic_euler double"] = true, ["rk4 double"] = true }

local function able(case, integrator, kind)
  if integrator == "rk4" then return kind == "cpu" and case.smooth end
  return kind == "cpu" or not case.cpu
end

--- The combinations of integrator and precision in which a case runs on a kind of device.
---@param extent "few"|"some"|"all"
---@return { integrator: string, precision: string }[]
function hard_cases.combinations(case, kind, extent)
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

--- Runs one case in one combination.
---@param fields table see context.new
---@return { status: "holds"|"reported"|"fails", text: string|nil, notes: string[],
--- seconds: number } `text`: reason of an expected divergence, or the check that failed
function hard_cases.run(case, fields)
  local started = host.clock()
  local c = context.new(fields)
  local fine, message = pcall(case.run, c)
  if message == host.interrupt then error(message, 0) end
  local verdict = { notes = c.notes, status = "holds", seconds = host.clock() - started }
  if not fine then
    verdict.status, verdict.text = "fails", tostring(message)
  elseif c.reported then
    verdict.status, verdict.text = "reported", c.reported
  end
  collectgarbage "collect"
  return verdict
end

-- Runs a case's combinations on the test's device; all must have the same verdict.
local function run_test(t, case, extent)
  local first
  for _, combination in ipairs(hard_cases.combinations(case, t.device.kind, extent)) do
    local name = ("%s %s"):format(combination.integrator, combination.precision)
    combination.device, combination.full = t.device, extent == "all"
    local verdict = hard_cases.run(case, combination)
    t:ok(verdict.status ~= "fails", ("%s: %s"):format(name, verdict.text))
    for _, note in ipairs(verdict.notes) do t:note(("%s: %s"):format(name, note)) end
    local text = verdict.text and ("%s (%s)"):format(verdict.status, verdict.text)
      or verdict.status
    first = first or text
    t:ok(text == first, ("%s: %s; another combination: %s"):format(name, text, first))
  end
  if first ~= "holds" then t:note(first) end
end

local cases = {}

--- Begins a suite of hard cases. The function that it returns adds one: a test on every device, and
--- a test tagged full that runs the long version in every combination.
---@return fun(case: limax.hard_case)
function hard_cases.suite(kind)
  local suite = test.suite("hard cases: " .. kind)
  return function(case)
    case.kind = kind
    cases[#cases + 1] = case
    local name = (case.row and ("%d. "):format(case.row) or "") .. case.name
    local devices = case.cpu and "cpu" or "all"
    suite:test(name, { devices = devices },
      function(t) run_test(t, case, t.device.kind == "cpu" and "some" or "few") end)
    suite:test(name .. ", in full", { devices = devices, tags = "full" },
      function(t) run_test(t, case, "all") end)
  end
end

--- All cases, in the order of tests/suites/hard.
function hard_cases.all()
  local folder = host.home .. "/tests/suites/hard"
  local names = host.file.list(folder)
  if not names then failure.raise(1, "no hard cases are installed: there is no " .. folder) end
  cases = {}
  test.collect(function()
    for _, name in ipairs(names) do script.load(folder .. "/" .. name)() end
  end)
  return cases
end

return hard_cases
