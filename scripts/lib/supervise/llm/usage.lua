--- usage.lua: tokens and cost: estimates, the totals of a client, and the caps that end it. A cost
--- is in the currency of the price.

local host = require "limax.host"

local usage = {}

-- Low for text that is mostly numbers: with an estimate that is too small, a server would cut the
-- prompt silently.
local BYTES_PER_TOKEN = 3
-- Most tokens that one answer or its prompt may be said to have, a hundred times what models take.
local MOST_TOKENS = 1e9

--- A count of tokens as an endpoint reports it; nil, unknown, unless it is a whole number from 0 to
--- 1e9.
function usage.count(value)
  local good = type(value) == "number" and value >= 0 and value <= MOST_TOKENS
    and value == math.floor(value)
  return good and value or nil
end

--- Estimated tokens of a list of messages.
function usage.estimate(messages)
  local bytes = 0
  for _, message in ipairs(messages) do bytes = bytes + #message.content end
  return math.ceil(bytes / BYTES_PER_TOKEN)
end

--- The totals of a client: requests sent, failed ones included; tokens as endpoints report them,
--- else estimates; and the cost, null without a price.
function usage.totals(price)
  return { calls = 0, input_tokens = 0, output_tokens = 0, cost = price and 0 or host.json.null }
end

local function cost_of(price, input, output)
  return price and (price.input * input + price.output * output) / 1e6
end

--- Why a prompt may not be sent; nil where it may.
---@param caps { max_calls?: integer, max_tokens_total?: number, max_cost?: number,
--- price?: { input: number, output: number } }
---@param prompt integer estimated tokens
function usage.refusal(caps, totals, prompt)
  if caps.max_calls and totals.calls >= caps.max_calls then
    return ("max_calls: %d requests have been sent"):format(totals.calls)
  end
  local used = totals.input_tokens + totals.output_tokens
  if caps.max_tokens_total and used + prompt > caps.max_tokens_total then
    return ("max_tokens_total: %.0f tokens are used, the next prompt has about %d, and the cap is"
      .. " %.0f"):format(used, prompt, caps.max_tokens_total)
  end
  if caps.max_cost and totals.cost + cost_of(caps.price, prompt, 0) > caps.max_cost then
    return ("max_cost: %.6g is spent, and the cap is %.6g"):format(totals.cost, caps.max_cost)
  end
end

--- Adds the tokens of an answer.
---@return number|nil cost nil without a price
function usage.add(totals, price, input, output)
  local cost = cost_of(price, input, output)
  totals.input_tokens = totals.input_tokens + input
  totals.output_tokens = totals.output_tokens + output
  totals.cost = cost and totals.cost + cost or totals.cost
  return cost
end

return usage
