--- tokens.lua: how many tokens a prompt takes, estimated without the model's tokenizer, and whether
--- an endpoint has silently cut a prompt.

local tokens = {}

-- Bytes per token: prose in English takes 4 to 4.5, JSON with numbers 2 to 3.5.
local BYTES_PER_TOKEN = 3.5
-- A chat template wraps each message in a few tokens.
local PER_MESSAGE = 4
-- A prompt of which less than this share was counted is taken for cut: 8.75 bytes per token, twice
-- what prose takes. Small prompts are left out: templates and rounding weigh too much.
local LEAST_SHARE, LEAST_PROMPT = 0.4, 500

--- Tokens of a text, estimated.
---@param text string
---@return integer
function tokens.of(text) return math.ceil(#text / BYTES_PER_TOKEN) end

--- Tokens of a list of messages, estimated.
---@param messages { role: string, content: string }[]
---@return integer
function tokens.estimate(messages)
  local sum = 0
  for _, message in ipairs(messages) do sum = sum + tokens.of(message.content) + PER_MESSAGE end
  return sum
end

--- Whether the endpoint counted far fewer tokens than the prompt has: it cut the prompt.
---@param estimated integer
---@param counted integer|nil
---@return boolean
function tokens.cut(estimated, counted)
  return counted ~= nil and estimated >= LEAST_PROMPT and counted < LEAST_SHARE * estimated
end

return tokens
