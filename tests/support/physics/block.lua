--- block.lua: the rigid block of the model, section 6 of engine/PHYSICS.md.

local contacts = require "support.physics.contacts"
local vector = require "support.physics.vector"

local plus, minus, times, dot, cross = vector.plus, vector.minus, vector.times, vector.dot,
  vector.cross

local block = {}

local function turned(q, v) -- by a quaternion w, x, y, z
  local u = { q[2], q[3], q[4] }
  local t = times(2, cross(u, v))
  return plus(plus(v, q[1], t), 1, cross(u, t))
end
local function conjugate(q) return { q[1], -q[2], -q[3], -q[4] } end
local function product(a, b)
  local u, v = { a[2], a[3], a[4] }, { b[2], b[3], b[4] }
  local w = plus(plus(cross(u, v), a[1], v), b[1], u)
  return { a[1] * b[1] - dot(u, v), w[1], w[2], w[3] }
end

-- The angular velocity of an angular momentum.
local function spin_of(self, momentum)
  local own = turned(conjugate(self.q), momentum)
  return turned(self.q, { own[1] / self.I[1], own[2] / self.I[2], own[3] / self.I[3] })
end

-- The velocity of a place of the block.
local function velocity_at(self, V, H, arm) return plus(V, 1, cross(spin_of(self, H), arm)) end

--- The block of a scene beside a body at `position`.
function block.new(law, position)
  local half = times(0.5, law.size)
  local function inertia(a, b) return law.mass / 3 * (half[a] ^ 2 + half[b] ^ 2) end
  local I = { inertia(2, 3), inertia(1, 3), inertia(1, 2) }
  local H = { I[1] * law.spin[1], I[2] * law.spin[2], I[3] * law.spin[3] }
  return { law = law, half = half, m = law.mass, I = I, q = { 1, 0, 0, 0 },
    x = plus(position, 1, plus(law.position, 1, half)), V = law.velocity, H = H,
    read = { law.velocity, H } }
end

--- A sample of its trace.
function block.row(self)
  local x, q = self.x, self.q
  return { x[1], x[2], x[3], q[1], q[2], q[3], q[4] }
end

--- Finds the contacts of the block, and the forces on it and on the masses.
function block.forces(self, world, f, x, p)
  local g, law = world.scene.gravity, self.law
  local F, T = times(self.m, g and g.acceleration or vector.zero), vector.zero
  self.masses, self.corners = {}, {}
  local function add_contact(list, i, inverse, arm, normal, N, sign)
    list[#list + 1] = { i = i, arm = arm, normal = normal, N = N, inverse = inverse,
      rubbed = vector.zero }
    F, T = plus(F, sign * N, normal), plus(T, sign * N, cross(arm, normal))
  end
  for i, mass in ipairs(world.masses) do
    local arm = minus(x[i], self.x)
    local d, own = contacts.nearest_face(self.half, turned(conjugate(self.q), arm))
    if d > 0 then
      local normal = turned(self.q, own)
      local rate = dot(normal, minus(p[i], velocity_at(self, self.read[1], self.read[2], arm)))
      local reduced = mass.m * self.m / (mass.m + self.m)
      local c = 2 * law.damping_ratio * math.sqrt(law.stiffness * reduced)
      local N = math.max(0, law.stiffness * d - c * rate)
      f[i] = plus(f[i], N, normal)
      add_contact(self.masses, i, mass.inverse, arm, normal, N, -1)
    end
  end
  for c = 0, 7 do
    local arm = turned(self.q, vector.each(3, function(axis)
      return (math.floor(c / 2 ^ (axis - 1)) % 2 * 2 - 1) * self.half[axis]
    end))
    for _, contact in ipairs(world.contacts) do
      local N, normal = contacts.push(contact, self.m / 4, plus(self.x, 1, arm),
        velocity_at(self, self.read[1], self.read[2], arm))
      if N > 0 then add_contact(self.corners, nil, 0, arm, normal, N, 1) end
    end
  end
  self.F, self.T = F, T
end

function block.kick(self, h)
  self.V2, self.H2 = plus(self.V, h / self.m, self.F), plus(self.H, h, self.T)
end

-- The change of velocity at a contact by a unit impulse along `way`.
local function mobility(self, touch, way)
  local lever = cross(touch.arm, way)
  return touch.inverse + 1 / self.m + dot(lever, spin_of(self, lever))
end

local function limit_of(self, friction, touch, u, h)
  local available = touch.N * h
  local slip = vector.across(touch.normal, minus(u, velocity_at(self, self.V, self.H, touch.arm)))
  local speed = vector.length(slip)
  local stops = speed > 0 and available * mobility(self, touch, times(1 / speed, slip)) or 0
  local rests = speed <= math.max(1e-6, 0.01 * stops)
  return available * (rests and math.max(friction.static, friction.kinetic) or friction.kinetic)
end

-- The change of a contact's impulse by friction.
local function change_of(self, touch, w)
  local slip = vector.across(touch.normal, minus(w, velocity_at(self, self.V2, self.H2, touch.arm)))
  local speed = vector.length(slip)
  if speed == 0 or touch.N == 0 then return vector.zero end
  local wanted = plus(touch.rubbed, -1 / mobility(self, touch, times(1 / speed, slip)), slip)
  local size, old = vector.length(wanted), touch.rubbed
  touch.rubbed = size <= touch.limit and wanted or times(touch.limit / size, wanted)
  return minus(touch.rubbed, old)
end

--- Friction at the block's contacts with masses, or at its corners.
function block.rub(self, friction, list, u, w, h)
  for _, touch in ipairs(list) do
    touch.limit = limit_of(self, friction, touch, touch.i and u[touch.i] or vector.zero, h)
  end
  local sweeps, changes = 0, true
  while changes and sweeps < 32 do
    sweeps, changes = sweeps + 1, false
    for _, touch in ipairs(list) do
      local change = change_of(self, touch, touch.i and w[touch.i] or vector.zero)
      if touch.i then w[touch.i] = plus(w[touch.i], touch.inverse, change) end
      self.V2 = plus(self.V2, -1 / self.m, change)
      self.H2 = minus(self.H2, cross(touch.arm, change))
      changes = changes or vector.length(change) > 1e-3 * touch.N * h
    end
  end
end

function block.drift(self, dt, share)
  self.x = plus(self.x, dt, self.V2)
  for _, turn in ipairs { { 1, 0.5 }, { 2, 0.5 }, { 3, 1 }, { 2, 0.5 }, { 1, 0.5 } } do
    local axis = turn[1]
    local own = turned(conjugate(self.q), self.H2)
    local half = turn[2] * dt * own[axis] / self.I[axis] / 2
    local by = { math.cos(half), 0, 0, 0 }
    by[axis + 1] = math.sin(half)
    self.q = product(self.q, by)
  end
  self.read = { plus(self.V2, share, minus(self.V2, self.V)),
    plus(self.H2, share, minus(self.H2, self.H)) }
  self.V, self.H = self.V2, self.H2
end

return block
