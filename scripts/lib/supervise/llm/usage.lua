--- usage.lua: tokens and cost: estimates for a prompt, the totals of a client, and the caps that
--- end it. A cost is in the currency of the price. Where price or usage are unknown it is null, not
--- 0.

local host = require "limax.host"

local usage = {}

-- English prose has 4 to 4.5 bytes per token, JSON with numbers 2 to 3.5.
local BYTES_PER_TOKEN = 3.5
-- A chat template adds a few tokens to each message.
local PER_MESSAGE = 4
-- Most tokens that one answer or its prompt may be said to have, a hundred times what models take.
local MOST_TOKENS = 1e9
-- A server that counts less than this share of the estimate (8.75 bytes per token, twice what
-- prose has) has cut the prompt. In small prompts templates and rounding weigh too much.
local LEAST_SHARE, LEAST_PROMPT = 0.4, 500

--- A count of tokens as an endpoint reports it: a whole number from 0 to 1e9; nil, unknown, for
--- any other value.
---@param value any
---@return integer|nil
function usage.count(value)
  local good = type(value) == "number" and value >= 0 and value <= MOST_TOKENS
    and value == math.floor(value)
  return good and value or nil
end

--- Estimated tokens of a text.
function usage.tokens(text) return math.ceil(#text / BYTES_PER_TOKEN) end

--- Estimated tokens of a list of messages.
function usage.prompt_tokens(messages)
  local sum = 0
  for _, message in ipairs(messages) do sum = sum + usage.tokens(message.content) + PER_MESSAGE end
  return sum
end

--- Whether an endpoint cut a prompt without saying so.
---@param estimated integer tokens
---@param counted integer|nil tokens that the endpoint reports
function usage.is_cut(estimated, counted)
  return counted ~= nil and estimated >= LEAST_PROMPT and counted < LEAST_SHARE * estimated
end

---@class limax.llm.totals
---@field calls integer requests sent, failed ones included
---@field answers integer
---@field input_tokens number as endpoints report them
---@field output_tokens number
---@field estimated_tokens number of answers without a usage; they count towards the caps
---@field charged number the cost that the caps see, estimates included
---@field cost number|userdata of all answers; null as soon as one cost is unknown

function usage.totals(price)
  return { calls = 0, answers = 0, input_tokens = 0, output_tokens = 0, estimated_tokens = 0,
    charged = 0, cost = price and 0 or host.json.null }
end

local function cost_of(price, input, output)
  return price and (price.input * input + price.output * output) / 1e6
end

--- Why a prompt may not be sent; nil where it may.
---@param caps { max_calls?: integer, max_tokens_total?: number, max_cost?: number,
--- price?: { input: number, output: number } }
---@param prompt integer estimated tokens
---@return string|nil reason
function usage.refusal(caps, totals, prompt)
  if caps.max_calls and totals.calls >= caps.max_calls then
    return ("max_calls: %d requests have been sent"):format(totals.calls)
  end
  local used = totals.input_tokens + totals.output_tokens + totals.estimated_tokens
  if caps.max_tokens_total and used + prompt > caps.max_tokens_total then
    return ("max_tokens_total: %.0f tokens are used, the next prompt has about %d, and the cap is"
      .. " %.0f"):format(used, prompt, caps.max_tokens_total)
  end
  if caps.max_cost and totals.charged + cost_of(caps.price, prompt, 0) > caps.max_cost then
    return ("max_cost: %.6g is spent, and the cap is %.6g"):format(totals.charged, caps.max_cost)
  end
end

--- Adds an answer. Without a usage its estimates count towards the caps.
---@param used { input_tokens: integer, output_tokens: integer }|nil
---@param prompt integer estimated tokens
---@param written integer estimated tokens
---@return number|nil cost
function usage.add(totals, price, used, prompt, written)
  totals.answers = totals.answers + 1
  local input, output = prompt, written
  if used then
    input, output = used.input_tokens, used.output_tokens
    totals.input_tokens = totals.input_tokens + input
    totals.output_tokens = totals.output_tokens + output
  else
    totals.estimated_tokens = totals.estimated_tokens + input + output
  end
  local cost = cost_of(price, input, output)
  totals.charged = totals.charged + (cost or 0)
  if not used or not cost then
    totals.cost = host.json.null
    return nil
  end
  if totals.cost ~= host.json.null then totals.cost = totals.cost + cost end
  return cost
end

return usage
