--- rows_file.lua: robots (rows.lua) as the bytes of a NumPy array, which may come from another
--- process or from somebody else.

local ffi = require "ffi"

local record_rules = require "limax.settings.record_rules"
local rows = require "limax.robot.rows"
local structured = require "limax.base.structured"

local rows_file = {}

--- The bytes of robots.
function rows_file.pack(all)
  return structured.header(all.layout, all.count)
    .. ffi.string(all.data, all.count * all.layout.size)
end

-- The facts of an array that was read.
local function facts_of(places)
  local function count(name) return places[name] and places[name].field.count or nil end
  local measures = {}
  local kind = places.measures and places.measures.field.kind
  for k, field in ipairs(type(kind) == "table" and kind or {}) do measures[k] = field.name end
  return { letters = places.letters.size, trials = count "outcome",
    descriptors = count "descriptors", objectives = count "objectives",
    islands = places.island ~= nil, ages = places.age ~= nil,
    self_adaptive = places.step_size ~= nil, archive = places.entered ~= nil,
    novelty = places.novelty ~= nil, cases = count "cases",
    measures = measures[1] and measures or nil }
end

-- Required fields. A version of limax that adds another field reads arrays without it.
local NEEDED = { "id", "generation", "parents", "origin", "body", "mass", "letters", "outcome",
  "status", "reason", "fitness" }

-- Describes the first problem of an array's fields; nil if there is none.
local function problem_of(places)
  for _, name in ipairs(NEEDED) do
    if not places[name] then return ("has no field %s"):format(name) end
  end
  for _, field in ipairs(record_rules.robot_fields(facts_of(places))) do
    local found = places[field.name] and places[field.name].field
    if found and not structured.same_kind(found, field) then
      return ("has the field %s in another form"):format(field.name)
    end
  end
end

-- Describes the first problem of a robot's values; nil if there is none.
local function value_problem(each, letters)
  local shape = each.body
  if each.id < 1 or each.generation < 0 or not (each.mass >= 0) then
    return "id, generation or mass is out of range"
  elseif shape.status < 0 or shape.status > 3 or shape.voxels < 0 or shape.voxels > letters then
    return "its body is out of range"
  end
end

--- Reads robots; `nil, message` if the bytes are not an array of robots.
---@param bytes string of a NumPy array
---@param materials string[] their names
function rows_file.read(bytes, materials)
  local array, message = structured.read(bytes)
  if not array then return nil, message end
  if array.count == 0 then return nil, "has no robots" end
  local places = array.layout.places
  message = problem_of(places)
  if message then return nil, message end
  local all = rows.new(facts_of(places), array.count)
  structured.copy(all, 0, array, 0, array.count)
  all.materials = materials
  for i = 0, all.count - 1 do
    local problem = value_problem(all.data[i], all.facts.letters)
    if problem then return nil, ("robot %d: %s"):format(i + 1, problem) end
  end
  return all
end

return rows_file
