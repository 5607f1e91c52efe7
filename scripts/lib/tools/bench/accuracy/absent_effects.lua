--- absent_effects.lua: what a step spends on effects that its scene lacks: instructions in
--- functions that are an effect's, counted by callgrind, which no other process disturbs. The CPU's
--- passes alone: on CUDA the text of a kernel holds nothing else
--- (tests/engine/backend/cuda/cuda_effects_test.cpp).

local engine = require "limax.engine"
local host = require "limax.host"
local instructions = require "limax.tools.bench.instructions"
local shell = require "limax.base.shell"

local absent_effects = {}

-- Springs alone, and a walker's scene.
local SCENES = { {},
  { gravity = true, ground = true, friction = true, damping = true, actuation = true } }
-- Scenes are made and bodies measured before the first step; what a step does grows with them.
local STEPS = { 64, 320 }

--- Instructions of each function itself, without what it calls, from a file of callgrind's.
---@param lines fun(): string|nil
---@return table<string, number>
function absent_effects.own_costs(lines)
  local names, costs, current, called = {}, {}, nil, false
  for line in lines do
    local kind, id, name = line:match "^(c?fn)=(%(%d+%)) ?(.*)$"
    if kind then
      if name ~= "" then names[id] = name end
      if kind == "fn" then current = names[id] end
    elseif line:find "^calls=" then
      called = true
    else
      -- a place, absolute or not, and a cost
      local cost = line:match "^[%d+*-]%S* (%d+)$"
      if cost and not called and current then
        costs[current] = (costs[current] or 0) + tonumber(cost)
      end
      if cost then called = false end
    end
  end
  return costs
end

local function costs_of(steps, scene)
  local output = os.tmpname()
  local status = os.execute(("valgrind --tool=callgrind --callgrind-out-file=%s %s %s %d %s "
    .. ">/dev/null 2>&1"):format(shell.quoted(output), shell.quoted(host.executable),
    shell.quoted(host.home .. "/scripts/lib/tools/bench/counted_steps.lua"), steps,
    shell.quoted(host.json.encode(scene))))
  local costs
  if status == 0 then costs = absent_effects.own_costs(io.lines(output)) end
  os.remove(output)
  return costs
end

-- Is a function that of an effect which the scene lacks?
local function lacks(name, scene)
  -- what a function is made for, without the types of what it is given
  for effect in (name:match "(%b<>)%(" or ""):gmatch "effects::([%l_]+)" do
    if scene[effect] == false then return true end
  end
  -- springs, with or without damping and muscles
  local damped, actuated = name:match "::pair<%a+, (%a+), (%a+)>%("
  return damped == "true" and not scene.damping or actuated == "true" and not scene.actuation
end

--- Instructions of a step in functions of effects that the scene lacks, the scenes' sum, and in all
--- of the engine's functions that grow with the steps.
---@return number|nil
---@return number|string all, or why nothing was counted
function absent_effects.count()
  if not instructions.available() then return nil, "valgrind is not installed" end
  local absent, all = 0, 0
  for _, scene in ipairs(SCENES) do
    local there = { springs = true }
    for _, info in ipairs(engine.effects()) do
      there[info.name] = scene[info.name] or there[info.name] or false
    end
    local few, many = costs_of(STEPS[1], scene), costs_of(STEPS[2], scene)
    if not few or not many then return nil, "valgrind could not run it" end
    for name, cost in pairs(many) do
      if name:find("limax::", 1, true) then
        local more = (cost - (few[name] or 0)) / (STEPS[2] - STEPS[1])
        all = all + more
        if lacks(name, there) then absent = absent + more end
      end
    end
  end
  return absent, all
end

return absent_effects
