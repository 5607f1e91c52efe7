--- played.lua: plays scenarios of the faulty server to a client, and holds everything that comes
--- out against the laws for all faults: the deadline, a record for each attempt, no key.

local base64 = require "limax.supervise.llm.base64"
local client = require "limax.supervise.llm.client"
local host = require "limax.host"
local process = require "support.process"

local played = {}

local KEY = "sk-SENTINEL/0123+456789=abcdef"
local LATE = process.LATE
local BUDGET = 60 -- s; no fault here needs more, on a slow machine too

played.KEY, played.LATE = KEY, LATE
played.GOOD = '{"mutation_rate": 0.2}' -- what the server's good answers say
played.MESSAGES = { { role = "user", content = "Propose something as JSON." } }

--- What would give the key away: its first eight characters, base64, percent, hexadecimal.
function played.leaks(text)
  local hex = KEY:gsub(".", function(letter) return ("%02x"):format(letter:byte()) end)
  for _, form in ipairs { KEY:sub(1, 8), "SENTINEL", base64.encode(KEY):sub(1, 11),
    base64.encode("user:" .. KEY):sub(9, 20), "SENTINEL%2F0123", hex:sub(1, 16) } do
    if text:find(form, 1, true) then return form end
  end
  return nil
end

---@class played.how
---@field url? string instead of the scenario's own
---@field options? table of the client
---@field messages? table
---@field asked? table of the question
---@field real? boolean waits are waited for

--- Asks once; holds everything that came out against the laws for all faults.
function played.once(t, server, name, how)
  how = how or {}
  local records, waits = {}, {}
  local options = { url = how.url or server:url(name), model = "m", budget = BUDGET }
  for key, value in pairs(how.options or {}) do options[key] = value end
  local made, message = client.new(options, {
    environment = function(variable) return variable == "LIMAX_LLM_KEY" and KEY or nil end,
    random = function() return 0 end,
    record = function(record) records[#records + 1] = record end,
    wait = how.real and host.wait or function(seconds) waits[#waits + 1] = seconds end,
  })
  t:ok(made, message)
  local start = host.clock()
  local answer, failure = made:ask(how.messages or played.MESSAGES, how.asked or
    { schema = { type = "object" }, name = "proposal" })
  local took = host.clock() - start
  t:ok(took < options.budget + LATE, ("%s: it took %.1f s"):format(name, took))
  local said = host.json.encode { answer = answer, failure = failure, records = records,
    state = made:state(), description = made:describe() }
  local leak = played.leaks(said)
  t:ok(not leak, ("%s: the key shows as %s"):format(name, tostring(leak)))
  t:equal(#records, (answer or failure).attempts)
  if failure then
    t:ok(not failure.message:find "%c" and #failure.message < 500, failure.message)
  end
  return { answer = answer, failure = failure, records = records, waits = waits, took = took,
    class = failure and failure.class or "answer", client = made, requests = #records }
end

--- Plays scenarios of a table { name, class, requests, waits or nil, text of the message or nil }.
function played.all(t, server, cases)
  local expected = {}
  for _, case in ipairs(cases) do
    local name, class, requests, waits, text = unpack(case, 1, 5)
    local came = played.once(t, server, name, { options = case.options, messages = case.messages })
    t:ok(came.class == class and came.requests == requests, ("%s: %s after %d requests%s")
      :format(name, came.class, came.requests, came.failure and ": " .. came.failure.message or ""))
    if waits then t:equal(came.waits, waits) end
    if text then t:ok(came.failure.message:find(text, 1, true), came.failure.message) end
    if class == "answer" then
      local content = came.answer.content
      t:ok(content == (case.content or played.GOOD), name .. ": " .. content)
    end
    if case.check then case.check(came) end
    expected[name] = requests
  end
  local counts = server:counts()
  for name, requests in pairs(expected) do
    t:ok(counts[name].requests == requests, ("%s: the server counted %d requests"):format(name,
      counts[name].requests))
  end
end

return played
