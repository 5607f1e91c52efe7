--- voxcad_write.lua: a robot as .vxa (robot, materials and world) or .vxd (only the robot) of
--- VoxCad and voxcraft-sim. Values that only limax has are in elements that those programs ignore:
--- Limax in a material, StiffnessWeight and AmplitudeWeight beside PhaseOffset.

local choice = require "limax.base.choice"
local defaults = require "limax.settings.defaults"
local engine = require "limax.engine"
local input = require "limax.tools.convert.input"
local palette = require "limax.draw.palette"
local voxcad = require "limax.tools.convert.voxcad_materials"
local xml = require "limax.tools.convert.xml"

local element = xml.element

local voxcad_write = {}

-- The fewest digits that give the same number back.
local function number(value)
  local short = ("%.15g"):format(value)
  return tonumber(short) == value and short or ("%.17g"):format(value)
end

-- Lines <name>value</name>.
local function fields(list)
  local lines = {}
  for i, field in ipairs(list) do
    local name, value = field[1], field[2]
    if type(value) == "number" then value = number(value) end
    lines[i] = ("<%s>%s</%s>"):format(name, value, name)
  end
  return table.concat(lines, "\n")
end

local CARRIED = { gravity = true, ground = true, friction = true, actuation = true, damping = true }

-- Fields of a scene that a .vxa cannot hold: a test, and the note if it is true.
local LOSSES = {
  { function(s)
    local a = s.gravity and s.gravity.acceleration
    return a and (a[1] ~= 0 or a[2] ~= 0)
  end, "scene.gravity: its x and y components" },
  { function(s) return s.ground and s.ground.height ~= 0 end,
    "scene.ground.height: VoxCad's floor is at z = 0" },
  { function(s) return s.friction and not s.ground end,
    "scene.friction: VoxCad has friction only on its floor" },
  { function(s) return not s.damping end,
    "scene: without damping; limax reads it back with damping" },
  { function(s) return s.ground end, "scene.ground: stiffness and damping_ratio" },
  { function(s) return s.actuation and s.actuation.ramp ~= 0 end,
    "scene.actuation.ramp: muscles start at full amplitude" },
}

local function note_scene(scene, notes)
  for _, loss in ipairs(LOSSES) do
    if loss[1](scene) then notes[#notes + 1] = loss[2] end
  end
  for _, name in ipairs(choice.sorted_keys(scene)) do
    if not CARRIED[name] then notes[#notes + 1] = "scene." .. name end
  end
end

local function environment(scene)
  local gravity = scene.gravity and scene.gravity.acceleration or { 0, 0, 0 }
  local actuation = scene.actuation
  return element("Environment",
    element("Gravity", fields { { "GravEnabled", scene.gravity and 1 or 0 },
      { "GravAcc", gravity[3] }, { "FloorEnabled", scene.ground and 1 or 0 } }),
    element("Thermal", fields { { "TempEnabled", actuation and 1 or 0 },
      { "TempAmplitude", voxcad.DEGREES }, { "TempBase", 25 },
      { "VaryTempEnabled", actuation and 1 or 0 },
      { "TempPeriod", 1 / (actuation and actuation.frequency or 1) } }))
end

local function material_element(material, id, edge, color, friction)
  local display = {}
  for k, name in ipairs { "Red", "Green", "Blue" } do
    local share = tonumber(color.hex:sub(2 * k, 2 * k + 1), 16) / 255
    display[k] = { name, voxcad.rounded(share) }
  end
  display[4] = { "Alpha", 1 }
  local own = { { "Letter", xml.escaped(material.letter) }, { "Kind", material.kind },
    { "DampingRatio", material.damping_ratio }, { "StiffnessFloor", material.stiffness_floor } }
  if material.kind ~= "passive" then own[5] = { "Phase", material.phase } end
  local sign = material.kind == "contracting" and -1 or 1
  return element(('Material ID="%d"'):format(id),
    fields { { "Name", xml.escaped(material.name) } },
    element("Display", fields(display)),
    element("Mechanical", fields {
      { "MatModel", 0 },
      { "Elastic_Mod", voxcad.rounded(voxcad.MODULUS * material.stiffness / edge) },
      { "Fail_Stress", 0 },
      { "Density", voxcad.rounded(material.mass_per_site / edge ^ 3) },
      { "Poissons_Ratio", voxcad.POISSON },
      { "CTE", sign * (material.amplitude or 0) / voxcad.DEGREES },
      { "MaterialTempPhase", 0 },
      { "uStatic", friction.static }, { "uDynamic", friction.kinetic } }),
    element("Limax", fields(own)))
end

local function layers_of(name, lattice, separator, value)
  local layers = {}
  for z = 1, lattice[3] do
    local values = {}
    for y = 1, lattice[2] do
      for x = 1, lattice[1] do values[#values + 1] = value(x, y, z) end
    end
    layers[z] = ("<Layer><![CDATA[%s]]></Layer>"):format(table.concat(values, separator))
  end
  return element(name, table.concat(layers, "\n"))
end

local function weight_at(weight, x, y, z)
  return type(weight) == "number" and weight or weight[z][y][x]
end

-- The structure of a robot; notes weights, which VoxCad and voxcraft-sim ignore.
local function structure(path, description, attributes, notes)
  local lattice, weights = description.lattice, description.weights
  local list = description.materials.materials
  if #list - 1 > voxcad.MAX_MATERIALS then
    input.refuse(path, "the robot's table has %d materials; .vxa and .vxd hold up to %d", #list - 1,
      voxcad.MAX_MATERIALS)
  end
  local index, by_letter = {}, {}
  for i, material in ipairs(list) do
    index[material.letter], by_letter[material.letter] = i - 1, material
  end
  local function letter(x, y, z) return description.voxels[z][y]:sub(x, x) end
  local parts = {
    fields { { "X_Voxels", lattice[1] }, { "Y_Voxels", lattice[2] }, { "Z_Voxels", lattice[3] } },
    layers_of("Data", lattice, "", function(x, y, z) return index[letter(x, y, z)] end),
    -- in periods
    layers_of("PhaseOffset", lattice, ", ", function(x, y, z)
      local most = by_letter[letter(x, y, z)].phase or math.pi
      return number(most * weight_at(weights.phase, x, y, z) / (2 * math.pi))
    end),
  }
  for _, each in ipairs(voxcad.WEIGHTS) do
    local name, tag = unpack(each)
    if weights[name] ~= 1 then
      notes[#notes + 1] = ("weights.%s: only limax reads it; in VoxCad every voxel has its"
        .. " material's full %s"):format(name, name)
      parts[#parts + 1] = layers_of(tag, lattice, ", ", function(x, y, z)
        return number(weight_at(weights[name], x, y, z))
      end)
    end
  end
  return element("Structure" .. attributes .. ' Compression="ASCII_READABLE"', unpack(parts))
end

--- A robot with its materials and world.
function voxcad_write.vxa(robot, path, notes)
  local description = robot:table()
  local list = description.materials.materials
  local edge = description.edge or defaults.fields.simulation.edge.value
  local scene = engine.scene(description.scene or defaults.scene):table()
  local friction = scene.friction or { static = 0, kinetic = 0 }
  local colors, entries = palette.of(list), {}
  for i = 2, #list do
    entries[i - 1] = material_element(list[i], i - 1, edge, colors[list[i].letter], friction)
  end
  local duration = (description.simulation or {}).duration
    or defaults.fields.simulation.duration.value
  local stop = "<StopCondition><StopConditionFormula><mtSUB><mtVAR>t</mtVAR><mtCONST>%s</mtCONST>"
    .. "</mtSUB></StopConditionFormula></StopCondition>"
  note_scene(scene, notes)
  local body = structure(path, description, "", notes)
  if description.simulation then notes[#notes + 1] = "simulation: all but its duration" end
  return xml.HEAD .. element('VXA Version="1.1"',
    element("Simulator", stop:format(number(duration))),
    environment(scene),
    element('VXC Version="0.94"',
      element("Lattice", fields { { "Lattice_Dim", edge } }),
      element("Palette", unpack(entries)), body)) .. "\n"
end

--- Only the robot, which replaces the structure of a base.vxa.
function voxcad_write.vxd(robot, path, notes)
  return element("VXD", structure(path, robot:table(), ' replace="VXA.VXC.Structure"', notes))
    .. "\n"
end

return voxcad_write
