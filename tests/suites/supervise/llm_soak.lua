--- llm_soak.lua: many generations under a model that fails in three requests of ten. Memory stays
--- flat, and ledger, transcript and timing agree. A thousand generations with --tags=full.

local host = require "limax.host"
local ledger = require "limax.supervise.ledger"
local talker = require "support.talker"

local suite = require("limax.test").suite "llm soak"

-- Failures of every class for 30 % of the requests, and answers of every kind; by the request's
-- hash, so that a run repeats.
local FAILURES = { "transport", "timeout", "http", "quota", "auth", "envelope", "budget", "breaker",
  "caps", "refusal", "filter", "context" }
local ANSWERS = { '{"mutation_rate": %s}', '```json\n{"mutation_rate": %s, "reason": "r"}\n```',
  '{"mutation_rate": "%s"}', '{"mutation_rate": %s', "no %s", '{"elites": %s}',
  '{"crossover_rate": %s, "mutation_scale": 0.2}', '{"mutation_rate": null, "reason": "%s"}' }

local function model(messages)
  local hash = host.sha256(messages[#messages].content)
  local function part(from) return tonumber(hash:sub(from, from + 3), 16) end
  if part(1) % 10 < 3 then
    return { class = FAILURES[part(5) % #FAILURES + 1], message = "as it happens" }
  end
  return { content = ANSWERS[part(9) % #ANSWERS + 1]:format(0.05 + part(13) / 65536 / 4),
    usage = { input_tokens = 900, output_tokens = 30 } }
end

-- kB by which memory may grow once, since allocators take it in steps.
local SLACK = 2048

local function kilobytes()
  return tonumber(io.open("/proc/self/status"):read("*a"):match "VmRSS:%s*(%d+)")
end

local function soak(t, generations)
  local heap, resident = {}, {}
  local supervisor = { "llm", client = talker.new(model), fallback = "random" }
  local done = talker.run(t, supervisor, { generations = generations,
    simulation = { duration = 0.05, settle = 0, accuracy = "preview" } }, {
    on_generation = function(entry)
      if entry.generation == math.floor(generations / 4) or entry.generation == generations - 1 then
        collectgarbage()
        collectgarbage()
        heap[#heap + 1], resident[#resident + 1] = collectgarbage "count", kilobytes()
      end
    end })

  -- the history keeps numbers, ledger line and robots of a generation
  local between = generations - 1 - math.floor(generations / 4)
  local of_one = (heap[2] - heap[1]) / between
  t:ok(heap[2] - heap[1] < SLACK + 40 * between, ("%.1f kB of the heap per generation"):format(
    of_one))
  t:ok(resident[2] - resident[1] < SLACK + 80 * between, ("%d kB more resident"):format(
    resident[2] - resident[1]))

  local outcomes, attempts = talker.of_kind(done, "outcome"), talker.of_kind(done, "attempt")
  t:equal({ #outcomes, #done.ledger, #done.timing }, { generations - 1, generations, generations })
  local counts, asked, tokens = {}, 0, 0
  for k, line in ipairs(outcomes) do
    local record, timing = done.ledger[k + 1], done.timing[k + 1].supervision
    t:equal({ line.generation, record.generation, record.source, record.reason },
      { k, k, line.source, line.reason })
    t:equal(record.entries, line.fields)
    t:equal(timing.asks, #line.asks)
    t:equal(timing.fallen_back, line.source ~= "model")
    t:equal(ledger.shares(record).accepted, timing.accepted)
    counts[line.source] = (counts[line.source] or 0) + 1
    for _, ask in ipairs(line.asks) do asked = asked + ask.attempts end
    tokens = tokens + (timing.input_tokens or 0)
  end
  t:equal(asked, #attempts)
  t:note(("%d model, %d random, %d attempts, %d tokens; %.1f kB of heap and %.1f kB resident per"
    .. " generation"):format(counts.model, counts.random or 0, asked, tokens, of_one,
    (resident[2] - resident[1]) / between))
  t:ok(tokens > 0 and tokens % 900 == 0)
  t:ok(counts.model > generations / 4 and counts.random > generations / 10)
end

suite:test("sixty generations", { limit = 120 }, function(t) soak(t, 60) end)

suite:test("a thousand generations", { limit = 1800, tags = "full" }, function(t)
  soak(t, 1000)
end)
