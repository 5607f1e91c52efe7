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

--- Refuses a robot by hand or of a file unless it has as many genes as the texts read.
---@param scenes table[] that of each of its trials
---@param genes number[]|nil
function control_genes.check(scenes, genes)
  local most, is_controlled, count = 0, false, #(genes or {})
  for _, scene in ipairs(scenes) do
    most = math.max(most, control_genes.of_scene(scene))
    is_controlled = is_controlled or scene.control ~= nil
  end
  if not is_controlled or count == most then return end
  engine.fail(("simulate: scene.control reads %d genes of control, and the robot has %d%s"):format(
    most, count, count > most and ": remove the surplus from its list control"
      or (": limax.robot { voxels = ..., control = { %d numbers } }"):format(most)))
end

return control_genes
