--- played.lua: plays scenarios of the faulty server to a client and checks what holds for all of
--- them: the deadline, a record for each attempt, no key in any output.

local base64 = require "limax.base.base64"
local client = require "limax.supervise.llm.client"
local host = require "limax.host"
local process = require "support.process"

local played = {}

local KEY = "sk-SENTINEL/0123+456789=abcdef"
local BUDGET = 60 -- s; no scenario needs more on a slow machine

played.KEY = KEY
played.GOOD = '{"mutation_rate": 0.2}' -- the server's good answer

--- The form in which a text shows the key; nil where it does not.
---@param text string
---@return string|nil
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
---@field real? boolean wait between attempts

--- Asks once and checks what holds for all scenarios.
function played.once(t, server, name, how)
  how = how or {}
  local records, waits = {}, {}
  local options = { url = how.url or server:url(name), model = "m", budget = BUDGET }
  for key, value in pairs(how.options or {}) do options[key] = value end
  local made = t:ok(client.new(options, {
    environment = function(variable) return variable == "LIMAX_LLM_KEY" and KEY or nil end,
    random = function() return 0 end,
    record = function(record) records[#records + 1] = record end,
    wait = how.real and host.wait or function(seconds) waits[#waits + 1] = seconds end,
  }))
  local start = host.clock()
  local answer, failure = made:ask({ { role = "user", content = "Propose something as JSON." } },
    { schema = { type = "object" }, name = "proposal" })
  local took = host.clock() - start
  t:ok(took < options.budget + process.LATE, ("%s: it took %.1f s"):format(name, took))
  local output = host.json.encode { answer = answer, failure = failure, records = records,
    state = made:state(), description = made:describe() }
  local leak = played.leaks(output)
  t:ok(not leak, ("%s: the key shows as %s"):format(name, tostring(leak)))
  t:equal(#records, (answer or failure).attempts)
  return { answer = answer, failure = failure, records = records, waits = waits, took = took,
    class = failure and failure.class or "answer", requests = #records,
    kind = records[1] and records[1].curl_kind, message = failure and failure.message or "" }
end

--- Plays scenarios: rows of { name, class, requests, kind of curl or nil, text of the message or
--- nil }.
function played.all(t, server, rows, options)
  for _, row in ipairs(rows) do
    local name, class, requests, kind, text = unpack(row, 1, 5)
    local result = played.once(t, server, name, { options = options })
    t:equal({ name, result.class, result.requests, kind and result.kind },
      { name, class, requests, kind })
    t:ok(not text or result.message:find(text, 1, true), name .. ": " .. result.message)
    if class == "answer" then t:equal(result.answer.content, played.GOOD) end
  end
  local counts = server:counts()
  for _, row in ipairs(rows) do t:equal({ row[1], counts[row[1]].requests }, { row[1], row[3] }) end
end

return played
