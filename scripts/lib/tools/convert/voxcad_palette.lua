--- voxcad_palette.lua: the palette of a .vxa as limax's materials, SI units, and the muscle that
--- does the opposite of one. voxcad.lua says how the numbers relate.

local document = require "limax.tools.convert.voxcad_document"
local engine = require "limax.engine"
local input = require "limax.tools.convert.input"
local source = require "limax.base.source"
local voxcad = require "limax.tools.convert.voxcad"

local at, child, text_of = document.at, document.child, document.text_of

local voxcad_palette = {}

---@class limax.convert.material : limax.material
---@field index integer in the palette, from 1
---@field static number coefficient of friction
---@field kinetic number

-- What a material has that VoxCad's files do not state: as in the paper's table.
local DAMPING_RATIO, STIFFNESS_FLOOR = 0.1, 0.2

-- Letters for materials that come without one, by kind and then any.
local LETTERS = { expanding = "eE", contracting = "cC", passive = "sb" }
local ANY = "adfghijklmnopqrtuvwxyz"

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

--- The palette, without the empty material; `letters` and `names` are those that are taken.
---@param file string for messages
---@param root limax.host.element
---@param edge number m
---@param swing number degrees by which the temperature swings
---@param swings boolean does it, or is that only what the file says?
---@return limax.convert.material[] list
---@return table<string, boolean> letters
---@return table<string, boolean> names
function voxcad_palette.read(file, root, edge, swing, swings)
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
      local function number(path, default)
        return document.number_at(file, element, path, default)
      end
      local strain = number("Mechanical.CTE", 0) * swing
      -- a temperature that stays as it is may be any
      if not swings and math.abs(strain) > limits:field("amplitude").maximum then strain = 0 end
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

--- The muscle that does the opposite: found in the list, or added to it.
---@param material limax.convert.material
---@param list limax.convert.material[]
---@param letters table<string, boolean>
---@param names table<string, boolean>
---@return limax.convert.material
function voxcad_palette.twin_of(material, list, letters, names)
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

--- The material table that a robot file holds.
---@param list limax.convert.material[]
---@return table
function voxcad_palette.table(list)
  local result = { schema = "limax.materials/1", name = "voxcad",
    fields = engine.materials("paper"):table().fields,
    materials = { { name = "empty", letter = ".", kind = "empty" } } }
  for i, material in ipairs(list) do
    local copy = source.copy(material)
    copy.index, copy.static, copy.kinetic = nil, nil, nil
    result.materials[i + 1] = copy
  end
  return result
end

return voxcad_palette
