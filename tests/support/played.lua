--- played.lua: plays a scenario of the faulty server to a client and checks what holds for all of
--- them: the deadline, a record for each attempt, no key in any output.

local base64 = require "limax.base.base64"
local client = require "limax.supervise.llm.client"
local host = require "limax.host"
local model_stage = require "support.model_stage"
local process = require "support.process"

local played = {}

local KEY = model_stage.KEY
local BUDGET = 60 -- s; no scenario needs more on a slow machine

--- The form in which a text shows the key; nil where it does not.
function played.leaks(text)
  local hex = KEY:gsub(".", function(letter) return ("%02x"):format(letter:byte()) end)
  for _, form in ipairs { KEY:sub(1, 8), "SENTINEL", base64.encode(KEY):sub(1, 11),
    base64.encode("user:" .. KEY):sub(9, 20), "SENTINEL%2F0123", hex:sub(1, 16) } do
    if text:find(form, 1, true) then return form end
  end
end

--- Asks once and checks what holds for all scenarios.
---@param options? table of the client, instead of the scenario's own
---@param real? boolean waits between attempts
function played.once(t, server, name, options, real)
  local records, waits, all = {}, {}, { url = server:url(name), model = "m", budget = BUDGET }
  for key, value in pairs(options or {}) do all[key] = value end
  local made = t:ok(client.new(all, {
    environment = function(variable) return variable == "LIMAX_LLM_KEY" and KEY or nil end,
    random = function() return 0 end,
    record = function(record) records[#records + 1] = record end,
    wait = real and host.wait or function(seconds) waits[#waits + 1] = seconds end,
  }))
  local start = host.clock()
  local answer, failure = made:ask(model_stage.MESSAGES,
    { schema = { type = "object" }, name = "proposal" })
  local took = host.clock() - start
  t:ok(took < all.budget + process.LATE, ("%s: it took %.1f s"):format(name, took))
  local leak = played.leaks(host.json.encode { answer = answer, failure = failure,
    records = records, state = made:state(), description = made:describe() })
  t:ok(not leak, ("%s: the key shows as %s"):format(name, tostring(leak)))
  t:equal(#records, (answer or failure).attempts)
  return { answer = answer, records = records, waits = waits, took = took,
    class = failure and failure.class or "answer", requests = #records,
    kind = records[1] and records[1].curl_kind, message = failure and failure.message or "" }
end

return played
