--- physics.lua: engine/PHYSICS.md in plain Lua, written from that page to check the engine, with
--- which it shares no code. SI units.

local block = require "support.physics.block"
local body = require "support.physics.body"
local contacts = require "support.physics.contacts"
local control = require "support.physics.control"
local vector = require "support.physics.vector"

local dot, plus, minus, times, each = vector.dot, vector.plus, vector.minus, vector.times,
  vector.each
local abs, floor, max, min, sqrt = math.abs, math.floor, math.max, math.min, math.sqrt

local physics = {}

-- The length of a spring, never 0.
local function distance(e) return sqrt(dot(e, e) + 1e-20) end

-- ---- forces -------------------------------------------------------------------------------------

-- g(t) sin(2 pi f t) and g(t) cos(2 pi f t); 0 while the body settles.
local function drive(scene, t)
  local muscles = scene.actuation
  if not muscles or t < 0 then return 0, 0 end
  local turns, rise = muscles.frequency * t, muscles.ramp / muscles.frequency
  local angle, g = 2 * math.pi * (turns - floor(turns)), t < rise and t / rise or 1
  return g * math.sin(angle), g * math.cos(angle)
end

local function add_springs(world, f, x, p, t)
  local sine, cosine = drive(world.scene, t)
  for _, s in ipairs(world.springs) do
    local e, w = minus(x[s.j], x[s.i]), minus(p[s.j], p[s.i])
    local r, L = distance(e), s.L + s.a * sine + s.b * cosine
    if world.control then L = L + control.change(world, s, t, world.dt) end
    local scale = s.k - (s.k * L - s.c * dot(w, e) / r) / r
    f[s.i], f[s.j] = plus(f[s.i], scale, e), plus(f[s.j], -scale, e)
  end
end

local function add_self_collision(world, f, x, p)
  local law = world.scene.self_collision
  for _, pair in ipairs(world.pairs) do
    local a, b = pair[1], pair[2]
    local e, w = minus(x[b.i], x[a.i]), minus(p[b.i], p[a.i])
    local r = distance(e)
    local c = 2 * law.damping_ratio * sqrt(law.stiffness * a.m * b.m / (a.m + b.m))
    local depth, rate = law.reach * world.edge - r, dot(w, e) / r
    local N = depth > 0 and max(0, law.stiffness * depth - c * rate) / r or 0
    f[a.i], f[b.i] = plus(f[a.i], -N, e), plus(f[b.i], N, e)
  end
end

-- All forces at positions x and time t; those that depend on velocity read p.
local function forces(world, x, p, t)
  local gravity, wind = world.scene.gravity, world.scene.wind
  local f = each(#x, function(i)
    local fall = times(world.masses[i].m, gravity and gravity.acceleration or { 0, 0, 0 })
    return wind and plus(fall, wind.drag, minus(wind.velocity, p[i])) or fall
  end)
  if world.scene.self_collision then add_self_collision(world, f, x, p) end
  add_springs(world, f, x, p, t)
  for _, contact in ipairs(world.contacts) do
    for i, mass in ipairs(world.masses) do
      local N, normal = contacts.push(contact, mass.m, x[i], p[i])
      f[i] = plus(f[i], N, normal)
    end
  end
  return f
end

-- ---- impulses -----------------------------------------------------------------------------------

-- The impulse of the fluid on one face over h.
local function drag_on(drag, corners, x, p, w, h)
  local function at(list, k) return list[corners[k].i] end
  local function flow(v, area)
    local sum = plus(plus(plus(at(v, 1), 1, at(v, 2)), 1, at(v, 3)), 1, at(v, 4))
    return dot(plus(times(0.25, sum), -1, drag.current), area)
  end
  local area = vector.cross(minus(at(x, 4), at(x, 1)), minus(at(x, 3), at(x, 2)))
  area = times(0.5, area)
  local now = flow(p, area)
  local wanted = drag.density * drag.coefficient / 2 * h * abs(now) * now
  local lightest = min(corners[1].m, corners[2].m, corners[3].m, corners[4].m)
  local most = lightest / 2 * flow(w, area)
  local taken = max(min(wanted, max(most, 0)), min(most, 0))
  return times(-taken / (dot(area, area) + 1e-20), area)
end

local function add_drag(world, x, p, w, h)
  for axis = 0, world.scene.drag and 2 or -1 do
    local after = each(#w, function(i) return w[i] end)
    for _, face in ipairs(world.faces) do
      if face.axis == axis and face.n == 1 then
        local impulse = drag_on(world.scene.drag, face.corners, x, p, w, h)
        for _, mass in ipairs(face.corners) do
          after[mass.i] = plus(after[mass.i], mass.inverse / 4, impulse)
        end
      end
    end
    for i = 1, #w do w[i] = after[i] end
  end
end

-- ---- integrators --------------------------------------------------------------------------------

-- a + s b of all masses.
local function moved(a, s, b) return each(#a, function(i) return plus(a[i], s, b[i]) end) end

local function kicked(world, u, f, h)
  return each(#u, function(i) return plus(u[i], h * world.masses[i].inverse, f[i]) end)
end

-- Each integrator advances the state by a step and returns the velocities at its start.
local steps = {}

function steps.leapfrog(world, state, n, t, dt, euler)
  local x, u, p = state.x, state.u, state.p
  local first = n == 0 and not euler
  local h = first and dt / 2 or dt
  local f, solid, friction = forces(world, x, p, t), world.block, world.scene.friction
  if solid then block.forces(solid, world, f, x, p) end
  local w = kicked(world, u, f, h)
  add_drag(world, x, p, w, h)
  if solid then block.kick(solid, h) end
  if solid and friction then block.rub(solid, friction, solid.masses, u, w, h) end
  for _, contact in ipairs(world.contacts) do
    for i, mass in ipairs(world.masses) do
      local N, normal = contacts.push(contact, mass.m, x[i], p[i])
      w[i] = contacts.rubbed(friction, N, normal, mass, u[i], w[i], h)
    end
  end
  if solid and friction then block.rub(solid, friction, solid.corners, u, w, h) end
  if solid then block.drift(solid, dt, euler and 0 or first and 1 or 0.5) end
  local change = moved(w, -1, u)
  state.x, state.u = moved(x, dt, w), w
  state.p = euler and w or moved(w, first and 1 or 0.5, change)
  return (euler or first) and u or moved(u, 0.5, change)
end

function steps.symplectic_euler(world, state, n, t, dt)
  return steps.leapfrog(world, state, n, t, dt, true)
end

function steps.rk4(world, state, _, t, dt)
  local x, v = state.x, state.u
  local still = moved(v, -1, v)
  local function acceleration(at, of, time)
    return kicked(world, still, forces(world, at, of, time), 1)
  end
  local a1 = acceleration(x, v, t)
  local v2 = moved(v, dt / 2, a1)
  local a2 = acceleration(moved(x, dt / 2, v), v2, t + dt / 2)
  local v3 = moved(v, dt / 2, a2)
  local a3 = acceleration(moved(x, dt / 2, v2), v3, t + dt / 2)
  local v4 = moved(v, dt, a3)
  local a4 = acceleration(moved(x, dt, v3), v4, t + dt)
  local function mean(a, b, c, d) return moved(moved(moved(a, 2, b), 2, c), 1, d) end
  state.x = moved(x, dt / 6, mean(v, v2, v3, v4))
  state.u = moved(v, dt / 6, mean(a1, a2, a3, a4))
  state.p = state.u
  return v
end

-- ---- a run --------------------------------------------------------------------------------------

-- Puts the body's lowest corner at its position, and finds the masses that anchors hold.
local function start(world, options)
  local held, low = world.scene.anchors, { 1e9, 1e9, 1e9 }
  for _, mass in ipairs(world.masses) do
    low = each(3, function(axis) return min(low[axis], mass.site[axis]) end)
  end
  local x, u = {}, {}
  for i, mass in ipairs(world.masses) do
    local place = times(world.edge, minus(mass.site, low))
    local is_held = held ~= nil
    for axis = 1, 3 do
      is_held = is_held and place[axis] >= held.from[axis] - 1e-6
        and place[axis] <= held.to[axis] + 1e-6
    end
    mass.inverse = is_held and 0 or 1 / mass.m
    x[i], u[i] = plus(options.position, 1, place), is_held and { 0, 0, 0 } or options.velocity
  end
  return { x = x, u = u, p = u }
end

---@class physics.sample
---@field x number[][] positions, [mass][3], m
---@field v number[][] velocities at the same time, m/s
---@field block number[]|nil centre and orientation of the block, as its trace has them

--- Simulates a robot, as `robot:table()` describes it.
---@param robot limax.robot.description
---@param scene table with every field, as `engine.scene(...):table()` has it
---@param options table resolved, with a fixed `time_step` and `record.position`, Hz
---@param signal? function the controller of scene.control, as control.new takes it
---@return physics.sample[] samples from t = 0 to the end
---@return table[] masses `m` of each, kg
function physics.run(robot, scene, options, signal)
  local world = body.of(robot, options.sharing)
  world.dt = options.time_step
  world.scene, world.edge, world.contacts = scene, robot.edge, contacts.of(scene)
  world.block = scene.block and block.new(scene.block[1], options.position)
  world.pairs = scene.self_collision and body.contact_pairs(world.masses)
  world.control = scene.control and control.new(world.voxels, signal, robot.control)
  for _, s in ipairs(world.springs) do s.c = scene.damping and s.c or 0 end
  local state, samples, dt = start(world, options), {}, options.time_step
  local function whole(seconds) return floor(seconds / dt + 0.5) end
  local settle, every = whole(options.settle), whole(1 / options.record.position)
  for n = 0, settle + whole(options.duration) do
    if world.control and n >= settle and (n - settle) % whole(1 / scene.control.rate) == 0 then
      control.act(world, state.x, state.p)
    end
    local sample = { x = state.x, block = world.block and block.row(world.block) }
    sample.v = steps[options.integrator](world, state, n, (n - settle) * dt, dt)
    if n >= settle and (n - settle) % every == 0 then samples[#samples + 1] = sample end
  end
  return samples, world.masses
end

return physics
