--- control_genes.lua: the number of genes that the controller of a scene needs.

local engine = require "limax.engine"

local control_genes = {}

--- The number for one scene; 0 without a controller.
---@param scene table effects with all their fields
---@return integer
function control_genes.of_scene(scene)
  return scene.control and engine.scene(scene):control_genes() or 0
end

--- The number for robots that are simulated in each of these trials.
---@param trials limax.trial[]
---@return integer
function control_genes.of_trials(trials)
  local most = 0
  for _, trial in ipairs(trials) do
    most = math.max(most, control_genes.of_scene(trial.scene))
  end
  return most
end

return control_genes
