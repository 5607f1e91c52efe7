--- check.lua: the language model in `limax doctor`: the endpoint, where the key comes from, and, if
--- asked for, whether it answers.

local client = require "limax.supervise.llm.client"

local check = {}

-- A local server may have to load its model first.
local BUDGET = 120 -- s
local QUESTION = { { role = "user",
  content = 'Answer with this JSON object and nothing else: {"mutation_rate": 0.1}' } }
local SCHEMA = { type = "object", additionalProperties = false, required = { "mutation_rate" },
  properties = { mutation_rate = { type = "number" } } }

--- Describes the endpoint that the environment names. Only with `ask` is anything sent: one short
--- question. Returns `configured`, `missing` (why no endpoint can be asked), `endpoint`, `model`,
--- `provider`, `key` (its source); and if it was asked `answered`, `seconds`, `form`, `usage`,
--- `failure`.
function check.gather(ask)
  local made, missing = client.new { budget = BUDGET }
  if not made then return { configured = false, missing = missing } end
  local facts = made:describe()
  facts.configured = true
  if not ask then return facts end
  local answer, failure = made:ask(QUESTION, { schema = SCHEMA, name = "proposal" })
  facts.answered, facts.seconds = answer ~= nil, (answer or failure).seconds
  if failure then
    facts.failure = ("%s: %s"):format(failure.class, failure.message)
  else
    facts.form, facts.usage = made.shared.form.format, answer.usage
  end
  return facts
end

--- The line of `limax doctor`: a mark, "ok", "bad" or "", and a text.
---@return string mark
---@return string text
function check.line(facts)
  if not facts.configured then return "", "none: " .. facts.missing end
  local text = ("%s, model %s, %s"):format(facts.endpoint, facts.model,
    facts.key and "key from " .. facts.key or "no key")
  if facts.answered == nil then return "ok", text .. "; not asked (--llm asks it)" end
  if not facts.answered then
    return "bad", ("%s; no answer after %.1f s: %s"):format(text, facts.seconds, facts.failure)
  end
  local usage = facts.usage
  return "ok", ("%s; answered in %.1f s, form %s, %s"):format(text, facts.seconds, facts.form,
    usage and ("%d + %d tokens"):format(usage.input_tokens, usage.output_tokens)
    or "tokens not reported")
end

return check
