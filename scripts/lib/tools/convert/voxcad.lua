--- voxcad.lua: what limax's and VoxCad's numbers have to do with each other, for the files .vxa and
--- .vxd of VoxCad and voxcraft-sim. SI units.
---
--- VoxCad's material is a continuum, limax's a lattice of springs of one stiffness k at rest length
--- L. Pulled along an axis, that lattice (per voxel 3 edges, 6 face and 4 space diagonals; each
--- adds k r^2 (n n n n) to the moduli) has C11 = 13/3 k/L and C12 = 7/3 k/L, hence Young's modulus
--- 2.7 k/L and Poisson's ratio 7/20.

local voxcad = {}

--- E = MODULUS k / L
voxcad.MODULUS = 2.7
voxcad.POISSON = 0.35

--- Amplitude of the temperature in the files that are written, degrees: a material's CTE is then
--- its amplitude over this.
voxcad.DEGREES = 1

--- Most materials: a voxel is one digit, and 0 is empty.
voxcad.MOST_MATERIALS = 9

--- Most materials of a robot of limax, beside the empty one (LIMAX_MAX_MATERIALS in limax.h).
voxcad.MOST_OF_LIMAX = 15

--- Weights that limax writes beside VoxCad's own PhaseOffset, each in an element of its own.
voxcad.WEIGHTS = { { "stiffness", "StiffnessWeight" }, { "amplitude", "AmplitudeWeight" } }

--- Twelve digits: what the way there and back rounds away is less.
---@param number number
---@return number
function voxcad.rounded(number) return tonumber(("%.12g"):format(number)) end

--- What a muscle of these parameters is in VoxCad's terms: the signed amplitude of its strain.
---@param material limax.material
---@return number
function voxcad.strain_of(material)
  local sign = material.kind == "contracting" and -1 or 1
  return sign * (material.amplitude or 0)
end

return voxcad
