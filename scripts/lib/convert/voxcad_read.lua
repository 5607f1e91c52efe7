--- voxcad_read.lua: a robot from .vxa or .vxd of VoxCad and voxcraft-sim, as the table of a robot
--- file. SI units; voxcad.lua says how its materials become limax's.

local engine = require "limax.engine"
local host = require "limax.host"
local input = require "limax.convert.input"
local robot_file = require "limax.robot_file"
local settings = require "limax.settings"
local source = require "limax.source"
local voxcad = require "limax.convert.voxcad"

local voxcad_read = {}

-- What a material has that VoxCad's files do not state: as in the paper's table.
local DAMPING_RATIO, STIFFNESS_FLOOR = 0.1, 0.2

-- Letters for materials that come without one, by kind and then any.
local LETTERS = { expanding = "eE", contracting = "cC", passive = "sb" }
local ANY = "adfghijklmnopqrtuvwxyz"

-- ---- elements -----------------------------------------------------------------------------------

local function child(node, name)
  for _, each in ipairs(node or {}) do
    if each.name == name then return each end
  end
end

-- The element at a path "A.B.C" below a node.
local function at(node, path)
  for name in path:gmatch "[^.]+" do node = child(node, name) end
  return node
end

local function trimmed(text) return (text:gsub("^%s+", ""):gsub("%s+$", "")) end

-- A finite number at a path; `default` where the element is missing.
local function number_at(file, node, path, default)
  local found = at(node, path)
  if not found then
    if default == nil then input.refuse(file, "%s.%s is missing", node.name, path) end
    return default
  end
  local value = tonumber(trimmed(found.text))
  if not value or value ~= value or math.abs(value) == math.huge then
    input.refuse(file, "%s.%s is %q; expected a number", node.name, path,
      trimmed(found.text):sub(1, 40))
  end
  return value
end

-- The text of an element below a node, empty where either is missing.
local function text_of(node, name)
  local found = child(node, name)
  return found and trimmed(found.text) or ""
end

local function parse(path)
  local root, message = host.xml(input.read(path), path)
  if not root then input.refuse(path, "%s", message:sub(#path + 3)) end
  return root
end

-- Puts an element of a .vxd in the place that its attribute `replace` names.
local function replace(file, root, element)
  local names = {}
  for name in element.attributes.replace:gmatch "[^.]+" do names[#names + 1] = name end
  if names[1] ~= "VXA" or #names < 2 then
    input.refuse(file, "VXD.%s: replace is %q; expected a path such as \"VXA.VXC.Structure\"",
      element.name, element.attributes.replace:sub(1, 60))
  end
  local node = root
  for k = 2, #names - 1 do
    local below = child(node, names[k])
    if not below then
      below = { name = names[k], text = "", attributes = {} }
      node[#node + 1] = below
    end
    node = below
  end
  for i, each in ipairs(node) do
    if each.name == names[#names] then
      node[i] = element
      return
    end
  end
  node[#node + 1] = element
end

-- The whole document: of a .vxd, its base with what it replaces.
local function document(path, base)
  local root = parse(path)
  if root.name == "VXA" then return root end
  if root.name ~= "VXD" then
    input.refuse(path, "its root is <%s>; expected <VXA> or <VXD>", root.name:sub(1, 40))
  end
  base = base or source.folder_of(path) .. "/base.vxa"
  if host.file.exists(base) ~= "file" then
    input.refuse(path, "a .vxd has no materials: name its .vxa with --base FILE, or put it beside"
      .. " it as base.vxa")
  end
  local whole = parse(base)
  if whole.name ~= "VXA" then
    input.refuse(base, "its root is <%s>; expected <VXA>", whole.name:sub(1, 40))
  end
  for _, element in ipairs(root) do
    if element.attributes.replace then replace(path, whole, element) end
  end
  return whole
end

-- ---- voxels -------------------------------------------------------------------------------------

local function layers_at(file, structure, name, lattice)
  local found = child(structure, name)
  local layers = {}
  for _, layer in ipairs(found or {}) do
    if layer.name == "Layer" then layers[#layers + 1] = layer.text end
  end
  if found and #layers ~= lattice[3] then
    input.refuse(file, "Structure.%s has %d layers; Z_Voxels is %d", name, #layers, lattice[3])
  end
  return found and layers
end

-- Indices of the palette [z][i], i = x + (y - 1) nx.
local function data_of(file, structure, lattice, materials)
  local layers = layers_at(file, structure, "Data", lattice)
  if not layers then input.refuse(file, "Structure.Data is missing") end
  local data = {}
  for z, text in ipairs(layers) do
    text = text:gsub("%s", "")
    if #text ~= lattice[1] * lattice[2] then
      input.refuse(file, "Structure.Data: layer %d has %d voxels; X_Voxels times Y_Voxels is %d", z,
        #text, lattice[1] * lattice[2])
    end
    data[z] = {}
    for i = 1, #text do
      local index = text:byte(i) - 48
      if index < 0 or index > materials then
        input.refuse(file, "Structure.Data: layer %d, voxel %d is %q; legal are 0 (empty) to %d,"
          .. " the materials of the palette", z, i, text:sub(i, i), materials)
      end
      data[z][i] = index
    end
  end
  return data
end

-- Numbers of every voxel [z][i]; nil where the element is missing.
local function numbers_of(file, structure, name, lattice)
  local layers = layers_at(file, structure, name, lattice)
  if not layers then return nil end
  local grid, count = {}, lattice[1] * lattice[2]
  for z, text in ipairs(layers) do
    local list = {}
    for word in text:gmatch "[^%s,]+" do
      local value = tonumber(word)
      if not value or value ~= value or math.abs(value) == math.huge then
        input.refuse(file, "Structure.%s: layer %d holds %q; expected numbers", name, z,
          word:sub(1, 40))
      end
      list[#list + 1] = value
    end
    if #list ~= count then
      input.refuse(file, "Structure.%s: layer %d has %d numbers; X_Voxels times Y_Voxels is %d",
        name, z, #list, count)
    end
    grid[z] = list
  end
  return grid
end

-- ---- materials ----------------------------------------------------------------------------------

local function free_letter(kind, taken)
  for letter in (LETTERS[kind] .. ANY .. ANY:upper()):gmatch "." do
    if not taken[letter] then
      taken[letter] = true
      return letter
    end
  end
end

local function free_name(name, taken)
  -- the file's encoding may be anything, a robot file's is UTF-8
  name = name:gsub("[^%w%p ]", "_"):sub(1, 40)
  if name == "" then name = "material" end
  local free, n = name, 1
  while taken[free] or free == "empty" do
    n = n + 1
    free = ("%s %d"):format(name, n)
  end
  taken[free] = true
  return free
end

-- Letters that materials state, by the first that does, and all that are taken by that.
local function stated_letters(root)
  local stated_by, taken = {}, { ["."] = true }
  for _, element in ipairs(at(root, "VXC.Palette") or {}) do
    local letter = text_of(child(element, "Limax"), "Letter")
    if letter:find "^[!-~]$" and not taken[letter] then
      stated_by[letter], taken[letter] = element, true
    end
  end
  return stated_by, taken
end

-- The palette as limax's materials, the empty one not among them.
local function palette_of(file, root, edge, swing)
  local limits, list, names = engine.materials "paper", {}, {}
  local stated_by, letters = stated_letters(root)
  for _, element in ipairs(at(root, "VXC.Palette") or {}) do
    if element.name == "Material" then
      local own = child(element, "Limax")
      local where = ("VXC.Palette.Material %d"):format(#list + 1)
      local function legal(field, value, said)
        local range = limits:field(field)
        if value < range.minimum or value > range.maximum then
          input.refuse(file, "%s: %s is a %s of %.6g; legal are %.6g to %.6g %s", where, said,
            field, value, range.minimum, range.maximum, range.unit)
        end
        return value
      end
      local function number(path, default) return number_at(file, element, path, default) end
      local strain = number("Mechanical.CTE", 0) * swing
      local kind = strain > 0 and "expanding" or strain < 0 and "contracting" or "passive"
      local stated, letter = text_of(own, "Kind"), text_of(own, "Letter")
      -- a muscle of amplitude 0
      if strain == 0 and LETTERS[stated] then kind = stated end
      if stated_by[letter] ~= element then letter = free_letter(kind, letters) end
      local modulus, density = number "Mechanical.Elastic_Mod", number "Mechanical.Density"
      local material = { letter = letter, kind = kind,
        name = free_name(text_of(element, "Name"), names),
        stiffness = legal("stiffness", voxcad.rounded(modulus * edge / voxcad.MODULUS),
          ("Elastic_Mod %g Pa"):format(modulus)),
        mass_per_site = legal("mass_per_site", voxcad.rounded(density * edge ^ 3),
          ("Density %g kg/m^3"):format(density)),
        damping_ratio = legal("damping_ratio", number("Limax.DampingRatio", DAMPING_RATIO),
          "Limax.DampingRatio"),
        stiffness_floor = legal("stiffness_floor",
          number("Limax.StiffnessFloor", STIFFNESS_FLOOR), "Limax.StiffnessFloor") }
      if kind ~= "passive" then
        material.amplitude = legal("amplitude", voxcad.rounded(math.abs(strain)),
          ("CTE times TempAmplitude"))
        material.phase = legal("phase", number("Limax.Phase", math.pi), "Limax.Phase")
      end
      list[#list + 1] = material
      -- not limax's own fields, and taken away again
      material.index, material.static = #list, number("Mechanical.uStatic", 0)
      material.kinetic = number("Mechanical.uDynamic", 0)
    end
  end
  if #list == 0 or #list > voxcad.MOST_MATERIALS then
    input.refuse(file, "VXC.Palette has %d materials; legal are 1 to %d", #list,
      voxcad.MOST_MATERIALS)
  end
  return list, letters, names
end

-- The muscle that does the opposite: found in the list, or added to it.
local function twin_of(material, list, letters, names)
  local kind = material.kind == "expanding" and "contracting" or "expanding"
  for _, other in ipairs(list) do
    local same = other.kind == kind
    for _, field in ipairs { "stiffness", "mass_per_site", "damping_ratio", "amplitude",
      "stiffness_floor" } do
      same = same and other[field] == material[field]
    end
    if same then return other end
  end
  local twin = source.copy(material)
  twin.kind, twin.name, twin.index = kind, free_name(material.name, names), #list + 1
  twin.letter = free_letter(kind, letters)
  list[#list + 1] = twin
  return twin
end

-- ---- the whole ----------------------------------------------------------------------------------

-- Phases in radians [z][i] and the material of each voxel, by what a sine allows: a phase beyond
-- half a period is the opposite muscle's, half a period earlier.
local function phases_of(offsets, data, list, letters, names)
  local phases, used = {}, {}
  for z, layer in ipairs(data) do
    phases[z], used[z] = {}, {}
    for i, index in ipairs(layer) do
      local material, turn = list[index], offsets and offsets[z][i] or 0
      turn = turn - math.floor(turn)
      if turn > 0.5 and material and material.kind ~= "passive" then
        material, turn = twin_of(material, list, letters, names), turn - 0.5
      end
      phases[z][i], used[z][i] = 2 * math.pi * math.min(turn, 0.5), material
    end
  end
  -- a largest phase that is too small for a voxel is not this file's
  for z, layer in ipairs(used) do
    for i, material in pairs(layer) do
      if material.phase and phases[z][i] > material.phase * (1 + 1e-12) then
        material.phase = math.pi
      end
    end
  end
  return phases, used
end

local function scene_of(file, root, swing, first, notes)
  local environment = child(root, "Environment") or { name = "Environment" }
  local function number(path, default) return number_at(file, environment, path, default) end
  local scene = { damping = true }
  if number("Gravity.GravEnabled", 0) ~= 0 then
    scene.gravity = { acceleration = { 0, 0, number("Gravity.GravAcc", -9.81) } }
  end
  if number("Gravity.FloorEnabled", 0) ~= 0 then
    scene.ground = true
    scene.friction = { static = first.static, kinetic = first.kinetic }
  end
  if swing ~= 0 then
    local period = number("Thermal.TempPeriod", 0.1)
    if not (period > 0) then
      input.refuse(file, "Environment.Thermal.TempPeriod is %g; legal is above 0 s", period)
    end
    scene.actuation = { frequency = voxcad.rounded(1 / period), ramp = 0 }
  end
  if number("Gravity.FloorSlope", 0) ~= 0 then
    notes[#notes + 1] = "Environment.Gravity.FloorSlope"
  end
  if number("Fixed_Regions.NumFixed", 0) ~= 0 or number("Forced_Regions.NumForced", 0) ~= 0 then
    notes[#notes + 1] = "Environment: fixed and forced regions"
  end
  return input.about(file, function() return engine.scene(scene):table() end)
end

-- Degrees by which the temperature swings; 0 where it does not.
local function swing_of(file, root)
  local thermal = at(root, "Environment.Thermal")
  if not thermal or number_at(file, thermal, "VaryTempEnabled", 0) == 0
    or number_at(file, thermal, "TempEnabled", 1) == 0 then
    return 0
  end
  if child(thermal, "TempAmplitude") then return number_at(file, thermal, "TempAmplitude") end
  -- VoxCad's older files state the highest temperature
  local base = number_at(file, thermal, "TempBase", 25)
  return number_at(file, thermal, "TempAmp", base) - base
end

local KNOWN = { X_Voxels = true, Y_Voxels = true, Z_Voxels = true, Data = true, PhaseOffset = true,
  StiffnessWeight = true, AmplitudeWeight = true }

local function note_losses(file, root, structure, list, notes)
  for _, element in ipairs(structure) do
    if not KNOWN[element.name] then
      notes[#notes + 1] = "Structure." .. element.name:gsub("%c", ""):sub(1, 40)
    end
  end
  local differ, poisson, phase
  for _, element in ipairs(at(root, "VXC.Palette")) do
    local ratio = at(element, "Mechanical.Poissons_Ratio")
    phase = phase or number_at(file, element, "Mechanical.MaterialTempPhase", 0) ~= 0
    poisson = poisson or ratio and tonumber(trimmed(ratio.text)) ~= voxcad.POISSON
  end
  for _, material in ipairs(list) do
    differ = differ or material.static ~= list[1].static or material.kinetic ~= list[1].kinetic
  end
  if differ then notes[#notes + 1] = "uStatic and uDynamic of all materials but the first" end
  if phase then notes[#notes + 1] = "MaterialTempPhase" end
  if poisson then
    notes[#notes + 1] = ("Poissons_Ratio: a lattice of springs has %g"):format(voxcad.POISSON)
  end
  notes[#notes + 1] = "Simulator: all but a StopConditionFormula t - seconds"
end

-- Weights [z][y][x] from [z][i].
local function grid_of(lattice, value)
  local grid = {}
  for z = 1, lattice[3] do
    grid[z] = {}
    for y = 1, lattice[2] do
      grid[z][y] = {}
      for x = 1, lattice[1] do grid[z][y][x] = value(z, x + (y - 1) * lattice[1]) end
    end
  end
  return grid
end

--- Reads a robot. `notes` receives what limax cannot carry.
---@param path string .vxa or .vxd
---@param options { base: string|nil } the .vxa of a .vxd
---@param notes string[]
---@return limax.robot.description
function voxcad_read.read(path, options, notes)
  local root = document(path, options.base)
  local structure = at(root, "VXC.Structure")
  if not structure then input.refuse(path, "VXC.Structure is missing") end
  local compression = structure.attributes.Compression or "ASCII_READABLE"
  if compression ~= "ASCII_READABLE" then
    input.refuse(path, "Structure: Compression is %q; legal is \"ASCII_READABLE\"",
      compression:sub(1, 40))
  end
  local lattice = {}
  for axis, name in ipairs { "X_Voxels", "Y_Voxels", "Z_Voxels" } do
    lattice[axis] = number_at(path, structure, name)
  end
  input.check_lattice(path, lattice)
  local edge = number_at(path, root, "VXC.Lattice.Lattice_Dim")
  if not (edge >= 1e-6 and edge <= 1e3) then
    input.refuse(path, "VXC.Lattice.Lattice_Dim is %g; legal are 1e-6 to 1000 m", edge)
  end

  local swing = swing_of(path, root)
  local list, letters, names = palette_of(path, root, edge, swing)
  local data = data_of(path, structure, lattice, #list)
  note_losses(path, root, structure, list, notes)
  local offsets = numbers_of(path, structure, "PhaseOffset", lattice)
  local scene = scene_of(path, root, swing, list[1], notes)
  local phases, used = phases_of(offsets, data, list, letters, names)

  local weights = { stiffness = 1, amplitude = 1 }
  for _, each in ipairs(voxcad.WEIGHTS) do
    local grid = numbers_of(path, structure, each[2], lattice)
    if grid then
      weights[each[1]] = grid_of(lattice, function(z, i) return grid[z][i] end)
    end
  end
  weights.phase = grid_of(lattice, function(z, i)
    local most = used[z][i] and used[z][i].phase or math.pi
    return most > 0 and math.min(phases[z][i] / most, 1) or 0
  end)
  local voxels = {}
  for z = 1, lattice[3] do
    voxels[z] = {}
    for y = 1, lattice[2] do
      local line = {}
      for x = 1, lattice[1] do
        local material = used[z][x + (y - 1) * lattice[1]]
        line[x] = material and material.letter or "."
      end
      voxels[z][y] = table.concat(line)
    end
  end

  local materials = { schema = "limax.materials/1", name = "voxcad",
    fields = engine.materials("paper"):table().fields,
    materials = { { name = "empty", letter = ".", kind = "empty" } } }
  for i, material in ipairs(list) do
    material.index, material.static, material.kinetic = nil, nil, nil
    materials.materials[i + 1] = material
  end
  local simulation = { edge = edge }
  local formula = at(root, "Simulator.StopCondition.StopConditionFormula.mtSUB")
  if formula and text_of(formula, "mtVAR") == "t" then
    simulation.duration = number_at(path, formula, "mtCONST")
  end
  return { schema = robot_file.schema, lattice = lattice, edge = edge, voxels = voxels,
    weights = weights, materials = materials, scene = scene,
    simulation = input.about(path, settings.simulation_options, simulation) }
end

return voxcad_read
