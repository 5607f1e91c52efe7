--- voxcad.lua: how limax's numbers relate to those of VoxCad and voxcraft-sim. SI units.
---
--- VoxCad's material is a continuum, limax's a lattice of springs of one stiffness k at rest length
--- L. Pulled along an axis, that lattice (per voxel 3 edges, 6 face and 4 space diagonals; each
--- adds k r^2 (n n n n) to the moduli) has C11 = 13/3 k/L and C12 = 7/3 k/L, hence Young's modulus
--- 2.7 k/L and Poisson's ratio 7/20.

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

return voxcad
