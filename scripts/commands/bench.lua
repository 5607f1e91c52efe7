--- bench.lua: `limax bench NAME`: measurements that anyone can repeat. Each is a module under
--- scripts/lib/bench that first checks what it is about to time, then measures, and returns rows;
--- this file runs it and writes them.

local csv = require "limax.bench.csv"
local failure = require "limax.failure"
local host = require "limax.host"
local suggest = require "limax.suggest"

local exit_usage = 2

-- files of scripts/lib/bench that benches share
local shared = { child = true, csv = true, timing = true }

-- names of the benches: the other files there
local function bench_names()
  local names = {}
  for _, file in ipairs(host.file.list(host.home .. "/scripts/lib/bench") or {}) do
    local name = file:match "^(%l[%l%d_]*)%.lua$"
    if name and not shared[name] then names[#names + 1] = name end
  end
  return names
end

local function write(path, text)
  local written, message = host.file.write_atomic(path, text)
  if not written then failure.raise(1, message) end
end

local function run(arguments)
  local name = arguments[1]
  local known = false
  for _, each in ipairs(bench_names()) do known = known or each == name end
  if not known then
    local ending = suggest.ending(name, bench_names())
    failure.raise(exit_usage, ('unknown bench "%s"%s'):format(name, ending))
  end
  local bench = require("limax.bench." .. name)
  local result = bench.run {
    device = arguments.device,
    threads = arguments.threads,
    seconds = arguments.seconds,
    full = arguments.full,
    say = function(text) io.write(text, "\n") io.flush() end,
  }
  result.schema = "limax.bench/1"
  result.bench = name
  result.environment = host.environment()
  if arguments.json then write(arguments.json, host.json.encode(result, { indent = 2 }) .. "\n") end
  if arguments.csv then write(arguments.csv, csv.encode(result.columns, result.rows)) end
  return 0
end

return {
  summary = "measure speed, after checking the physics of what is measured",
  usage = "limax bench NAME [options]",
  text = "There are: " .. table.concat(bench_names(), ", ") .. ".\n\n"
    .. "throughput measures springs per second, the speed-up by threads, and the seconds per\n"
    .. "generation of `limax run walk.lua`; with --full also the peak memory of 1000 robots.",
  positional = { name = "NAME", least = 1, most = 1 },
  options = {
    { name = "json", argument = "FILE", text = "also write the rows as JSON" },
    { name = "csv", argument = "FILE", text = "also write the rows as CSV" },
    { name = "device", argument = "NAME", choices = { "auto", "cpu", "cuda" }, value = "auto",
      text = "auto, cpu or cuda" },
    { name = "threads", argument = "N", kind = "integer", minimum = 1, maximum = 1024,
      text = "threads of the CPU device; one per core if left out" },
    { name = "seconds", argument = "S", kind = "number", minimum = 0.01, maximum = 60, value = 0.5,
      text = "time of one repeat of one measurement" },
    { name = "full", text = "also a generation of 1000 robots: about half a minute" },
  },
  run = run,
}
