--- modes.lua: natural modes of a body: small vibrations about a pose at rest. SI units.

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local materials = require "limax.engine.materials"
local object = require "limax.engine.object"
local population = require "limax.engine.population"
local scene = require "limax.engine.scene"
local schema = require "limax.engine.schema"
local simulation = require "limax.engine.simulation"
local view = require "limax.engine.view"

local C = abi.C
local count_rule = schema.whole(1, 1000)

---@class limax.mode
---@field frequency number Hz, without damping
---@field damping_ratio number 1; above 1 it does not vibrate
---@field slow number m, largest displacement of a mass in this mode if the muscles pulled slowly
---@field shape limax.view displacements [mass][3], the largest of length 1

--- The modes of the lowest frequencies of robot i, fewer if it has fewer.
---@param robots limax.population
---@param i integer
---@param table_of_materials limax.materials
---@param in_scene limax.scene
---@param options table fields of `simulation`, of which `edge` and `sharing` count
---@param positions limax.view|nil [mass][3] m, a pose at rest; nil for the undeformed body without
--- contacts
---@param count integer
---@return limax.mode[]
---@return integer rigid independent motions without a restoring force, which are left out
local function modes(robots, i, table_of_materials, in_scene, options, positions, count)
  local what = "modes"
  local population_handle, robot = object.entry(what .. ": population", robots, population.class, i)
  local materials_handle = object.handle(what .. ": materials", table_of_materials, materials.class)
  local scene_handle = object.handle(what .. ": scene", in_scene, scene.class)
  count = schema.demand(count_rule, count, what .. ": count")
  if positions ~= nil and not view.is_view(positions) then
    schema.refuse(what .. ": positions", "an array of positions, or nil", positions)
  end
  local masses = C.limax_population_bodies(population_handle)[robot].masses
  count = math.min(count, 3 * masses)
  local found, shapes = ffi.new("limax_mode[?]", count), ffi.new("double[?]", 3 * masses * count)
  local counts = ffi.new "int32_t[2]"
  abi.check(C.limax_modes(population_handle, robot, materials_handle, scene_handle,
    (simulation.options_of(options)), positions and positions:pointer(), count, found, shapes,
    counts, counts + 1), what)
  local list = {}
  for k = 1, counts[0] do
    list[k] = { frequency = found[k - 1].frequency, damping_ratio = found[k - 1].damping_ratio,
      slow = math.sqrt(found[k - 1].sine ^ 2 + found[k - 1].cosine ^ 2),
      shape = view.new(shapes, "shape", "double", shapes + 3 * masses * (k - 1), { masses, 3 }) }
  end
  return list, counts[1]
end

return modes
