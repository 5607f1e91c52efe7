--- model_stage.lua: a client of a language model whose HTTP function, clock, waits and environment
--- are the test's. It notes everything that happens.

local client = require "limax.supervise.llm.client"
local host = require "limax.host"

local model_stage = {}

model_stage.KEY = "sk-SENTINEL/0123+456789=abcdef"
model_stage.MESSAGES = { { role = "user", content = "Propose something as JSON." } }

--- A client whose requests get `answers` one after the other, the last one repeatedly: an answer, a
--- function of the request, or { kind = } for a failure below HTTP. `takes` is its seconds.
---@param options table|nil
---@param answers table
---@param environment table<string, string>|nil
---@return limax.llm.client
---@return { requests: table[], bodies: table[], records: table[], waits: table, now: number }
function model_stage.new(options, answers, environment)
  local notes = { requests = {}, bodies = {}, records = {}, waits = {}, now = 1000 }
  environment = environment or { LIMAX_LLM_URL = "http://127.0.0.1:1", LIMAX_LLM_MODEL = "m",
    LIMAX_LLM_KEY = model_stage.KEY }
  return assert(client.new(options or {}, {
    clock = function() return notes.now end,
    wait = function(seconds)
      notes.waits[#notes.waits + 1] = seconds
      notes.now = notes.now + seconds
    end,
    record = function(record) notes.records[#notes.records + 1] = record end,
    environment = function(name) return environment[name] end,
    http = function(request)
      notes.requests[#notes.requests + 1] = request
      notes.bodies[#notes.bodies + 1] = host.json.decode(request.body)
      local answer = answers[math.min(#notes.requests, #answers)]
      if type(answer) == "function" then answer = answer(request) end
      notes.now = notes.now + (answer.takes or 0)
      if answer.kind then
        notes.now = notes.now + (answer.kind == "timeout" and request.timeout or 0)
        return nil, "http://127.0.0.1:1: " .. answer.kind, { kind = answer.kind, curl = "curl",
          status = 0, headers = {}, body = "" }
      end
      return { status = answer.status or 200, headers = answer.headers or {},
        body = type(answer.body) == "table" and host.json.encode(answer.body) or answer.body }
    end,
  })), notes
end

--- A good answer with this text, its fields changed.
function model_stage.completion(content, fields)
  local body = { id = "c1", model = "m-1",
    choices = { { message = { role = "assistant", content = content }, finish_reason = "stop" } },
    usage = { prompt_tokens = 100, completion_tokens = 20 } }
  for name, value in pairs(fields or {}) do body[name] = value end
  return { body = body }
end

--- Does a text show the key, or a part of it?
function model_stage.leaks(text) return text:find("SENTINEL", 1, true) ~= nil end

return model_stage
