--- statics.lua: forces, energy and stiffness matrix of a full box of voxels of one material,
--- written independently of the engine, as a reference for bodies at rest. SI units.

local statics = {}

-- Half of the 26 directions between sites of a voxel: one for each spring.
local DIRECTIONS = {}
for i = 14, 26 do
  DIRECTIONS[i - 13] = { i % 3 - 1, math.floor(i / 3) % 3 - 1, math.floor(i / 9) - 1 }
end

---@class limax.hard_cases.box
---@field sites integer[][] indices along x, y, z of each mass, from 0, x fastest
---@field springs { [1]: integer, [2]: integer, [3]: number }[] two masses and the rest length, m

function statics.box(lattice, edge)
  local nx, ny, nz = lattice[1] + 1, lattice[2] + 1, lattice[3] + 1
  local function index(x, y, z) return 1 + x + nx * (y + ny * z) end
  local box = { sites = {}, springs = {} }
  for z = 0, nz - 1 do
    for y = 0, ny - 1 do
      for x = 0, nx - 1 do
        box.sites[#box.sites + 1] = { x, y, z }
        for _, d in ipairs(DIRECTIONS) do
          local u, v, w = x + d[1], y + d[2], z + d[3]
          if u >= 0 and u < nx and v >= 0 and v < ny and w < nz then
            box.springs[#box.springs + 1] = { index(x, y, z), index(u, v, w),
              edge * math.sqrt(d[1] ^ 2 + d[2] ^ 2 + d[3] ^ 2) }
          end
        end
      end
    end
  end
  return box
end

--- Undeformed positions of the masses.
function statics.positions(box, edge)
  local list = {}
  for i, site in ipairs(box.sites) do
    list[i] = { edge * site[1], edge * site[2], edge * site[3] }
  end
  return list
end

local function vector(positions, spring)
  local a, b = positions[spring[1]], positions[spring[2]]
  local e = { b[1] - a[1], b[2] - a[2], b[3] - a[3] }
  return e, math.sqrt(e[1] ^ 2 + e[2] ^ 2 + e[3] ^ 2)
end

--- Forces of the springs on each mass, N.
function statics.forces(box, stiffness, positions)
  local forces = {}
  for i = 1, #positions do forces[i] = { 0, 0, 0 } end
  for _, spring in ipairs(box.springs) do
    local e, r = vector(positions, spring)
    local pull = stiffness * (r - spring[3]) / r
    for axis = 1, 3 do
      forces[spring[1]][axis] = forces[spring[1]][axis] + pull * e[axis]
      forces[spring[2]][axis] = forces[spring[2]][axis] - pull * e[axis]
    end
  end
  return forces
end

--- Energy of the springs, J.
---@param scale number|nil of the rest lengths
function statics.energy(box, stiffness, positions, scale)
  local sum = 0
  for _, spring in ipairs(box.springs) do
    local _, r = vector(positions, spring)
    sum = sum + 0.5 * stiffness * (r - (scale or 1) * spring[3]) ^ 2
  end
  return sum
end

--- The tangent stiffness -dF/dx, dense, one row per axis of each mass.
function statics.stiffness(box, stiffness, positions)
  local n, matrix = 3 * #positions, {}
  for i = 1, n do
    matrix[i] = {}
    for j = 1, n do matrix[i][j] = 0 end
  end
  for _, spring in ipairs(box.springs) do
    local e, r = vector(positions, spring)
    local across = stiffness * (1 - spring[3] / r)
    for p = 1, 3 do
      for q = 1, 3 do
        -- k along the spring, k (1 - L / r) across it
        local block = (stiffness - across) * e[p] * e[q] / (r * r) + (p == q and across or 0)
        local ip, iq = 3 * spring[1] - 3 + p, 3 * spring[1] - 3 + q
        local jp, jq = 3 * spring[2] - 3 + p, 3 * spring[2] - 3 + q
        matrix[ip][iq], matrix[jp][jq] = matrix[ip][iq] + block, matrix[jp][jq] + block
        matrix[ip][jq], matrix[jp][iq] = matrix[ip][jq] - block, matrix[jp][iq] - block
      end
    end
  end
  return matrix
end

--- Solves matrix x = right by elimination in place, without pivoting, and counts negative pivots:
--- there are as many as negative eigenvalues (Sylvester's law of inertia).
---@param matrix number[][] is overwritten
---@param right number[] is overwritten with x
---@return integer negative pivots
function statics.solve(matrix, right)
  local n, negative = #matrix, 0
  for k = 1, n do
    local pivot_row, pivot = matrix[k], matrix[k][k]
    if pivot < 0 then negative = negative + 1 end
    for i = k + 1, n do
      local row = matrix[i]
      local factor = row[k] / pivot
      if factor ~= 0 then
        for j = k, n do row[j] = row[j] - factor * pivot_row[j] end
        right[i] = right[i] - factor * right[k]
      end
    end
  end
  for k = n, 1, -1 do
    local row, sum = matrix[k], right[k]
    for j = k + 1, n do sum = sum - row[j] * right[j] end
    right[k] = sum / row[k]
  end
  return negative
end

--- Fixes the coordinates for which `held(mass, axis)` is true.
function statics.hold(matrix, held)
  for i = 1, #matrix do
    if held(math.floor((i - 1) / 3) + 1, (i - 1) % 3 + 1) then
      for j = 1, #matrix do matrix[i][j], matrix[j][i] = 0, 0 end
      matrix[i][i] = 1
    end
  end
end

return statics
