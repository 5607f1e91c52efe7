--- talker.lua: a client without a network, with the methods of limax.supervise.llm.client, which
--- gets its answers from a function; and tiny runs with it.

local evolution = require "support.evolution"
local host = require "limax.host"
local limax = require "limax"
local source = require "limax.base.source"

local talker = {}

--- Makes the `client` option of an experiment. `answer(messages, n)` gets the number of the
--- request in its repetition, also after a resume. Its result is a text, the answer's content, or a
--- table of the answer's fields, a failure if it has a class.
---@param answer fun(messages: table[], n: integer): string|table
---@return fun(options: table, context: table): table
function talker.new(answer)
  return function(_, context)
    local client, asked = {}, 0
    function client:describe()
      return { endpoint = "http://127.0.0.1:9/v1/chat/completions", model = "talker",
        provider = "none" }
    end
    function client:state() return { asked = asked } end
    function client:restore(state) asked = state.asked end
    function client:ask(messages)
      asked = asked + 1
      local result = answer(messages, asked)
      if type(result) == "string" then result = { content = result } end
      result.attempts, result.seconds = 1, 0
      local body = host.json.encode { model = "talker", messages = messages }
      context.record { time = host.time(), ms = 0, request = body,
        request_sha256 = host.sha256(body), http_status = 200, raw_body = result.content or "" }
      if result.class then return nil, result end
      return result
    end
    return client
  end
end

--- A tiny experiment with this supervisor.
---@param changes? table fields that replace its own
function talker.experiment(supervisor, changes)
  return evolution.small(evolution.with({ name = "tiny", population = 4, generations = 4,
    supervisor = supervisor, simulation = { duration = 0.06, settle = 0,
      accuracy = "preview" } }, changes))
end

---@class talker.done
---@field folder string
---@field ledger table[] lines; likewise metrics, timing and transcript
---@field output string what the run printed

--- Reads the files of a run.
function talker.read(folder)
  local done = { folder = folder }
  for _, name in ipairs { "ledger", "metrics", "timing", "transcript" } do
    done[name] = {}
    local place = name == "transcript" and "" or "r01/"
    for row in (source.read(("%s/%s%s.jsonl"):format(folder, place, name)) or ""):gmatch "[^\n]+" do
      table.insert(done[name], (assert(host.json.decode(row))))
    end
  end
  return done
end

--- Runs a tiny experiment in a new folder.
---@param changes? table fields of the experiment
---@param options? table of `limax.start`
function talker.run(t, supervisor, changes, options)
  local folder, printed = t:folder() .. "/run", {}
  limax.start(talker.experiment(supervisor, changes), evolution.with({ out = folder,
    device = "cpu", say = function(text) printed[#printed + 1] = text end }, options)):finish()
  local done = talker.read(folder)
  done.output = table.concat(printed, "\n")
  return done
end

--- The ledger's entry of a field before generation `generation`.
function talker.entry(done, generation, field)
  for _, each in ipairs(done.ledger[generation + 1].entries) do
    if each.field == field then return each end
  end
end

--- The transcript's attempts or outcomes.
function talker.of_kind(done, kind)
  local list = {}
  for _, line in ipairs(done.transcript) do
    if line.kind == kind then list[#list + 1] = line end
  end
  return list
end

return talker
