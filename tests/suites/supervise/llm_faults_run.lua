--- llm_faults_run.lua: whole runs under the real client and a server that misbehaves: every fault
--- that it can play, one before each generation, and an endpoint that is dead in all repetitions.
--- The run goes on, ends at each generation's budget, records what happened and leaks no key.

local client = require "limax.supervise.llm.client"
local faulty_server = require "support.faulty_server"
local field_page = require "support.field_page"
local host = require "limax.host"
local played = require "support.played"
local process = require "support.process"
local source = require "limax.base.source"
local talker = require "support.talker"

local suite = require("limax.test").suite "llm faults run"

-- Seconds of a generation and of an attempt.
local BUDGET, TIMEOUT = 10, 1

-- A client that goes to another URL before each generation, as if for the first time, and does not
-- wait between attempts.
local function traveller(urls)
  return function(_, given)
    local made = {}
    function made:describe() return { endpoint = "http://127.0.0.1", model = "m" } end
    function made:state() return {} end
    function made:restore() end
    function made:ask(messages, asked)
      return client.new({ url = urls[asked.generation], model = "m", timeout = TIMEOUT }, {
        environment = function(name) return name == "LIMAX_LLM_KEY" and played.KEY or nil end,
        record = given.record, wait = function() end,
      }):ask(messages, asked)
    end
    return made
  end
end

-- Every file below a folder is searched for the key; returns how many there are.
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

suite:test("every fault, one before each generation of a run", { limit = 600 }, function(t)
  local server, urls = faulty_server.open(t), {}
  local names = server:names()
  for k, name in ipairs(names) do urls[k] = server:url(name) end
  for _, name in ipairs { "refused", "blackhole" } do
    names[#names + 1] = name
    urls[#names] = ("http://127.0.0.1:%d"):format(server.ports[name])
  end
  t:ok(#names > 100, "the server should know its faults")
  local done = talker.run(t, { "llm", client = traveller(urls), budget = BUDGET },
    { generations = #names + 1 })
  local outcomes, attempts = talker.of_kind(done, "outcome"), {}
  t:equal({ #outcomes, #done.ledger }, { #names, #names + 1 })
  local page = field_page.read "scripts/RUN_FOLDER.md"
  field_page.compare_transcript(t, source.read(done.folder .. "/transcript.jsonl"),
    { Attempt = field_page.tree(page, "Attempt"), Decision = field_page.tree(page, "Decision") })
  for _, line in ipairs(talker.of_kind(done, "attempt")) do
    attempts[line.generation] = (attempts[line.generation] or 0) + 1
  end
  -- what an attempt gave up before the server came to it is counted when it does
  local counts
  local function all_counted()
    counts = server:counts()
    for k, name in ipairs(names) do
      if counts[name] and counts[name].requests ~= attempts[k] then return false end
    end
    return true
  end
  local began = host.clock()
  while not all_counted() and host.clock() - began < played.LATE do host.wait(0.1) end
  local sources = {}
  for k, line in ipairs(outcomes) do
    local name = names[k]
    t:equal({ line.generation, done.ledger[k + 1].source }, { k, line.source })
    t:ok(line.seconds < BUDGET + played.LATE, ("%s: it took %.1f s"):format(name, line.seconds))
    local sent = counts[name] and counts[name].requests or attempts[k]
    t:ok(attempts[k] == sent and sent > 0,
      ("%s: %d attempts recorded, %d requests"):format(name, attempts[k], sent))
    local noted, usable = 0, false
    for _, ask in ipairs(line.asks) do
      noted = noted + ask.attempts
      usable = usable or not ask.failure and #ask.problems == 0
    end
    t:equal(noted, sent)
    t:ok((line.source == "model") == usable, name .. ": " .. line.source)
    t:ok(usable or line.why and not line.why:find "%c", name)
    sources[line.source] = (sources[line.source] or 0) + 1
  end
  t:ok(sources.model > 30 and sources.keep > 50)
  t:ok(counts.f49_echo.keys > 0, "the server should see the key")
  server:close()
  t:ok(search(t, done.folder) > #names)
  t:ok(not played.leaks(done.said), done.said)
  local again = talker.run(t, { "replay", run = done.folder }, { generations = #names + 1 })
  for _, name in ipairs { "metrics.jsonl", "ledger.jsonl" } do
    t:ok(source.read(again.folder .. "/" .. name) == source.read(done.folder .. "/" .. name), name)
  end
end)

local DEAD = [[
local limax = require "limax"
return limax.experiment { name = "dead", lattice = { 2, 2, 2 }, population = 4, generations = 21,
  repetitions = 3, simulation = { duration = 0.06, settle = 0, accuracy = "preview" },
  fitness = "distance", supervisor = { "llm", budget = 1 } }
]]

suite:test("an endpoint that is dead costs its budgets once, not in each repetition again",
  { limit = 120 }, function(t)
    local server, folder = faulty_server.open(t), t:folder()
    assert(host.file.write_atomic(folder .. "/dead.lua", DEAD))
    local function run(name, ...)
      local done = process.completes(t, folder, { "run", "dead.lua", "--out", name, "-q",
        "--device", "cpu", ... }, { before = ("export LIMAX_LLM_MODEL=m "
          .. "LIMAX_LLM_URL=http://127.0.0.1:%d;"):format(server.ports.refused) })
      -- told once in a repetition, not before each generation
      local _, told = done.stderr:gsub("generations until it is probed", "")
      t:ok(told >= 1 and told <= 3, done.stderr)
      local attempts = talker.of_kind(talker.read(folder .. "/" .. name), "attempt")
      local probes = 0
      for _, line in ipairs(attempts) do probes = probes + (line.probe and 1 or 0) end
      return { questions = #attempts - probes, probes = probes }
    end
    -- of 60 generations three were asked in; the 9th, the 20th and the 41st began with a probe, and
    -- so did the first of the second repetition, the 21st (that of the third is the 41st)
    t:equal(run("apart", "--apart"), { questions = 3, probes = 4 })
    t:equal(run("together", "--together"), { questions = 3, probes = 3 })
    t:equal(run("alone", "--repetition", "2"), { questions = 3, probes = 2 })
    local function same(one, other, name)
      t:ok(source.read(("%s/%s/%s"):format(folder, one, name))
        == source.read(("%s/%s/%s"):format(folder, other, name)), name)
    end
    same("together", "apart", "metrics.jsonl")
    same("alone", "apart", "r02/population/g0020.npy")
    same("alone", "apart", "r02/population/g0020.jsonl")
    server:close()
  end)
