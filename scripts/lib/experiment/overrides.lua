--- overrides.lua: `--set path=value`, which changes any field of an experiment before it is
--- checked. Paths are field names joined by dots (`scene.actuation.frequency`, `lattice.3`),
--- materials are named by name or letter (`materials.bone.stiffness`); values are JSON if they
--- parse, else text.

local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local host = require "limax.host"
local proposals = require "limax.supervise.proposals"
local schema = require "limax.engine.schema"
local source = require "limax.base.source"
local suggest = require "limax.engine.suggest"

local overrides = {}

-- Splits "path=value"; `nil, message` for any other text.
local function parse(text)
  local path, value = text:match "^([^=]+)=(.*)$"
  if not path then
    return nil, ("--set %s: expected path=value, such as population=50 or"
      .. " scene.actuation.frequency=3"):format(text)
  end
  local steps = {}
  for step in (path .. "."):gmatch "(.-)%." do
    if step == "" then
      return nil, ("--set %s: the path %s has an empty step"):format(text, path)
    end
    steps[#steps + 1] = step
  end
  local decoded = host.json.decode(value, "--set")
  if decoded == nil then decoded = value end
  return steps, decoded
end

--- The end of a message about changes: how to write a list, if one was meant.
function overrides.hint(changes)
  for _, text in ipairs(changes) do
    local steps, value = parse(text)
    local list = steps and type(value) == "string" and value:match "^[{%[]?([%d%.,%s%-]+)[}%]]?$"
    if list and list:find(",", 1, true) then
      return ("; a list is JSON: --set %s=[%s]"):format(table.concat(steps, "."), list)
    end
  end
  return ""
end

-- JSON's null inside a value is an absent field.
local function without_null(value)
  if value == host.json.null then return nil end
  if type(value) ~= "table" then return value end
  local copy = {}
  for key, entry in pairs(value) do copy[key] = without_null(entry) end
  return copy
end

-- The table at `key` of `holder` that a longer path enters. A switch becomes a table (`actuation =
-- true`), a name the table that names it (`selection = "tournament"`), and an absent list starts
-- with its resolved numbers.
local function entered(holder, key, resolved)
  local value = holder[key]
  if type(value) ~= "table" then
    if type(value) == "string" then value = { value }
    elseif value ~= nil and type(value) ~= "boolean" then return nil
    elseif (schema.list_size(resolved) or 0) > 0 then value = source.copy(resolved)
    else value = {} end
    holder[key] = value
  end
  return value
end

-- Entries of a table of materials besides the materials themselves.
local of_table = { schema = true, name = true, note = true, fields = true, materials = true }

-- The steps of a path below a table of materials: the name or letter of a material becomes its
-- index.
local function material_path(materials, path)
  if of_table[path[2]] or type(materials.materials) ~= "table" then return { unpack(path, 2) } end
  local names, found = {}, nil
  for i, material in ipairs(materials.materials) do
    if path[2] == material.name or path[2] == material.letter then found = i end
    names[i] = tostring(material.name)
  end
  if not found then
    return nil, ("materials: there is no material %q%s"):format(path[2],
      suggest.ending(path[2], names))
  end
  return { "materials", tostring(found), unpack(path, 3) }
end

-- A step of a path as the key of a table.
local function key_of(step) return step:match "^%d+$" and tonumber(step) or step end

-- The table in which a path into scene or materials begins, and the path to it: the experiment, or
-- one of its trials.
local function world_of(spec, path)
  local trial = path[1] == "trials" and type(spec.trials) == "table"
    and spec.trials[tonumber(path[2])]
  if type(trial) == "table" then return trial, 3 end
  return spec, 1
end

-- Prepares scene or materials of a trial or the experiment for a path into them. Returns the path.
local function prepared(spec, path, context)
  local world, first = world_of(spec, path)
  local name = path[first]
  if not path[first + 1] then return path end
  if name == "scene" and world.scene == nil then
    world.scene = source.copy(spec.scene == nil and defaults.scene or spec.scene)
  end
  if name ~= "materials" then return path end
  local materials, message = world.materials or source.copy(spec.materials), nil
  if type(materials) ~= "table" then materials, message = context.materials(materials) end
  if not materials then return nil, message end
  world.materials = materials
  local steps
  steps, message = material_path(materials, { unpack(path, first) })
  if not steps then return nil, message end
  local whole = { unpack(path, 1, first) }
  for _, step in ipairs(steps) do whole[#whole + 1] = step end
  return whole
end

-- Adds the lists of the effects that a scene lacks.
local function add_effects(scene)
  for _, effect in ipairs(engine.effects()) do
    local own = scene[effect.name] or {}
    scene[effect.name] = own
    for _, field in ipairs(effect.fields) do
      -- the first of an effect that a scene may have several times
      local first = type(own[1]) == "table" and own[1][field.name]
      if field.components > 1 then own[field.name] = own[field.name] or first or field.value end
    end
  end
end

-- The resolved values, with defaults for effects that a scene lacks: an override may change one
-- number of a list.
local function resolved_lists(config)
  local lists = source.copy(config)
  for _, trial in ipairs(lists.trials or {}) do
    trial.scene = trial.scene or source.copy(lists.scene)
    add_effects(trial.scene)
  end
  add_effects(lists.scene)
  local allowed = lists.supervision.ranges or {}
  lists.supervision.ranges = allowed
  for _, limit in ipairs(proposals.limits(config.population)) do
    allowed[limit.field] = allowed[limit.field] or { limit.minimum, limit.maximum }
  end
  return lists
end

-- Fields whose default is a table: an override changes a part of it.
local WHOLE = { record = true, selection = true, supervisor = true }

---@class overrides.context
---@field config table the resolved configuration, for the values of absent fields
---@field materials fun(spec: any): table|nil, string|nil reads a table of materials that is named

--- Applies overrides to a table in place, in their order.
---@param texts string[] "path=value"
---@return true|nil
---@return string|nil message
function overrides.apply(spec, texts, context)
  local lists = resolved_lists(context.config)
  for _, text in ipairs(texts) do
    local path, value = parse(text)
    if not path then return nil, value end
    local holder, resolved, message = spec, lists
    path, message = prepared(spec, path, context)
    if not path then return nil, ("--set %s: %s"):format(text, message) end
    local first = path[1]
    if WHOLE[first] and spec[first] == nil then spec[first] = source.copy(defaults[first]) end
    for i = 1, #path - 1 do
      local key = key_of(path[i])
      resolved = type(resolved) == "table" and resolved[key] or nil
      local within = entered(holder, key, resolved)
      if not within then
        local is_function = type(holder[key]) == "function"
        return nil, ("--set %s: %s %s"):format(text, table.concat(path, ".", 1, i), is_function
          and "is a function of the script, which has to be changed there" or "has no fields")
      end
      holder = within
    end
    holder[key_of(path[#path])] = without_null(value)
  end
  return true
end

return overrides
