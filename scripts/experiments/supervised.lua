--- supervised.lua: walk.lua with a language model, which may change the algorithm's parameters and
--- the materials before each generation. 40 seconds on two cores plus the time of 39 answers. It
--- needs an endpoint, for instance one on this machine, either of:
---
---   llama-server -m model.gguf --port 8080 -c 8192
---   export LIMAX_LLM_URL=http://127.0.0.1:8080 LIMAX_LLM_MODEL=any
---
---   OLLAMA_CONTEXT_LENGTH=8192 ollama serve
---   export LIMAX_LLM_URL=http://127.0.0.1:11434 LIMAX_LLM_MODEL=qwen2.5:7b
---
--- Run it with: limax run scripts/experiments/supervised.lua
--- Repeat it later without a network, with the same bytes:
---   limax run scripts/experiments/supervised.lua --set 'supervisor=["replay"]'
---     --set supervisor.run=runs/supervised-1

local limax = require "limax"

return limax.experiment {
  name = "supervised",
  genome = { sigma = 0.25 },
  simulation = { duration = 5, settle = 0.5, accuracy = "evolve" }, -- s
  population = 30, generations = 40, repetitions = 1,
  fitness = "walk", -- m
  -- the model may set rates and shares, and stiffnesses from 0.2 to 5 times their first values;
  -- `best_standard` is the champion's score under the first materials
  supervision = { hyperparameters = true, materials = true },
  supervisor = { "llm",
    prompt = "supervise.md", -- of prompts/, or a file beside this one
    context = "summary", -- or "paper": whole populations of three generations
    fallback = "rules", -- proposes if the model does not answer
    ask_every = 1, -- generations
  },
}
