--- statics.lua: the forces and the stiffness matrix of a full box of voxels of one material,
--- written down a second time and in Lua, so that what a simulation comes to rest at can be held
--- against them. SI units.

local statics = {}

-- The 13 half-directions between sites of one voxel.
local DIRECTIONS = {}
for z = -1, 1 do
  for y = -1, 1 do
    for x = -1, 1 do
      local first = z > 0 or (z == 0 and (y > 0 or (y == 0 and x > 0)))
      if first then DIRECTIONS[#DIRECTIONS + 1] = { x, y, z } end
    end
  end
end

---@class limax.hard_cases.box
---@field sites integer[][] indices along x, y, z of each mass, from 0, x first
---@field springs { [1]: integer, [2]: integer, [3]: number, [4]: number|nil }[] two masses, L0 (m)
--- and a stiffness of its own (N/m)

--- Masses and springs of a full box, of one stiffness or of layers that have their own: a spring
--- has the mean of its owners.
---@param lattice integer[]
---@param edge number m
---@param layers number[]|nil stiffness of the voxels of each layer along z, N/m
---@return limax.hard_cases.box
function statics.box(lattice, edge, layers)
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
            local rest = edge * math.sqrt(d[1] ^ 2 + d[2] ^ 2 + d[3] ^ 2)
            -- one that lies in a plane between layers has owners in both, the same number of each
            local above, below = layers and layers[z + 1], layers and d[3] == 0 and layers[z]
            box.springs[#box.springs + 1] = { index(x, y, z), index(u, v, w), rest,
              above and below and 0.5 * (above + below) or above or below }
          end
        end
      end
    end
  end
  return box
end

--- Springs' forces on each mass, N.
---@param box limax.hard_cases.box
---@param stiffness number|nil N/m, of springs without one of their own
---@param positions number[][]
---@return number[][]
function statics.forces(box, stiffness, positions)
  local forces = {}
  for i = 1, #positions do forces[i] = { 0, 0, 0 } end
  for _, spring in ipairs(box.springs) do
    local a, b = positions[spring[1]], positions[spring[2]]
    local e = { b[1] - a[1], b[2] - a[2], b[3] - a[3] }
    local r = math.sqrt(e[1] ^ 2 + e[2] ^ 2 + e[3] ^ 2)
    local pull = (spring[4] or stiffness) * (r - spring[3]) / r
    for axis = 1, 3 do
      forces[spring[1]][axis] = forces[spring[1]][axis] + pull * e[axis]
      forces[spring[2]][axis] = forces[spring[2]][axis] - pull * e[axis]
    end
  end
  return forces
end

--- What the springs hold, J.
---@param box limax.hard_cases.box
---@param stiffness number|nil N/m, of springs without one of their own
---@param positions number[][]
---@return number
function statics.energy(box, stiffness, positions)
  local sum = 0
  for _, spring in ipairs(box.springs) do
    local a, b = positions[spring[1]], positions[spring[2]]
    local r = math.sqrt((b[1] - a[1]) ^ 2 + (b[2] - a[2]) ^ 2 + (b[3] - a[3]) ^ 2)
    sum = sum + 0.5 * (spring[4] or stiffness) * (r - spring[3]) ^ 2
  end
  return sum
end

--- The tangent stiffness -dF/dx at a pose, dense, with a row for each axis of each mass.
---@param box limax.hard_cases.box
---@param stiffness number|nil N/m, of springs without one of their own
---@param positions number[][]
---@return number[][]
function statics.stiffness(box, stiffness, positions)
  local n = 3 * #positions
  local matrix = {}
  for i = 1, n do
    local row = {}
    for j = 1, n do row[j] = 0 end
    matrix[i] = row
  end
  for _, spring in ipairs(box.springs) do
    local i, j = spring[1], spring[2]
    local a, b = positions[i], positions[j]
    local e = { b[1] - a[1], b[2] - a[2], b[3] - a[3] }
    local r = math.sqrt(e[1] ^ 2 + e[2] ^ 2 + e[3] ^ 2)
    local along = spring[4] or stiffness
    local across = along * (1 - spring[3] / r)
    for p = 1, 3 do
      for q = 1, 3 do
        -- k along the spring, k (1 - L / r) across it
        local block = (along - across) * e[p] * e[q] / (r * r) + (p == q and across or 0)
        local ip, iq, jp, jq = 3 * i - 3 + p, 3 * i - 3 + q, 3 * j - 3 + p, 3 * j - 3 + q
        matrix[ip][iq] = matrix[ip][iq] + block
        matrix[jp][jq] = matrix[jp][jq] + block
        matrix[ip][jq] = matrix[ip][jq] - block
        matrix[jp][iq] = matrix[jp][iq] - block
      end
    end
  end
  return matrix
end

--- Solves matrix x = right by elimination, in place, without pivots: stiffness matrices of what is
--- held need none. Also counts negative pivots, of which there are as many as negative eigenvalues
--- (Sylvester's law of inertia).
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

--- Holds the masses for which `held(mass, axis)` is true: their rows and columns become those of a
--- stiff support of their own.
---@param matrix number[][]
---@param held fun(mass: integer, axis: integer): boolean
function statics.hold(matrix, held)
  for i = 1, #matrix do
    if held(math.floor((i - 1) / 3) + 1, (i - 1) % 3 + 1) then
      for j = 1, #matrix do matrix[i][j], matrix[j][i] = 0, 0 end
      matrix[i][i] = 1
    end
  end
end

return statics
