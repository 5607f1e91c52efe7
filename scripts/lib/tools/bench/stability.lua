--- stability.lua: `limax bench stability`: the hard cases of tests/suites/hard on every device, in
--- every precision, with every integrator, as one table.

local engine = require "limax.engine"
local hard_cases = require "limax.tools.bench.hard_cases"
local host = require "limax.host"

local stability = {}

local COLUMNS = { "row", "kind", "case", "device", "integrator", "precision", "status", "text",
  "seconds" }
local LEGEND = "ok: its checks hold; reported: it diverges, as expected, and is reported; FAIL: "
  .. "neither.\nSlow cases run in few combinations without --full; RK4 runs scenes without contact;"
  .. " GPUs do\nnot run every case"

-- Runs one case on one device and prints its line and failures; adds its rows and verdicts.
local function run_case(case, device, how, width, rows, verdicts)
  local counts, failures = { holds = 0, reported = 0, fails = 0 }, {}
  local extent = case.brief and not how.full and "few" or "all"
  for _, combination in ipairs(hard_cases.combinations(case, device.kind, extent)) do
    combination.device, combination.fraction, combination.full = device, how.fraction, how.full
    local verdict = hard_cases.run(case, combination)
    rows[#rows + 1] = { row = case.row, kind = case.kind, case = case.name, device = device.kind,
      integrator = combination.integrator, precision = combination.precision,
      status = verdict.status, text = verdict.text, seconds = verdict.seconds }
    counts[verdict.status] = counts[verdict.status] + 1
    if verdict.status == "fails" then
      failures[#failures + 1] = ("      %s %s: %s"):format(combination.integrator,
        combination.precision, verdict.text)
      verdicts.fails = true
    else
      verdicts[verdict.text or "holds"] = true
    end
  end
  how.say(("%s%-" .. width .. "s %3d ok %3d reported %3d FAIL"):format(
    case.row and ("%3d. "):format(case.row) or "     ", case.name, counts.holds, counts.reported,
    counts.fails))
  for _, failure in ipairs(failures) do how.say(failure) end
end

--- Runs the cases and prints the table: the number of combinations of integrator and precision in
--- which each holds.
---@param how table `filter`: part of "KIND: NAME"; `full`: the long versions, in every
--- combination; `fraction` of the step's bound where a case sets none
---@return limax.bench_result failed if a case fails or its verdicts differ
function stability.run(how)
  local started, chosen, width, rows = host.clock(), {}, 0, {}
  for _, case in ipairs(hard_cases.all()) do
    if not how.filter or ("%s: %s"):format(case.kind, case.name):find(how.filter, 1, true) then
      chosen[#chosen + 1] = { case = case, verdicts = {} }
      width = math.max(width, #case.name)
    end
  end
  -- verdicts must be the same on the CPU and on the chosen device
  local on_cpu = how.device.kind == "cpu"
  for _, device in ipairs { on_cpu and how.device or engine.device "cpu",
    not on_cpu and how.device or nil } do
    how.say(tostring(device))
    for _, each in ipairs(chosen) do
      run_case(each.case, device, how, width, rows, each.verdicts)
    end
  end
  how.say(LEGEND)
  local counts = { cases = #chosen, failed = 0, differ = 0 }
  for _, each in ipairs(chosen) do
    local first = next(each.verdicts)
    counts.failed = counts.failed + (each.verdicts.fails and 1 or 0)
    counts.differ = counts.differ + (next(each.verdicts, first) and 1 or 0)
  end
  how.say(("%d cases in %.0f s: %d hold, %d fail; the verdicts of %d differ"):format(counts.cases,
    host.clock() - started, counts.cases - counts.failed, counts.failed, counts.differ))
  return { columns = COLUMNS, rows = rows, cases = counts,
    failed = counts.failed > 0 or counts.differ > 0 }
end

return stability
