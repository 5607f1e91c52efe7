--- body.lua: masses, springs and faces of a robot, section 1 of engine/PHYSICS.md.

local vector = require "support.physics.vector"

local minus, single, before = vector.minus, vector.single, vector.before
local floor, max, sqrt = math.floor, math.max, math.sqrt

local body = {}

local SIGN = { expanding = 1, contracting = -1, passive = 0 }

-- The entry of a list under a name, made first.
local function entry(list, name, made)
  if not list[name] then list[name], list[#list + 1] = made, made end
  return list[name]
end

-- The contribution of a voxel to each of its springs.
local function share_of(material, weight)
  local amplitude = SIGN[material.kind] * (material.amplitude or 0) * weight.amplitude
  local phase = (material.phase or 0) * weight.phase
  return { gain = single(amplitude), phase = single(phase),
    k = material.stiffness * max(weight.stiffness, material.stiffness_floor),
    zeta = material.damping_ratio, a = amplitude * math.cos(phase),
    b = amplitude * math.sin(phase) }
end

-- What a spring adds up over its owners.
local SUMS = { "k", "zeta", "a", "b" }

-- Adds a voxel, its eight masses, 28 springs and six faces.
local function add_voxel(made, at, material, share)
  local masses = {}
  for c = 0, 7 do
    local site = { at[1] + c % 2, at[2] + floor(c / 2) % 2, at[3] + floor(c / 4) }
    local mass = entry(made.masses, table.concat(site, " "), { site = site, n = 0, sum = 0 })
    mass.n, mass.sum, masses[c] = mass.n + 1, mass.sum + material.mass_per_site, mass
  end
  local voxel = entry(made.voxels, table.concat(at, " "),
    { at = at, corners = masses, gain = share.gain, phase = share.phase })
  for near = 0, 6 do
    for far = near + 1, 7 do
      local from, to = masses[near], masses[far]
      local d = minus(to.site, from.site)
      local name = table.concat(from.site, " ") .. " to " .. table.concat(to.site, " ")
      local spring = entry(made.springs, name,
        { from = from, to = to, d = d, n = 0, k = 0, zeta = 0, a = 0, b = 0, owners = {} })
      spring.n, spring.owners[spring.n + 1] = spring.n + 1, voxel
      for _, field in ipairs(SUMS) do spring[field] = spring[field] + share[field] end
    end
  end
  for axis = 0, 2 do
    local a, b = 2 ^ ((axis + 1) % 3), 2 ^ ((axis + 2) % 3)
    for _, c in ipairs { 0, 2 ^ axis } do
      local corners = { masses[c], masses[c + a], masses[c + b], masses[c + a + b] }
      local face = entry(made.faces, axis .. ": " .. table.concat(masses[c].site, " "),
        { axis = axis, n = 0, corners = corners })
      face.n = face.n + 1
    end
  end
end

-- Means over the voxels that share a mass or a spring, rounded as the engine stores them.
local function average(made, edge, sharing)
  table.sort(made.masses, function(a, b)
    return before({ a.site[3], a.site[2], a.site[1] }, { b.site[3], b.site[2], b.site[1] })
  end)
  for i, mass in ipairs(made.masses) do
    mass.m, mass.i, mass.joined = single(mass.sum / mass.n), i, {}
  end
  for _, s in ipairs(made.springs) do
    local near, far = s.from.m, s.to.m
    local k = sharing == "sum" and s.k or s.k / s.n
    s.i, s.j, s.L = s.from.i, s.to.i, edge * vector.length(s.d)
    s.c = single(2 * s.zeta / s.n * sqrt(k * (near * far / (near + far))))
    s.k, s.a, s.b = single(k), single(s.L * (s.a / s.n)), single(s.L * (s.b / s.n))
    s.from.joined[s.to], s.to.joined[s.from] = true, true
  end
end

--- The masses, springs, faces and voxels of a robot.
function body.of(robot, sharing)
  local made, material = { masses = {}, springs = {}, faces = {}, voxels = {} }, {}
  for _, one in ipairs(robot.materials.materials) do material[one.letter] = one end
  for k, layer in ipairs(robot.voxels) do
    for j, line in ipairs(layer) do
      for i = 1, #line do
        local of, weight = material[line:sub(i, i)], {}
        for name, all in pairs(robot.weights) do
          weight[name] = single(type(all) == "number" and all or all[k][j][i])
        end
        if of.kind ~= "empty" then
          add_voxel(made, { i - 1, j - 1, k - 1 }, of, share_of(of, weight))
        end
      end
    end
  end
  average(made, robot.edge, sharing)
  return made
end

--- Pairs of masses on the surface that neither a spring nor a chain of two joins.
function body.contact_pairs(masses)
  local found = {}
  local function near(a, b)
    if a.joined[b] then return true end
    for other in pairs(a.joined) do
      if b.joined[other] then return true end
    end
  end
  local function inside(mass)
    local springs = 0
    for _ in pairs(mass.joined) do springs = springs + 1 end
    return springs == 26
  end
  for i, a in ipairs(masses) do
    for j = i + 1, #masses do
      local b = masses[j]
      if not (inside(a) or inside(b) or near(a, b)) then found[#found + 1] = { a, b } end
    end
  end
  return found
end

return body
