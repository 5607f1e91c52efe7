--- replay.lua: applies the answers of a recorded run again, from the transcript in its folder: by
--- the request that they answered (the same question must be asked again), or by generation.

local llm = require "limax.supervise.llm"
local schema = require "limax.engine.schema"

return {
  options = {
    run = schema.text("[^%c]+", "the path of a run folder"),
    match = schema.choice { "request", "generation" },
    prompt = llm.options.prompt, context = llm.options.context,
    context_tokens = llm.options.context_tokens,
  },
  start = function(options, run)
    return require("limax.supervise.llm.replay").start(run, options)
  end,
}
