--- witness.lua: sees what a test simulates, so that its goldens know of which configuration they
--- are. While a test runs, `engine.simulation` is followed; what it is given is kept as a hash.

local ffi = require "ffi"
local choice = require "limax.base.choice"
local engine = require "limax.engine"
local host = require "limax.host"

local witness = {}

---@class limax.test_witness
---@field hashes string[] of each simulation begun so far
---@field varied table<string, boolean> options that the test's matrix varies
local methods = {}
local class = { __index = methods }

-- What tells the bodies of a population apart: materials and weights of every voxel.
local function bodies_of(population)
  local bytes = 3 * population.voxels_each * ffi.sizeof "float"
  local parts = { table.concat(population.lattice, " ") }
  for i = 1, population.count do
    local weights = ffi.string(population:weights(i):pointer(), bytes)
    parts[#parts + 1] = population:body(i).hash .. host.sha256(weights)
  end
  return host.sha256(table.concat(parts, "\n"))
end

function methods:see(population, materials, scene, options)
  local settings = {}
  for _, name in ipairs(choice.sorted_keys(options or {})) do
    if not self.varied[name] then settings[name] = options[name] end
  end
  local text = host.json.encode { bodies = bodies_of(population), materials = materials:table(),
    scene = scene:table(), settings = settings }
  self.hashes[#self.hashes + 1] = host.sha256(text)
end

--- Begins to look.
function methods:begin()
  local simulation = engine.simulation
  self.before = simulation
  engine.simulation = function(population, materials, scene, options, ...)
    local object = simulation(population, materials, scene, options, ...)
    self:see(population, materials, scene, options)
    return object
  end
end

--- Ends it.
function methods:finish() engine.simulation = self.before end

--- Calls `make` and keeps what it simulates apart.
---@param make fun(): any
---@return any value that it returned
---@return string[] hashes
function methods:aside(make)
  local own = self.hashes
  self.hashes = {}
  local value = make()
  local apart = self.hashes
  self.hashes = own
  return value, apart
end

--- Adds what was kept apart.
---@param hashes string[]
function methods:add(hashes)
  for _, hash in ipairs(hashes) do table.insert(self.hashes, hash) end
end

--- The hash of all that was seen so far, and of what the test adds; nil of nothing.
---@param added table|nil
---@return string|nil
function methods:hash(added)
  if not added and #self.hashes == 0 then return nil end
  return host.sha256(host.json.encode { added = added, simulated = host.json.array(self.hashes) })
end

--- A witness of a test with this matrix.
---@param axes table<string, any[]>
---@return limax.test_witness
function witness.new(axes)
  return setmetatable({ hashes = {},
    varied = { precision = axes.precision ~= nil, integrator = axes.integrator ~= nil } }, class)
end

return witness
