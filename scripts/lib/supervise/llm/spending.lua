--- spending.lua: what a client has used: calls, tokens, cost, and the caps that end it. A cost is
--- in the currency of the price, and unknown, never 0, where price or usage are.

local host = require "limax.host"

local spending = {}

---@class limax.llm.spending
---@field caps { max_calls?: integer, max_tokens_total?: number, max_cost?: number,
--- price?: { input: number, output: number } }
---@field calls integer requests sent, failed ones too
---@field answers integer
---@field input_tokens number as endpoints reported them
---@field output_tokens number
---@field estimated_tokens number of answers that reported none; they count towards the caps
---@field charged number the cost that the caps see, estimates included
---@field cost number|nil of all answers; nil as soon as that of one is unknown
local methods = {}
local class = { __index = methods }

---@param caps table
---@return limax.llm.spending
function spending.new(caps)
  return setmetatable({ caps = caps, calls = 0, answers = 0, input_tokens = 0, output_tokens = 0,
    estimated_tokens = 0, charged = 0, cost = caps.price and 0 or nil }, class)
end

local function cost_of(price, input, output)
  return price and (price.input * input + price.output * output) / 1e6
end

--- Why a prompt of so many tokens may not be sent; nil where it may.
---@param prompt integer tokens, estimated
---@return string|nil reason
function methods:refusal(prompt)
  local caps = self.caps
  if caps.max_calls and self.calls >= caps.max_calls then
    return ("max_calls: %d requests have been sent"):format(self.calls)
  end
  local used = self.input_tokens + self.output_tokens + self.estimated_tokens
  if caps.max_tokens_total and used + prompt > caps.max_tokens_total then
    return ("max_tokens_total: %.0f tokens are used, the next prompt has about %d, and %.0f are the"
      .. " cap"):format(used, prompt, caps.max_tokens_total)
  end
  if caps.max_cost and self.charged + cost_of(caps.price, prompt, 0) > caps.max_cost then
    return ("max_cost: %.6g is spent, and %.6g is the cap"):format(self.charged, caps.max_cost)
  end
  return nil
end

--- A request is about to be sent.
function methods:count() self.calls = self.calls + 1 end

--- Books an answer. Without a usage the estimates stand for it in the caps, and the cost of all is
--- unknown from then on.
---@param usage { input_tokens: integer, output_tokens: integer }|nil
---@param prompt integer tokens, estimated
---@param written integer tokens, estimated
---@return number|nil cost
function methods:book(usage, prompt, written)
  local price = self.caps.price
  self.answers = self.answers + 1
  if not usage then
    self.estimated_tokens = self.estimated_tokens + prompt + written
    self.charged = self.charged + (cost_of(price, prompt, written) or 0)
    self.cost = nil
    return nil
  end
  self.input_tokens = self.input_tokens + usage.input_tokens
  self.output_tokens = self.output_tokens + usage.output_tokens
  local cost = cost_of(price, usage.input_tokens, usage.output_tokens)
  self.charged = self.charged + (cost or 0)
  if self.cost then self.cost = self.cost + cost end
  return cost
end

local NUMBERS = { "calls", "answers", "input_tokens", "output_tokens", "estimated_tokens",
  "charged" }

--- Plain values, for a checkpoint; an unknown cost is null.
---@return table
function methods:state()
  local state = { cost = self.cost or host.json.null }
  for _, name in ipairs(NUMBERS) do state[name] = self[name] end
  return state
end

---@param state table
function methods:restore(state)
  for _, name in ipairs(NUMBERS) do self[name] = state[name] end
  self.cost = state.cost ~= host.json.null and state.cost or nil
end

return spending
