--- stability.lua: every hard case on every device, in every precision, with every integrator, as
--- one table. A case holds, or what must be reported was reported; its verdict is the same
--- everywhere. SI units.

local engine = require "limax.engine"
local hard_cases = require "limax.tools.bench.hard_cases"
local host = require "limax.host"

local stability = {}

local COLUMNS = { "row", "kind", "case", "device", "integrator", "precision", "status", "text",
  "seconds" }
local CELLS = { holds = "ok", reported = "told", fails = "FAIL", skipped = "-" }
-- characters of a cell
local CELL = 12
local LEGEND = "ok: its checks hold; told: it diverges, and is reported as it should;"
  .. " FAIL: neither;\n"
  .. "-: not run: of long cases, and on a GPU, a few combinations unless --full; RK4 takes smooth\n"
  .. "scenes, and a case says why it does not ask XPBD"
local SHORT = { symplectic_euler = "euler" }

-- The CPU, and the device that was asked for if it is another: a verdict is the same on both.
local function devices_of(how)
  if how.device.kind == "cpu" then return { how.device } end
  return { engine.device "cpu", how.device }
end

-- Every combination of integrator and precision, a column each.
local function all_columns()
  local list = {}
  for _, integrator in ipairs(engine.names.integrator.names) do
    for _, precision in ipairs(engine.names.precision.names) do
      list[#list + 1] = { integrator = integrator, precision = precision }
    end
  end
  return list
end

local function key_of(how) return how.integrator .. " " .. how.precision end

local function header(columns, width)
  local first, second = {}, {}
  for i, column in ipairs(columns) do
    local name = SHORT[column.integrator] or column.integrator
    first[i] = ("%-" .. CELL .. "s"):format(name)
    second[i] = ("%-" .. CELL .. "s"):format(column.precision)
  end
  local margin = (" "):rep(width + 6)
  return margin .. table.concat(first) .. "\n" .. margin .. table.concat(second)
end

-- One case on one device: a row for each combination, and the cells of its line.
local function run_case(case, device, how, columns, width, rows)
  local cells, verdicts, failures = {}, {}, {}
  local missing = hard_cases.missing(case)
  for _, combination in ipairs(missing and {} or
    hard_cases.combinations(case, device.kind, how.full)) do
    combination.device, combination.fraction = device, how.fraction
    local verdict = hard_cases.run(case, combination, how.full)
    rows[#rows + 1] = { row = case.row, kind = case.kind, case = case.name, device = device.kind,
      integrator = combination.integrator, precision = combination.precision,
      status = verdict.status, text = verdict.text, seconds = verdict.seconds }
    cells[key_of(combination)] = CELLS[verdict.status]
    local word = verdict.status == "reported" and "reported: " .. verdict.text or verdict.status
    verdicts[word] = true
    if verdict.status == "fails" then
      failures[#failures + 1] = ("      %s %s: %s"):format(combination.integrator,
        combination.precision, verdict.text)
    end
  end
  if missing then
    rows[#rows + 1] = { row = case.row, kind = case.kind, case = case.name, device = device.kind,
      status = "skipped", text = missing }
  end
  local line = {}
  for i, column in ipairs(columns) do
    line[i] = ("%-" .. CELL .. "s"):format(cells[key_of(column)] or "-")
  end
  local row = case.row and ("%3d. "):format(case.row) or "     "
  how.say(("%s%-" .. width .. "s %s%s"):format(row, case.name, table.concat(line),
    missing and "skipped: " .. missing or ""))
  for _, failure in ipairs(failures) do how.say(failure) end
  return verdicts, missing ~= nil
end

--- Runs the cases and prints the table.
---@param how limax.bench_how `filter`: part of a case's name or kind; `full`: long cases too, and
--- every combination of all; `fraction` of the step's bound where a case has no choice of its own
---@return limax.bench_result failed if a case fails or its verdicts differ
function stability.run(how)
  local columns, rows = all_columns(), {}
  local counts = { cases = 0, skipped = 0, failed = 0, differ = 0 }
  local verdicts_of = {}
  local started = host.clock()
  local chosen, width = {}, 0
  for _, case in ipairs(hard_cases.all()) do
    local name = ("%s: %s"):format(case.kind, case.name)
    if (not how.filter or name:find(how.filter, 1, true)) and (how.full or not case.full) then
      chosen[#chosen + 1] = { case = case, name = name }
      width = math.max(width, #case.name)
    end
  end
  for _, device in ipairs(devices_of(how)) do
    how.say(tostring(device))
    how.say(header(columns, width))
    for _, each in ipairs(chosen) do
      local verdicts, skipped = run_case(each.case, device, how, columns, width, rows)
      local known = verdicts_of[each.name]
      if not known then
        counts.cases, known = counts.cases + 1, { words = {} }
        verdicts_of[each.name] = known
        if skipped then counts.skipped = counts.skipped + 1 end
      end
      for word in pairs(verdicts) do known.words[word] = true end
    end
  end
  how.say(LEGEND)
  for _, known in pairs(verdicts_of) do
    local words = 0
    for word in pairs(known.words) do
      words = words + 1
      if word == "fails" then counts.failed = counts.failed + 1 end
    end
    if words > 1 then counts.differ = counts.differ + 1 end
  end
  how.say(("%d cases in %.0f s: %d hold, %d fail, %d skipped; the verdicts of %d differ"):format(
    counts.cases, host.clock() - started, counts.cases - counts.failed - counts.skipped,
    counts.failed, counts.skipped, counts.differ))
  return { columns = COLUMNS, rows = rows, cases = counts,
    failed = counts.failed > 0 or counts.differ > 0 }
end

return stability
