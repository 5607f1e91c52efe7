--- voxcad_losses.lua: what a .vxa says and limax does not carry, for the notes of `limax convert`.

local document = require "limax.tools.convert.voxcad_document"
local voxcad = require "limax.tools.convert.voxcad"

local voxcad_losses = {}

local function known(words)
  local set = {}
  for word in words:gmatch "%S+" do set[word] = true end
  return set
end

-- Elements that are read, or that a note of their own is about; of all others there is one for each
-- name.
local READ = {
  ["VXA"] = known "Simulator Environment VXC",
  ["Environment"] = known "Gravity Thermal Fixed_Regions Forced_Regions",
  ["Environment.Gravity"] = known "GravEnabled GravAcc FloorEnabled FloorSlope",
  ["Environment.Thermal"] =
    known "TempEnabled TempAmplitude TempAmp TempBase VaryTempEnabled TempPeriod",
  ["VXC"] = known "Lattice Palette Structure",
  ["VXC.Lattice"] = known "Lattice_Dim",
  ["VXC.Palette"] = known "Material",
  ["VXC.Palette.Material"] = known "Name Display Mechanical Limax",
  ["VXC.Palette.Material.Mechanical"] = known("Elastic_Mod Density CTE uStatic uDynamic"
    .. " Poissons_Ratio MaterialTempPhase"),
  ["VXC.Structure"] = known("X_Voxels Y_Voxels Z_Voxels Data PhaseOffset StiffnessWeight"
    .. " AmplitudeWeight"),
}

-- What VoxCad writes for a cubic voxel of its usual shape, in elements that limax leaves out.
local USUAL = { ["VXC.Lattice"] = 1, ["VXC.Voxel"] = 1 }

-- Most names that are listed.
local MOST_NAMES = 20

-- Does an element say something: a number that is not 0 and not the usual one, or a word?
local function says(element, usual)
  local text = element.text:gsub("%s", "")
  local number = tonumber(text)
  if number and number ~= 0 and number ~= usual then return true end
  if not number and text:find "%w" then return true end
  for _, each in ipairs(element) do
    if each.name ~= "Vox_Name" and says(each, usual) then return true end
  end
  return false
end

-- Adds the names of what is not read below an element to a list, each once.
local function collect(element, path, names)
  for _, each in ipairs(element) do
    local below = path == "VXA" and each.name or path .. "." .. each.name
    if READ[path][each.name] then
      if READ[below] then collect(each, below, names) end
    elseif not names[below] and says(each, USUAL[path] or USUAL[below]) then
      names[below] = true
      names[#names + 1] = below
    end
  end
end

local function note_names(root, notes)
  local names = {}
  collect(root, "VXA", names)
  for k = 1, math.min(#names, MOST_NAMES) do
    notes[#notes + 1] = (names[k]:gsub("%c", ""):gsub("^VXC%.Structure", "Structure"):sub(1, 80))
  end
  if #names > MOST_NAMES then
    notes[#notes + 1] = ("%d more elements"):format(#names - MOST_NAMES)
  end
end

local function note_materials(file, root, list, notes)
  local differ, poisson, phase
  for _, element in ipairs(document.at(root, "VXC.Palette")) do
    local ratio = document.at(element, "Mechanical.Poissons_Ratio")
    phase = phase
      or document.number_at(file, element, "Mechanical.MaterialTempPhase", 0) ~= 0
    poisson = poisson or ratio and tonumber(ratio.text) ~= voxcad.POISSON
  end
  for _, material in ipairs(list) do
    differ = differ or material.static ~= list[1].static or material.kinetic ~= list[1].kinetic
  end
  if differ then notes[#notes + 1] = "uStatic and uDynamic of all materials but the first" end
  if phase then notes[#notes + 1] = "MaterialTempPhase" end
  if poisson then
    notes[#notes + 1] = ("Poissons_Ratio: a lattice of springs has %g"):format(voxcad.POISSON)
  end
end

local function note_world(file, root, notes)
  local environment = document.child(root, "Environment") or { name = "Environment" }
  local function said(path) return document.number_at(file, environment, path, 0) ~= 0 end
  if said "Gravity.FloorSlope" then notes[#notes + 1] = "Environment.Gravity.FloorSlope" end
  if said "Fixed_Regions.NumFixed" or said "Forced_Regions.NumForced" then
    notes[#notes + 1] = "Environment: fixed and forced regions"
  end
end

--- Notes what limax does not carry of a document.
---@param file string for messages
---@param root limax.host.element VXA
---@param list limax.convert.material[]
---@param notes string[]
function voxcad_losses.note(file, root, list, notes)
  note_names(root, notes)
  note_materials(file, root, list, notes)
  note_world(file, root, notes)
  notes[#notes + 1] = "Simulator: all but a StopConditionFormula t - seconds"
end

return voxcad_losses
