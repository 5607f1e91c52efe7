--- replay.lua: the answers of a recorded run come back, from the transcript in its folder: by the
--- request that they answered (strict: the same question must be asked again), or by generation.

local schema = require "limax.base.schema"

-- The options of `llm` that say what is asked.
local llm = require "limax.supervise.llm"

return {
  options = {
    run = schema.text("[^%c]+", "the path of a run folder"),
    match = schema.choice { "request", "generation" },
    prompt = llm.options.prompt, context = llm.options.context,
    context_tokens = llm.options.context_tokens,
  },
  start = function(options, run) return require("limax.supervise.llm.replay").start(run, options) end,
}
