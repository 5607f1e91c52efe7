--- words.lua: the functions that only the prompt has.

local names = require "limax.tools.repl.names"
local output = require "limax.base.output"
local show = require "limax.tools.repl.show"

local words = names.words

-- Those in modules of their own, which are loaded at the first call.
for name, module in pairs { champion = "evolve", evolve = "evolve", picture = "picture",
  plot = "plot" } do
  words[name] = function(...) return require("limax.tools.repl." .. module)[name](...) end
end

--- Lists the names that were defined at the prompt, with their values.
function words.who()
  for _, name in ipairs(names.typed()) do
    output.write(("  %-12s %s\n"):format(name, show.line(names.get(name))))
  end
end

return words
