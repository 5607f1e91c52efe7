--- losses.lua: what a robot file holds and a format leaves out, for the notes of `limax convert`.

local losses = {}

-- Fields beside the body, in a robot file's order.
local FIELDS = { "scene", "simulation", "fitness", "score", "outcome", "id", "generation",
  "parents", "origin" }

--- Fields beside the body that a robot has and a format does not, as a list of their names.
---@param robot limax.robot
---@param carried? table<string, boolean> those that the format has
---@return string|nil none where there are none
function losses.fields(robot, carried)
  local lost = {}
  for _, field in ipairs(FIELDS) do
    if robot.description[field] ~= nil and not (carried or {})[field] then
      lost[#lost + 1] = field
    end
  end
  return lost[1] and table.concat(lost, ", ")
end

--- What a format that knows materials by `known` alone leaves out of them.
---@param known string
---@return string
function losses.materials(known) return ("materials: all but %s"):format(known) end

--- Notes these, and every field beside the body.
---@param notes string[]
---@param robot limax.robot
---@param ... string
function losses.note(notes, robot, ...)
  for _, text in ipairs { ... } do notes[#notes + 1] = text end
  notes[#notes + 1] = losses.fields(robot)
end

return losses
