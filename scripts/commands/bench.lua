--- bench.lua: `limax bench NAME`: repeatable measurements. Each is a module of
--- scripts/lib/tools/bench that checks results before it times them, and returns rows; this file
--- writes them.

local choice = require "limax.base.choice"
local csv = require "limax.base.csv"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local output = require "limax.base.output"
local source = require "limax.base.source"
local suggest = require "limax.engine.suggest"

local exit_usage = 2

local BENCHES = { "accuracy", "effects", "throughput", "work_precision" }

local OPTIONS = {
  { name = "json", argument = "FILE", text = "also write the rows as JSON" },
  { name = "csv", argument = "FILE", text = "also write the rows as CSV" },
  { name = "device", argument = "NAME", choices = { "auto", "cpu", "cuda" }, value = "auto",
    text = "auto, cpu or cuda" },
  { name = "threads", argument = "N", kind = "integer", minimum = 1, maximum = 1024,
    text = "threads of the CPU device; one per core if left out" },
  { name = "seconds", argument = "S", kind = "number", minimum = 0.01, maximum = 60, value = 0.5,
    text = "throughput, effects: time of one repeat of one measurement" },
  { name = "full",
    text = "throughput: every combination on a GPU; accuracy: more steps and robots, long walks:"
      .. " hours" },
  { name = "duration", argument = "S", kind = "number", minimum = 0.1, maximum = 1000,
    text = "accuracy: of the walks; 1.5 s if left out, with --full as in their scripts" },
}

local function run(arguments)
  local name = arguments[1]
  if not choice.contains(BENCHES, name) then
    failure.raise(exit_usage, ('unknown bench "%s"%s'):format(name, suggest.ending(name, BENCHES)))
  end
  local fine, device =
    failure.attempt(engine.device, arguments.device, { threads = arguments.threads })
  if not fine then failure.raise(failure.status(device) or 1, failure.bare(device)) end
  if arguments.duration and name ~= "accuracy" then
    failure.raise(exit_usage, "--duration belongs to limax bench accuracy")
  end
  arguments.device = device
  arguments.say = function(text) output.write(text, "\n") io.flush() end
  local result = require("limax.tools.bench." .. name).run(arguments)
  result.schema = "limax.bench/1"
  result.bench = name
  result.environment = host.environment()
  if arguments.json then
    source.write(arguments.json, host.json.encode(result, { indent = 2 }) .. "\n")
  end
  if arguments.csv then source.write(arguments.csv, csv.encode(result.columns, result.rows)) end
  return 0
end

return {
  summary = "measure speed and accuracy, after checking the physics of what is measured",
  usage = "limax bench NAME [options]",
  text = "throughput measures springs per second: on the CPU by integrator, precision and\n"
    .. "effects, and the speed-up by threads; on a GPU by population, lattice and precision, with\n"
    .. "the kernel that served each.\n"
    .. "effects measures the time of a step with each effect, all but each, and all.\n"
    .. "accuracy measures what accuracy costs: how well walkers keep their order under cheap\n"
    .. "integrators, precisions and steps; two minutes on two cores.\n"
    .. "work_precision measures the error of a body's motion against its price, for every\n"
    .. "integrator, precision and step, and for the tiers; ten seconds.",
  positional = { name = "NAME", least = 1, most = 1 },
  options = OPTIONS,
  run = run,
}
