--- voxcad_materials.lua: the palette of a .vxa as limax's materials, and how the numbers of VoxCad
--- and voxcraft-sim relate to limax's. SI units.
---
--- VoxCad's material is a continuum, limax's a lattice of springs of one stiffness k at rest length
--- L. Pulled along an axis, that lattice (per voxel 3 edges, 6 face and 4 space diagonals; each
--- adds k r^2 (n n n n) to the moduli) has C11 = 13/3 k/L and C12 = 7/3 k/L, hence Young's modulus
--- 2.7 k/L and Poisson's ratio 7/20.

local document = require "limax.tools.convert.voxcad_document"
local engine = require "limax.engine"
local input = require "limax.tools.convert.input"
local source = require "limax.base.source"

local voxcad = {}

--- Young's modulus, in k / L.
voxcad.MODULUS = 2.7
voxcad.POISSON = 0.35

--- Amplitude of the temperature in written files, degrees: a material's CTE is its amplitude over
--- this.
voxcad.DEGREES = 1

--- Most materials of a palette: a voxel is one digit, and 0 is empty.
voxcad.MAX_MATERIALS = 9

--- Elements of limax beside VoxCad's own PhaseOffset: weight and name.
voxcad.WEIGHTS = { { "stiffness", "StiffnessWeight" }, { "amplitude", "AmplitudeWeight" } }

--- A number rounded to twelve digits, which hides the rounding of a conversion and its inverse.
function voxcad.rounded(number) return tonumber(("%.12g"):format(number)) end

---@class limax.convert.palette
---@field [integer] limax.convert.material without the empty one
---@field letters table<string, boolean> that are taken
---@field names table<string, boolean> that are taken

---@class limax.convert.material : limax.material
---@field static number coefficient of friction
---@field kinetic number coefficient of friction

-- Fields that VoxCad's files do not state, as in the paper's table.
local DAMPING_RATIO, STIFFNESS_FLOOR = 0.1, 0.2

-- Letters of materials that state none: by kind, then any.
local LETTERS = { expanding = "eE", contracting = "cC", passive = "sb" }
local ANY = "adfghijklmnopqrtuvwxyz"

-- Fields that a robot file has no place for.
local OWN_FIELDS = { "static", "kinetic" }

local function free_letter(palette, kind)
  for letter in (LETTERS[kind] .. ANY .. ANY:upper()):gmatch "." do
    if not palette.letters[letter] then
      palette.letters[letter] = true
      return letter
    end
  end
end

local function free_name(palette, name)
  -- a .vxa may have any encoding, a robot file is UTF-8
  name = name:gsub("[^%w%p ]", "_"):sub(1, 40)
  if name == "" then name = "material" end
  local free, n = name, 1
  while palette.names[free] do
    n = n + 1
    free = ("%s %d"):format(name, n)
  end
  palette.names[free] = true
  return free
end

-- The letter that an element states, or a free one.
local function letter_of(palette, element, kind)
  local letter = document.text_at(element, "Limax.Letter")
  if not letter:find "^[!-~]$" or palette.letters[letter] then return free_letter(palette, kind) end
  palette.letters[letter] = true
  return letter
end

-- A material of an element. `swing` is the amplitude of the temperature, degrees.
local function material_of(file, element, palette, edge, swing, actuated)
  local function number(path, default) return document.number_at(file, element, path, default) end
  local strain = number("Mechanical.CTE", 0) * swing
  -- a constant temperature may have any value
  local most = engine.materials("paper"):field("amplitude").maximum
  if not actuated and math.abs(strain) > most then strain = 0 end
  local kind = strain > 0 and "expanding" or strain < 0 and "contracting" or "passive"
  -- a muscle of amplitude 0
  local own_kind = document.text_at(element, "Limax.Kind")
  if strain == 0 and LETTERS[own_kind] then kind = own_kind end
  local material = { kind = kind, letter = letter_of(palette, element, kind),
    name = free_name(palette, document.text_at(element, "Name")),
    stiffness = voxcad.rounded(number "Mechanical.Elastic_Mod" * edge / voxcad.MODULUS),
    mass_per_site = voxcad.rounded(number "Mechanical.Density" * edge ^ 3),
    damping_ratio = number("Limax.DampingRatio", DAMPING_RATIO),
    stiffness_floor = number("Limax.StiffnessFloor", STIFFNESS_FLOOR),
    static = number("Mechanical.uStatic", 0), kinetic = number("Mechanical.uDynamic", 0) }
  if kind ~= "passive" then
    material.amplitude = voxcad.rounded(math.abs(strain))
    material.phase = number("Limax.Phase", math.pi)
  end
  return material
end

--- The materials of a palette.
---@param swing number amplitude of the temperature, degrees
---@param actuated boolean whether the temperature varies
function voxcad.read(file, root, edge, swing, actuated)
  local palette = { letters = { ["."] = true }, names = { empty = true } }
  local elements = document.children(document.at(root, "VXC.Palette"), "Material")
  if #elements == 0 or #elements > voxcad.MAX_MATERIALS then
    input.refuse(file, "VXC.Palette has %d materials; expected 1 to %d", #elements,
      voxcad.MAX_MATERIALS)
  end
  for k, element in ipairs(elements) do
    palette[k] = material_of(file, element, palette, edge, swing, actuated)
  end
  return palette
end

--- The muscle that moves oppositely: one of the palette, or a new one.
function voxcad.opposite_of(palette, material)
  local kind = material.kind == "expanding" and "contracting" or "expanding"
  for _, other in ipairs(palette) do
    local same = other.kind == kind
    for _, field in ipairs { "stiffness", "mass_per_site", "damping_ratio", "amplitude",
      "stiffness_floor" } do
      same = same and other[field] == material[field]
    end
    if same then return other end
  end
  local opposite = source.copy(material)
  opposite.kind, opposite.name = kind, free_name(palette, material.name)
  opposite.letter = free_letter(palette, kind)
  palette[#palette + 1] = opposite
  return opposite
end

--- The material table of a robot file; the engine checks its ranges.
function voxcad.table(palette)
  local materials = { { name = "empty", letter = ".", kind = "empty" } }
  for i, material in ipairs(palette) do
    materials[i + 1] = source.copy(material)
    for _, field in ipairs(OWN_FIELDS) do materials[i + 1][field] = nil end
  end
  return { schema = "limax.materials/1", name = "voxcad",
    fields = engine.materials("paper"):table().fields, materials = materials }
end

return voxcad
