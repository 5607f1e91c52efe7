--- llm_supervisor.lua: runs that a language model supervises, from prompt to transcript and replay.
--- A client of the suite's own replaces the model.

local evolution = require "support.evolution"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local source = require "limax.base.source"
local talker = require "support.talker"

local suite = require("limax.test").suite "llm supervisor"

local run, entry, of_kind = talker.run, talker.entry, talker.of_kind

suite:test("a proposal goes from the model through parser and ledger into the run", function(t)
  local seen = {}
  local done = run(t, { "llm", client = talker.new(function(messages, n)
    seen[n] = messages
    return ('```json\n{"mutation_rate": 0.%d, "reason": "step %d"}\n```'):format(15 + n, n)
  end) })
  t:equal({ seen[1][1].role, seen[1][2].role }, { "system", "user" })
  t:ok(seen[1][2].content:find("json", 1, true))
  for generation = 1, 3 do
    local line = done.ledger[generation + 1]
    t:equal({ line.supervisor, line.source, line.reason },
      { "llm", "model", "model: step " .. generation })
    t:near(entry(done, generation, "mutation_rate").applied, 0.15 + generation / 100)
  end
  t:equal(#of_kind(done, "attempt"), 3)
  t:equal(#of_kind(done, "outcome"), 3)
  for _, line in ipairs(of_kind(done, "attempt")) do
    t:ok(host.file.exists(("%s/prompts/%s.md"):format(done.folder, line.template_sha256)))
    t:equal(line.request_sha256, host.sha256(line.request))
  end
  t:equal(done.timing[2].supervision.accepted, 1)
end)

suite:test("rejected fields are asked about once more, and the second answer counts", function(t)
  local done = run(t, { "llm", client = talker.new(function(messages, n)
    if #messages == 2 then return '{"mutation_rate": "0.2", "elites": 3}' end
    t:equal(messages[3], { role = "assistant", content = '{"mutation_rate": "0.2", "elites": 3}' })
    t:ok(messages[4].content:find("mutation_rate: expected a finite number", 1, true))
    t:ok(n % 2 == 0)
    return '{"crossover_rate": 0.5}'
  end) })
  t:equal(entry(done, 1, "crossover_rate").outcome, "accepted")
  t:equal(entry(done, 1, "mutation_rate").outcome, "kept")
  t:equal(#of_kind(done, "attempt"), 6)
end)

suite:test("with a parser of the user's own, the form of the prompt is asked for", function(t)
  local function parse(text)
    local rate = tonumber(text:match "rate: (%S+)")
    if not rate then return nil, "expected rate: NUMBER" end
    return { mutation_rate = rate }
  end
  local format
  local function asked(options)
    local talk = talker.new(function(messages)
      if #messages == 2 then return "slugs are slow" end
      t:ok(messages[4].content:find("expected rate: NUMBER", 1, true), messages[4].content)
      t:equal(messages[4].content:find("mutation_rate", 1, true), nil)
      return "rate: 0.15"
    end)
    return { "llm", parse = options.parse, again = options.again, format = options.format,
      client = function(client_options, hooks)
        format = client_options.format
        return talk(client_options, hooks)
      end }
  end
  local done = run(t, asked { parse = parse })
  t:equal(entry(done, 1, "mutation_rate").applied, 0.15)
  t:equal(format, "plain")
  run(t, asked { parse = parse, format = "json_object" })
  t:equal(format, "json_object")

  local path = t:folder() .. "/mine.md"
  assert(host.file.write_atomic(path, "Wrong: {{problems}} Once more!\n"))
  run(t, { "llm", again = path, client = talker.new(function(messages)
    if #messages == 2 then return "slugs are slow" end
    t:ok(messages[4].content:find("^Wrong: .* Once more!"), messages[4].content)
    return '{"mutation_rate": 0.15}'
  end) })
end)

suite:test("without a usable answer the fallback proposes, or nothing changes", function(t)
  local silent = talker.new(function() return { class = "timeout", message = "no answer" } end)
  local done = run(t, { "llm", client = silent, fallback = function()
    return { crossover_rate = 0.45 }, "my own"
  end })
  t:equal(entry(done, 1, "crossover_rate").applied, 0.45)
  t:equal({ done.ledger[2].source, done.ledger[2].reason },
    { "function", "function instead: timeout: no answer; my own" })
  t:ok(done.timing[2].supervision.fallen_back)

  done = run(t, { "llm", client = silent })
  t:equal({ done.ledger[2].source, done.ledger[2].reason }, { "keep", "kept: timeout: no answer" })
  t:ok(done.output:find("before generation 1 the model was not used: timeout: no answer", 1, true))

  done = run(t, { "llm", client = silent, fallback = function() error "no idea" end })
  t:equal(done.ledger[2].source, "keep")
  t:ok(done.ledger[2].reason:find("no idea", 1, true), done.ledger[2].reason)
end)

-- ---- replay -------------------------------------------------------------------------------------

-- A model with every kind of answer: good, odd, refused, slow, none.
local function moody(messages, n)
  local answers = { '{"mutation_rate": 0.15, "reason": "up"}', '{"mutation_rate": "x"}',
    { class = "timeout", message = "no answer within 2 s" }, "I would rather not.",
    '<think>{"mutation_rate": 0.5}</think> {"crossover_rate": 0.9, "elites": 1}',
    { class = "breaker", message = "the endpoint is given a rest" } }
  return answers[(n + #messages) % #answers + 1]
end

local SAME = { "metrics.jsonl", "ledger.jsonl", "r01/population/g0011.jsonl",
  "r01/population/g0011.npy" }

local LONG = { generations = 12 }

suite:test("a replay gives the bytes of the recorded run and asks no model", { limit = 60 },
  function(t)
    local recorded = run(t, { "llm", client = talker.new(moody), fallback = "rules" }, LONG)
    local sets = {}
    for _, line in ipairs(recorded.ledger) do sets[line.source or "none"] = true end
    t:ok(sets.model and sets.rules, "the model should be used, and not always")
    for _, match in ipairs { "request", "generation" } do
      local again = run(t, { "replay", run = recorded.folder, match = match }, LONG)
      evolution.same_files(t, again.folder, recorded.folder, SAME)
      t:ok(not host.file.exists(again.folder .. "/transcript.jsonl"))
      local config = host.json.decode(source.read(again.folder .. "/config.json"))
      t:equal(config.supervisor.name, "replay")
    end
  end)

suite:test("a question asked in several generations gets the answer of each",
  { limit = 60 }, function(t)
    local prompt = t:folder() .. "/always.md"
    assert(host.file.write_atomic(prompt, "json {{answer}}"))
    local recorded = run(t, { "llm", prompt = prompt, client = talker.new(function(_, n)
      return ('{"mutation_rate": %.3f}'):format(0.1 + n / 500)
    end) }, LONG)
    local outcomes = of_kind(recorded, "outcome")
    t:equal(outcomes[1].asks[1].messages_sha256, outcomes[11].asks[1].messages_sha256)
    local again = run(t, { "replay", run = recorded.folder }, LONG)
    evolution.same_files(t, again.folder, recorded.folder, SAME)
  end)

suite:test("a replay that asks another question, or runs longer, ends with the reason",
  { limit = 60 }, function(t)
    local recorded = run(t, { "llm", client = talker.new(moody) })
    t:raises("the question of generation 1, repetition 1, differs", function()
      run(t, { "replay", run = recorded.folder }, { seed = 2 })
    end)
    local folder = t:folder() .. "/longer"
    t:raises("has no outcome of generation 4, repetition 1; a replay never asks a model",
      function()
        limax.start(talker.experiment({ "replay", run = recorded.folder, match = "generation" },
          { generations = 9 }), { out = folder, device = "cpu" }):finish()
      end)
    -- it is written asynchronously
    local began = host.clock()
    while host.clock() - began < process.LATE and source.read_json(folder .. "/checkpoint")
      .generation < 3 do host.wait(0.01) end
    t:equal(source.read_json(folder .. "/checkpoint").generation, 3)
    t:ok(run(t, { "replay", run = recorded.folder, match = "generation" }, { seed = 2 }))
  end)

suite:test("a broken transcript is refused before the run, a cut last line is not",
  { limit = 60 }, function(t)
    local recorded = run(t, { "llm", client = talker.new(moody) })
    local path = recorded.folder .. "/transcript.jsonl"
    local text = source.read(path)
    local function replayed(changed)
      assert(host.file.write_atomic(path, changed))
      return run(t, { "replay", run = recorded.folder })
    end
    t:ok(replayed(text .. '{"schema": "limax.transcript/1", "kind": "att'))
    t:raises("transcript.jsonl: line 1: expected schema limax.transcript/1, got limax.transcript/2",
      function() replayed((text:gsub("limax.transcript/1", "limax.transcript/2"))) end)
    t:raises("transcript.jsonl: line 2", function() replayed((text:gsub("\n", "\nbroken ", 1))) end)
    t:raises("expected kind attempt or outcome", function()
      replayed((text:gsub('"kind":"attempt"', '"kind":"guess"')))
    end)
    t:raises("expected a list as asks", function()
      replayed((text:gsub('"asks":%[.-%],"client"', '"client"')))
    end)
    t:raises("has no outcome of generation 3", function()
      replayed((text:gsub('[^\n]*"generation":3,"kind":"outcome"[^\n]*\n', "")))
    end)
    assert(host.file.remove(path))
    t:raises("only a run that a model supervised can be replayed", function()
      run(t, { "replay", run = recorded.folder })
    end)
    t:raises("is not a run folder", function()
      local other = t:folder()
      assert(host.file.write_atomic(other .. "/transcript.jsonl", text))
      run(t, { "replay", run = other })
    end)
  end)
