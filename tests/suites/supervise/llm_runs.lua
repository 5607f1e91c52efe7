--- llm_runs.lua: whole runs under the real client and a server that misbehaves: the run ends, keeps
--- to its budgets, replays without the server to the byte, and the key is in none of its files.

local client = require "limax.supervise.llm.client"
local evolution = require "support.evolution"
local faulty_server = require "support.faulty_server"
local field_page = require "support.field_page"
local host = require "limax.host"
local model_stage = require "support.model_stage"
local played = require "support.played"
local process = require "support.process"
local source = require "limax.base.source"
local talker = require "support.talker"

local suite = require("limax.test").suite "llm runs"

-- Seconds of a generation and of an attempt.
local BUDGET, TIMEOUT = 10, 0.5

-- A client that asks another URL before each generation, without waits between attempts.
local function client_of(urls)
  return function(_, hooks)
    local made = {}
    function made:describe() return { endpoint = "http://127.0.0.1", model = "m" } end
    function made:state() return {} end
    function made:restore() end
    function made:ask(messages, question)
      return client.new({ url = urls[question.generation], model = "m", timeout = TIMEOUT }, {
        environment = function(name) return name == "LIMAX_LLM_KEY" and model_stage.KEY or nil end,
        record = hooks.record, wait = function() end,
      }):ask(messages, question)
    end
    return made
  end
end

-- Searches every file below a folder for the key; returns the number of files.
local function search(t, folder)
  local files = 0
  for _, name in ipairs(host.file.list(folder)) do
    local path = folder .. "/" .. name
    if host.file.exists(path) == "folder" then
      files = files + search(t, path)
    else
      files = files + 1
      local leak = played.leaks(source.read(path))
      t:ok(not leak, ("%s shows the key as %s"):format(path, tostring(leak)))
    end
  end
  return files
end

local function compare_transcript(t, folder)
  local page = field_page.read()
  field_page.compare_transcript(t, source.read(folder .. "/transcript.jsonl"),
    { Attempt = field_page.tree(page, "Attempt"), Decision = field_page.tree(page, "Decision") })
end

suite:test("a run with a different fault in each generation", { limit = 300 }, function(t)
  local server, urls = faulty_server.open(t), {}
  local names = server:ask "names"
  for k, name in ipairs(names) do urls[k] = server:url(name) end
  local done = talker.run(t, { "llm", client = client_of(urls), budget = BUDGET },
    { generations = #names + 1 })
  local outcomes, attempts, sources = talker.of_kind(done, "outcome"), {}, {}
  t:equal({ #outcomes, #done.ledger }, { #names, #names + 1 })
  compare_transcript(t, done.folder)
  for _, line in ipairs(talker.of_kind(done, "attempt")) do
    attempts[line.generation] = (attempts[line.generation] or 0) + 1
  end
  for k, line in ipairs(outcomes) do
    t:equal({ line.generation, done.ledger[k + 1].source }, { k, line.source })
    t:ok(line.seconds < BUDGET + process.LATE, ("%s: it took %.1f s"):format(names[k],
      line.seconds))
    local noted, usable = 0, false
    for _, ask in ipairs(line.asks) do
      noted = noted + ask.attempts
      usable = usable or not ask.failure and #ask.problems == 0
    end
    t:equal({ names[k], noted }, { names[k], attempts[k] })
    t:ok((line.source == "model") == usable, names[k] .. ": " .. line.source)
    t:ok(usable or line.why and not line.why:find "%c", names[k])
    sources[line.source] = (sources[line.source] or 0) + 1
  end
  t:ok(sources.model >= 5 and sources.keep > 15)
  t:ok(server:ask "counts".echo.keys > 0, "the server should see the key")
  server:close()
  t:ok(search(t, done.folder) > #names)
  t:ok(not played.leaks(done.output), done.output)
  local again = talker.run(t, { "replay", run = done.folder }, { generations = #names + 1 })
  evolution.same_files(t, again.folder, done.folder, { "metrics.jsonl", "ledger.jsonl" })
end)

local EXPERIMENT = [[
local limax = require "limax"
return limax.experiment { name = "talk", lattice = { 2, 2, 2 }, population = 4, generations = 21,
  repetitions = 3, simulation = { duration = 0.06, settle = 0, accuracy = "preview" },
  fitness = "distance", supervisor = { "llm", budget = 1 } }
]]

suite:test("a dead endpoint costs its budgets once, not in each repetition",
  { limit = 120 }, function(t)
    local server, folder = faulty_server.open(t), t:folder()
    assert(host.file.write_atomic(folder .. "/dead.lua", EXPERIMENT))
    local function run(name, ...)
      local done = process.completes(t, folder, { "run", "dead.lua", "--out", name, "-q",
        "--device", "cpu", ... }, { before = ("export LIMAX_LLM_MODEL=m "
          .. "LIMAX_LLM_URL=http://127.0.0.1:%d;"):format(server.ports.refused) })
      -- printed once in a repetition, not before each generation
      local _, times = done.stderr:gsub("generations until it is probed", "")
      t:ok(times >= 1 and times <= 3, done.stderr)
      local attempts = talker.of_kind(talker.read(folder .. "/" .. name), "attempt")
      local probes = 0
      for _, line in ipairs(attempts) do probes = probes + (line.probe and 1 or 0) end
      return { questions = #attempts - probes, probes = probes }
    end
    -- of 60 generations 3 asked; the 9th, the 20th, the 41st and the first of a repetition (the
    -- 21st and the 41st) probed
    t:equal(run("apart", "--apart"), { questions = 3, probes = 4 })
    t:equal(run("together", "--together"), { questions = 3, probes = 3 })
    evolution.same_files(t, folder .. "/together", folder .. "/apart", { "metrics.jsonl" })
    server:close()
  end)

suite:test("the shipped experiment runs, replays as its file states, and shows no key",
  { limit = 60 }, function(t)
    local server, folder = faulty_server.open(t), t:folder()
    local script = host.home .. "/scripts/experiments/supervised.lua"
    local small = { "-q", "--device", "cpu", "--set", "population=6", "--set", "generations=4",
      "--set", "lattice=[3,3,3]", "--set", "simulation.duration=0.4" }
    local done = process.completes(t, folder, { "run", script, "--out", "live", unpack(small) },
      { before = ("export LIMAX_LLM_URL=%s LIMAX_LLM_MODEL=m LIMAX_LLM_KEY=%s;"):format(
        server:url "varied", process.quote(model_stage.KEY)) })
    server:close()
    t:ok(not played.leaks(done.stdout .. done.stderr))
    search(t, folder .. "/live")
    compare_transcript(t, folder .. "/live")
    local ledger = talker.read(folder .. "/live").ledger
    for generation = 1, 3 do t:equal(ledger[generation + 1].source, "model") end
    process.completes(t, folder, { "run", script, "--out", "again", "--set",
      'supervisor=["replay"]', "--set", "supervisor.run=live", unpack(small) })
    evolution.same_files(t, folder .. "/again", folder .. "/live",
      { "metrics.jsonl", "ledger.jsonl" })
  end)

suite:test("without an endpoint no run begins", { limit = 30 }, function(t)
  local folder = t:folder()
  assert(host.file.write_atomic(folder .. "/none.lua", EXPERIMENT))
  local done = process.ends(folder, { "run", "none.lua", "--out", "r" },
    { before = "unset LIMAX_LLM_URL;" })
  t:equal(done.status, 2)
  t:ok(done.stderr:find('supervisor "llm": no endpoint of a language model is configured', 1, true),
    done.stderr)
  t:equal(host.file.exists(folder .. "/r"), nil)
  done = process.ends(folder, { "run", "none.lua", "--live-prompts", "--set", "supervisor=rules" })
  t:equal(done.status, 2)
  t:ok(done.stderr:find('the supervisor "rules" reads no prompts', 1, true), done.stderr)
end)
