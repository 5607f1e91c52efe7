--- usage.lua: counts and estimates of tokens, and the caps that end a client.

local usage = {}

-- for text that is mostly numbers
local BYTES_PER_TOKEN = 3
-- most tokens that an endpoint may report for an answer or its prompt: a hundred times a model's
-- context
local MOST_TOKENS = 1e9

--- A count of tokens as an endpoint reports it; nil unless it is a whole number from 0 to 1e9.
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

--- Has an endpoint cut a prompt without saying so? Prose has at most 5 bytes per token; in small
--- prompts templates weigh too much.
---@param estimated integer tokens
---@param counted integer|nil tokens that the endpoint reports
function usage.is_cut(estimated, counted)
  return counted ~= nil and estimated >= 500 and counted < estimated / 3
end

--- Why a prompt may not be sent; nil if it may.
---@param caps { max_calls?: integer, max_tokens_total?: number }
---@param spent { calls: integer, input_tokens: number, output_tokens: number } failed requests too
---@param prompt integer estimated tokens
function usage.refusal(caps, spent, prompt)
  if caps.max_calls and spent.calls >= caps.max_calls then
    return ("max_calls: %d requests have been sent"):format(spent.calls)
  end
  local used = spent.input_tokens + spent.output_tokens
  if caps.max_tokens_total and used + prompt > caps.max_tokens_total then
    return ("max_tokens_total: %.0f tokens are used, the next prompt has about %d, and the cap is"
      .. " %.0f"):format(used, prompt, caps.max_tokens_total)
  end
end

return usage
