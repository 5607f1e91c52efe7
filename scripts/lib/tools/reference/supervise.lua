--- supervise.lua: the library's supervisors.

-- What a supervisor is stands at the top of its file.
local function supervisor(name, options)
  local text = options and ('{ "%s", %s }'):format(name, options) or ('"%s"'):format(name)
  return { name, false, 'limax.experiment { fitness = "walk", generations = 2, supervisor = '
    .. text .. " }",
    file = ("scripts/lib/supervise/%s.lua"):format(name), at = "the top",
    signature = "supervisor = " .. text }
end

return {
  title = "limax.supervise",
  text = 'Supervisors: `supervisor = "rules"`, or `{ "rules", patience = 5 }`.',
  file = "scripts/lib/supervise/supervise.lua", prefix = "limax.supervise.", holder = "supervise.",
  keys = "entries",
  entries = {
    supervisor "fixed",
    supervisor("schedule", "mutation_scale = { { 0, 0.2 }, { 39, 0.02 } }"),
    supervisor("random", "step = 0.5"),
    supervisor("one_fifth", "window = 3"),
    supervisor("self_adaptive", "span = 2"),
    supervisor("bandit", "spread = 2"),
    supervisor("rules", "patience = 5"),
    supervisor("llm", 'model = "gpt-oss:20b", url = "http://localhost:11434/v1"'),
    supervisor("replay", 'run = "runs/walk-1"'),
    supervisor("yoked", 'run = "runs/walk-1"'),
    supervisor("shuffled", 'run = "runs/walk-1"'),
    supervisor("constant_median", 'run = "runs/walk-1"'),
    { "get", false, 'limax.supervise.get("rules").name' },
    { "entries", false, "limax.supervise.entries.rules", signature = "limax.supervise.entries",
      what = "Options of each supervisor, by its name." },
    { "parameters", false, "limax.supervise.parameters", signature = "limax.supervise.parameters",
      what = "Names of the four parameters that every supervisor may set." },
  },
}
