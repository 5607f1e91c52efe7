--- random_robots.lua: no random robot diverges because of the automatic step.

local random_robots = require "support.random_robots"

local suite = require("limax.test").suite "random robots"

suite:test("a number gives the same robot by itself and in its batch", { devices = "all" },
  function(t)
    t:same_bits(random_robots.outcome(t.device, 70, 70), random_robots.outcome(t.device, 66, 70))
  end)

for count, tags in pairs { [64] = {}, [10000] = { "full" } } do
  suite:test(("the step causes none of %d robots' divergence"):format(count),
    { devices = "all", tags = tags }, function(t)
      local caused = 0
      for _, row in ipairs(random_robots.search(t.device, 1, count)) do
        caused = caused + (row.blame == "step" and 1 or 0)
        t:note(("case %d: %s at step %d, %.4g s; at an eighth of the step: %s"):format(row.case,
          row.reason, row.step, row.time, row.finer))
      end
      t:equal(caused, 0)
    end)
end

return suite
