--- contacts.lua: surfaces, their push and their friction, section 4 of engine/PHYSICS.md.

local vector = require "support.physics.vector"

local dot, plus, minus, length, across, times = vector.dot, vector.plus, vector.minus,
  vector.length, vector.across, vector.times
local abs, floor, max, min, sqrt = math.abs, math.floor, math.max, math.min, math.sqrt
local single = vector.single

local contacts = {}

--- The depth in a box with these half edges around 0, and the normal of the nearest face.
function contacts.nearest_face(half, place)
  local dx, dy, dz = half[1] - abs(place[1]), half[2] - abs(place[2]), half[3] - abs(place[3])
  if dz <= dx and dz <= dy then return dz, { 0, 0, place[3] < 0 and -1 or 1 } end
  if dx <= dy then return dx, { place[1] < 0 and -1 or 1, 0, 0 } end
  return dy, { 0, place[2] < 0 and -1 or 1, 0 }
end

-- For each kind: the depth of a place below its surface, and the normal there.
local surfaces = {}

function surfaces.ground(g, x) return g.height - x[3], { 0, 0, 1 } end

function surfaces.planes(g, x)
  local normal = times(1 / length(g.normal), g.normal)
  return g.offset - dot(normal, x), normal
end

function surfaces.spheres(g, x)
  local out = minus(x, g.center)
  local r = length(out)
  if r <= 1e-15 then return g.radius, { 0, 0, 1 } end
  return g.radius - r, times(1 / r, out)
end

function surfaces.boxes(g, x)
  local center = plus(g.from, 0.5, minus(g.to, g.from))
  return contacts.nearest_face(minus(g.to, center), minus(x, center))
end

function surfaces.terrain(g, x)
  local function cell(axis, count)
    local along = (x[axis] - g.origin[axis]) / g.spacing
    local held = max(0, min(along, count - 1))
    local index = min(floor(held), count - 2)
    return index + 1, held - index, along > 0 and along < count - 1 and 1 / g.spacing or 0
  end
  local i, s, per_x = cell(1, #g.heights)
  local j, t, per_y = cell(2, #g.heights[1])
  local near, far = g.heights[i], g.heights[i + 1]
  local a, b, c, d = single(near[j]), single(far[j]), single(near[j + 1]), single(far[j + 1])
  local height = (1 - s) * ((1 - t) * a + t * c) + s * ((1 - t) * b + t * d)
  local gx = ((1 - t) * (b - a) + t * (d - c)) * per_x
  local gy = ((1 - s) * (c - a) + s * (d - b)) * per_y
  local up = 1 / sqrt(1 + gx * gx + gy * gy)
  return (g.origin[3] + height - x[3]) * up, { -gx * up, -gy * up, up }
end

local KINDS = { { "ground" }, { "planes", "normal", "offset" }, { "spheres", "center", "radius" },
  { "boxes", "from", "to" }, { "terrain" } }

--- The contacts of a scene in the order in which they act.
function contacts.of(scene)
  local all = {}
  for number, kind in ipairs(KINDS) do
    local given = scene[kind[1]] or {}
    for _, g in ipairs(given[1] and given or given.stiffness and { given } or {}) do
      local rank = { number, g.stiffness, g.damping_ratio }
      for k = 2, #kind do
        local value = g[kind[k]]
        for _, one in ipairs(type(value) == "table" and value or { value }) do
          rank[#rank + 1] = one
        end
      end
      all[#all + 1] = { surface = surfaces[kind[1]], g = g, rank = rank, k = g.stiffness,
        unit_c = 2 * g.damping_ratio * sqrt(g.stiffness) }
    end
  end
  table.sort(all, function(a, b) return vector.before(a.rank, b.rank) end)
  return all
end

--- The push on a mass m, and its normal.
function contacts.push(contact, m, x, p)
  local d, normal = contact.surface(contact.g, x)
  local rate = dot(normal, p)
  return d > 0 and max(0, contact.k * d - contact.unit_c * sqrt(m) * rate) or 0, normal
end

--- The velocity w after friction under a push N for h; u is the velocity before the step.
function contacts.rubbed(friction, N, normal, mass, u, w, h)
  if not friction or N <= 0 then return w end
  local was, slip = across(normal, u), across(normal, w)
  local speed, available = length(slip), N * h * mass.inverse
  if speed == 0 then return w end
  local may_stick = length(was) <= 1e-6 or dot(was, slip) < 0
  if may_stick and speed <= friction.static * available then return plus(w, -1, slip) end
  return plus(w, -min(friction.kinetic * available, speed) / speed, slip)
end

return contacts
