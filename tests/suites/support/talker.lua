--- talker.lua: a client that needs no network: it has the methods of scripts/lib/llm/client.lua and
--- answers as a function says. Experiments of a suite take it as `client`.

local host = require "limax.host"

local talker = {}

--- What `answer(messages, n)` returned as the answer of a client: a text is its content, a table
--- its fields, or a failure if it has a class.
local function shaped(given)
  if type(given) == "string" then given = { content = given } end
  given.attempts, given.seconds = given.attempts or 1, given.seconds or 0
  return given
end

--- Makes the `client` option of an experiment. `answer(messages, n, request)` gets the number of
--- this request in its repetition, across resumes.
---@param answer fun(messages: table[], n: integer, request: table): string|table
---@return fun(options: table, given: table): table
function talker.new(answer)
  return function(_, given)
    local client, asked = {}, 0
    function client:describe()
      return { endpoint = "http://127.0.0.1:9/v1/chat/completions", model = "talker",
        provider = "none" }
    end
    function client:state() return { asked = asked } end
    function client:restore(state) asked = state.asked end
    function client:ask(messages, request)
      asked = asked + 1
      local said = shaped(answer(messages, asked, request))
      local body = host.json.encode { model = "talker", messages = messages }
      given.record { time = host.time(), ms = 0, request = body, request_sha256 = host.sha256(body),
        http_status = 200, raw_body = said.content or "", ["gen_ai.request.model"] = "talker" }
      if said.class then return nil, said end
      return said
    end
    return client
  end
end

return talker
