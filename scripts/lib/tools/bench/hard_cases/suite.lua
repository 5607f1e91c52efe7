--- suite.lua: makes a suite of the hard cases of one kind: a test for each case and device, which
--- runs its combinations of integrator and precision and asks the same verdict of all. Those of a
--- GPU are few unless the tests tagged full are asked for.

local hard_cases = require "limax.tools.bench.hard_cases"
local test = require "limax.test"

-- Runs a case's combinations on the test's device.
local function run(t, case, full)
  local missing = hard_cases.missing(case)
  if missing then t:skip(missing) end
  local first
  -- a GPU compiles a kernel for each combination of a scene and a lattice
  local brief = t.device.kind ~= "cpu"
  for _, how in ipairs(hard_cases.combinations(case, t.device.kind, full, brief)) do
    how.device = t.device
    local verdict = hard_cases.run(case, how, full)
    local name = ("%s %s"):format(how.integrator, how.precision)
    t:ok(verdict.status ~= "fails", ("%s: %s"):format(name, verdict.text))
    for _, note in ipairs(verdict.notes) do t:note(("%s: %s"):format(name, note)) end
    local word = verdict.text and ("%s (%s)"):format(verdict.status, verdict.text) or verdict.status
    first = first or word
    t:ok(word == first, ("%s: %s, and another combination: %s"):format(name, word, first))
  end
  if first ~= "holds" then t:note(first) end
end

--- Begins the suite of a kind.
---@param kind string
return function(kind)
  local suite = test.suite("hard cases: " .. kind)
  for _, case in ipairs(hard_cases.of(kind)) do
    local row = case.row and ("%d. "):format(case.row) or ""
    if not case.full then
      suite:test(row .. case.name, { devices = case.cpu and { "cpu" } or "all" },
        function(t) run(t, case, false) end)
    end
    local devices = (case.full or case.brief) and "all" or { "cuda" }
    if case.cpu then devices = { "cpu" } end
    suite:test(row .. case.name .. ", in full", { devices = devices, tags = "full" },
      function(t) run(t, case, true) end)
  end
end
