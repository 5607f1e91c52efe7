--- control.lua: the controller of a robot, section 12 of engine/PHYSICS.md: what its voxels sense
--- of themselves, its ticks, and the rest lengths between two.

local vector = require "support.physics.vector"

local dot, plus, length, single = vector.dot, vector.plus, vector.length, vector.single
local max, min = math.max, math.min

local control = {}

-- Faces of a voxel: -x, +x, -y, +y, -z, +z.
local SIDES = { { -1, 0, 0 }, { 1, 0, 0 }, { 0, -1, 0 }, { 0, 1, 0 }, { 0, 0, -1 }, { 0, 0, 1 } }

-- The mean edge of a voxel along an axis (1 to 3), of the places or velocities of masses.
local function mean_edge(corners, axis, list)
  local sum, bit = { 0, 0, 0 }, 2 ^ (axis - 1)
  for c = 0, 7 do
    local upper = math.floor(c / bit) % 2 == 1
    sum = plus(sum, upper and 0.25 or -0.25, list[corners[c].i])
  end
  return sum
end

-- What a voxel senses of itself, over the sensors' ranges.
local function sense(world, voxel, x, p)
  local sees, rate = { strain = {} }, 0
  for axis = 1, 3 do
    local e, w = mean_edge(voxel.corners, axis, x), mean_edge(voxel.corners, axis, p)
    sees.strain[axis] = (length(e) / world.edge - 1) / 0.2
    rate = rate + dot(e, w) / length(e) / world.edge / 3
  end
  sees.strain_rate = rate / 5
  local push, masses, touching, g = 0, 0, 0, world.scene.gravity
  for c = 0, 7 do
    local mass, touches = voxel.corners[c], 0
    for _, contact in ipairs(world.contacts) do
      local depth = contact.surface(contact.g, x[mass.i])
      if depth > 0 then push, touches = push + contact.k * depth, 1 end
    end
    touching, masses = touching + touches, masses + mass.m
  end
  -- rounded as the engine stores it
  sees.contact = touching / 8
  sees.load = g and push * single(1 / masses) / length(g.acceleration) / 4 or 0
  return sees
end

--- Outputs of a perceptron whose genes begin at g[first], counted from 0.
function control.perceptron(g, first, hidden, outputs, inputs)
  local row = math.ceil((#inputs + outputs) / 4) * 4
  local c, y = first + hidden * row, {}
  for o = 1, outputs do y[o] = g[c + hidden + o] end
  for unit = 0, hidden - 1 do
    local z, start = g[c + unit + 1], first + unit * row
    for k, input in ipairs(inputs) do z = z + g[start + k] * input end
    -- tanh
    z = 1 - 2 / (math.exp(2 * z) + 1)
    for o = 1, outputs do y[o] = y[o] + g[start + #inputs + o] * z end
  end
  return y
end

--- A controller at rest. `signal(sees, memory, g)` returns the activation and the messages that a
--- voxel says; `memory` is a table of its own.
function control.new(voxels, signal, genes)
  for _, voxel in ipairs(voxels) do
    voxel.from, voxel.to, voxel.memory, voxel.says, voxel.around = 0, 0, {}, {}, {}
    for side, step in ipairs(SIDES) do
      voxel.around[side] = voxels[table.concat(plus(voxel.at, 1, step), " ")] or false
    end
  end
  local rounded = {}
  for k, gene in ipairs(genes or {}) do rounded[k] = single(gene) end
  return { voxels = voxels, signal = signal, genes = rounded, tick = -1 }
end

--- A tick at positions x and velocities p.
function control.act(world, x, p)
  local own, law, said = world.control, world.scene.control, {}
  own.tick = own.tick + 1
  for _, voxel in ipairs(own.voxels) do said[voxel] = voxel.says end
  for _, voxel in ipairs(own.voxels) do
    local sees = sense(world, voxel, x, p)
    sees.t, sees.activation, sees.phase = own.tick / law.rate, voxel.to, voxel.phase
    sees.clock_sine = math.sin(2 * math.pi * law.frequency * sees.t)
    sees.heard = function(message, side)
      local other = voxel.around[side]
      return other and said[other][message] or 0
    end
    local a
    a, voxel.says = own.signal(sees, voxel.memory, own.genes)
    a = max(-1, min(1, max(voxel.to - law.change, min(voxel.to + law.change, a))))
    voxel.from, voxel.to = voxel.to, a
  end
end

--- How much longer a spring's rest length is at time t, with steps of dt.
function control.change(world, spring, t, dt)
  local own, law, from, to = world.control, world.scene.control, 0, 0
  if own.tick < 0 then return 0 end
  for _, voxel in ipairs(spring.owners) do
    from, to = from + voxel.gain * voxel.from, to + voxel.gain * voxel.to
  end
  if law.hold == 1 then from = to end
  -- rounded as the engine stores them
  local scale, since = single(spring.L / #spring.owners), t / dt - own.tick / law.rate / dt
  return single(scale * from) + single(scale * (to - from) * law.rate * dt) * since
end

return control
