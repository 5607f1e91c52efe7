--- llm_resume.lua: a run under a language model that is killed resumes with the recorded answers,
--- asks only for missing ones, and gives the bytes of an uninterrupted run. A replay gives the
--- bytes of the recorded run.

local reader = require "limax.run.reader"
local engine = require "limax.engine"
local evolution = require "support.evolution"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local sealed = require "limax.base.sealed"
local source = require "limax.base.source"
local talker = require "support.talker"

local suite = require("limax.test").suite "llm resume"

-- The model's answer follows from the request's bytes and from how often it was asked: what a
-- resume would lose shows in the numbers. Each request is noted in a file of its own and takes a
-- moment, so that a kill hits some of them on their way.
local EXPERIMENT = [[
local limax = require "limax"
local host = require "limax.host"

local function model(_, hooks)
  local client, asked = {}, 0
  function client:describe() return { endpoint = "http://127.0.0.1:9/v1", model = "hash" } end
  function client:state() return { asked = asked } end
  function client:restore(state) asked = state.asked end
  function client:ask(messages)
    asked = asked + 1
    local body = host.json.encode(messages)
    local hash = host.sha256(body)
    host.file.append("asked", hash .. "\n")
    hooks.record { time = host.time(), ms = 20, request = body, request_sha256 = hash,
      http_status = 200, raw_body = hash }
    local until_then = host.clock() + 0.02
    while host.clock() < until_then do host.raise_if_interrupted() end
    local kind = tonumber(hash:sub(1, 2), 16) % 5
    if kind == 0 then return nil, { class = "timeout", message = "no answer", attempts = 1 } end
    local content = ('{"mutation_rate": %.4f, "mutation_scale": %.4f}'):format(
      0.05 + tonumber(hash:sub(3, 6), 16) / 65536 / 4, 0.08 + asked / 1000)
    if kind == 1 then content = content:sub(1, -9) end
    return { content = content, attempts = 1, seconds = 0.02, usage = { input_tokens = 9 } }
  end
  return client
end

return limax.experiment {
  name = "talk", lattice = { 2, 2, 2 }, population = 6, generations = GENERATIONS, repetitions = 2,
  simulation = { duration = 0.1, settle = 0, accuracy = "preview" },
  fitness = function(robot)
    -- the process ends while the generation is scored that the last answer was for
    if robot.generation == 5 and host.file.exists "die" then
      host.file.remove "die"
      host.exit(3)
    end
    return robot:distance()
  end,
  supervisor = { "llm", client = model, fallback = "random" },
}
]]

local completes, ON_CPU = process.completes, { "--device", "cpu", "-q" }

local RESUMED = { "r01/metrics.jsonl", "r01/ledger.jsonl", "r01/genomes/g0019.npy",
  "r02/genomes/g0019.npy", "r02/robots/g0019.npy" }

-- Requests on disk, and how many of them differ.
local function asked(folder)
  local list, distinct, seen = 0, 0, {}
  for hash in (source.read(folder .. "/asked") or ""):gmatch "%x+" do
    list = list + 1
    if not seen[hash] then distinct = distinct + 1 end
    seen[hash] = true
  end
  return list, distinct
end

suite:test("kills at random moments change no byte and repeat few questions", { limit = 120 },
  function(t)
    local folder = t:folder()
    process.write(folder .. "/talk.lua", (EXPERIMENT:gsub("GENERATIONS", 20)))
    completes(t, folder, { "run", "talk.lua", "--out", "whole", unpack(ON_CPU) })
    local uninterrupted = asked(folder)
    assert(host.file.remove(folder .. "/asked"))
    local random = engine.random(11, 1, "user", 1, 1)
    local kills, words = 0, { "run", "talk.lua", "--out", "broken", unpack(ON_CPU) }
    repeat
      -- after some further questions, and a part of the time between two
      local enough = asked(folder) + 3 + random:integer(math.floor(uninterrupted / 5))
      local child = process.start(folder, words)
      child:signal_when(kills % 2 == 0 and "KILL" or "INT", function()
        return asked(folder) >= enough and (host.wait(0.03 * random:uniform()) or true)
      end)
      local status = child:finish()
      if status ~= 0 then kills = kills + 1 end
      if host.file.exists(folder .. "/broken/config.json") then
        words = { "run", "--resume", "broken", kills % 3 == 0 and "--together" or "--apart",
          unpack(ON_CPU) }
      end
    until status == 0
    t:ok(kills > 2, "the run should be killed a few times")
    evolution.same_files(t, folder .. "/broken", folder .. "/whole", RESUMED)
    -- a question is repeated only if a kill hit the generation that it was asked for
    local all, distinct = asked(folder)
    t:equal(distinct, uninterrupted)
    t:ok(all <= uninterrupted + 2 * kills,
      ("%d questions, %d uninterrupted"):format(all, uninterrupted))
    t:note(("%d kills, %d questions instead of %d"):format(kills, all, uninterrupted))
  end)

suite:test("a resumed run reports a changed prompt and continues with it", { limit = 60 },
  function(t)
    local folder = t:folder()
    process.write(folder .. "/talk.lua", (EXPERIMENT:gsub("GENERATIONS", 8)
      :gsub("fallback = ", 'prompt = "my.md", fallback = ')))
    process.write(folder .. "/my.md", "json one {{generations}} {{answer}}")
    process.write(folder .. "/die", "")
    t:equal(process.ends(folder, { "run", "talk.lua", "--out", "r", "--repetition", "1",
      unpack(ON_CPU) }).status, 3)
    local second = "json two {{generations}} {{answer}}"
    process.write(folder .. "/my.md", second)
    process.fails(t, folder, 2, { "run", "--resume", "r", unpack(ON_CPU) }, "my.md has changed:")
    local done = completes(t, folder, { "run", "--resume", "r", "--changed", unpack(ON_CPU) })
    t:ok(done.stderr:find("my.md has changed since generation 4", 1, true), done.stderr)
    t:equal(source.read(("%s/r/prompts/%s.md"):format(folder, host.sha256(second))), second)
    -- generation 5 had an answer to the first prompt: the question is another now, and asked again
    local decisions = 0
    for line in source.read(folder .. "/r/transcript.jsonl"):gmatch "[^\n]+" do
      if line:find('"generation":5,"kind":"outcome"', 1, true) then decisions = decisions + 1 end
    end
    t:equal(decisions, 2)
  end)

-- ---- replay -------------------------------------------------------------------------------------

-- A model with every kind of answer.
local function moody(messages, n)
  local answers = { '{"mutation_rate": 0.15, "reason": "up"}', '{"mutation_rate": "x"}',
    { class = "timeout", message = "no answer within 2 s" }, "I would rather not.",
    '<think>{"mutation_rate": 0.5}</think> {"crossover_rate": 0.9, "elites": 1}',
    { class = "breaker", message = "the endpoint is not asked" } }
  return answers[(n + #messages) % #answers + 1]
end

local SAME = { "r01/metrics.jsonl", "r01/ledger.jsonl", "r01/robots/g0011.npy",
  "r01/genomes/g0011.npy" }

local LONG = { generations = 12 }
local run = talker.run

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
    end
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
    while host.clock() - began < process.LATE and reader.read(folder):last(1) < 3 do
      host.wait(0.01)
    end
    t:equal(reader.read(folder):last(1), 3)
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
    -- as somebody would change it who knows how limax works
    local function sealed_again(from, to)
      return (text:gsub(from, to):gsub("[^\n]+", function(line)
        return sealed.add((line:gsub('"hash":"%x+",', "", 1)))
      end))
    end
    t:ok(replayed(text .. '{"schema": "limax.transcript/1", "kind": "att'))
    for expected, changed in pairs {
      ["line 1: does not match its hash"] = text:gsub("limax.transcript/1", "limax.transcript/2"),
      ["transcript.jsonl: line 2"] = text:gsub("^([^\n]*\n)", "%1broken "),
      ["schema: expected one of"] =
        sealed_again("limax.transcript/1", "limax.transcript/2"),
      ["asks: expected a list"] = sealed_again('"asks":%[.-%],"client"', '"asks":5,"client"'),
      ["template_sha256: expected 64 hexadecimal digits"] =
        sealed_again('"template_sha256":"%x+"', '"template_sha256":"../../x"'),
      ["has no outcome of generation 3"] =
        text:gsub('[^\n]*"generation":3,"kind":"outcome"[^\n]*\n', ""),
    } do t:raises(expected, function() replayed(changed) end) end
    assert(host.file.remove(path))
    t:raises("only a run that a model supervised can be replayed", function()
      run(t, { "replay", run = recorded.folder })
    end)
  end)
