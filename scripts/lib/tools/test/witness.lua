--- witness.lua: hashes what a test simulates, so that its goldens are tied to that configuration.
--- While a test runs, `engine.simulation` is wrapped.

local ffi = require "ffi"
local choice = require "limax.base.choice"
local engine = require "limax.engine"
local host = require "limax.host"

local witness = {}

---@class limax.test_witness
---@field hashes string[] of each simulation so far
---@field varied table<string, boolean> options that the test's matrix varies
local methods = {}
local class = { __index = methods }

-- Materials and weights of every voxel.
local function hash_of_bodies(population)
  local bytes = 3 * population.voxels_each * ffi.sizeof "float"
  local parts = { table.concat(population.lattice, " ") }
  for i = 1, population.count do
    local weights = ffi.string(population:weights(i):pointer(), bytes)
    parts[#parts + 1] = population:body(i).hash .. host.sha256(weights)
  end
  return host.sha256(table.concat(parts, "\n"))
end

function methods:add_simulation(population, materials, scene, options)
  local settings = {}
  for _, name in ipairs(choice.sorted_keys(options or {})) do
    if not self.varied[name] then settings[name] = options[name] end
  end
  self:add { host.sha256(host.json.encode { bodies = hash_of_bodies(population),
    materials = materials:table(), scene = scene:table(), settings = settings }) }
end

function methods:begin()
  local simulation = engine.simulation
  self.wrapped = simulation
  engine.simulation = function(population, materials, scene, options, ...)
    local object = simulation(population, materials, scene, options, ...)
    self:add_simulation(population, materials, scene, options)
    return object
  end
end

function methods:finish() engine.simulation = self.wrapped end

--- Calls `make` and keeps the hashes of what it simulates separate.
---@param make fun(): any
---@return any value that it returned
---@return string[] hashes
function methods:aside(make)
  local own = self.hashes
  self.hashes = {}
  local value = make()
  local separate = self.hashes
  self.hashes = own
  return value, separate
end

function methods:add(hashes)
  for _, hash in ipairs(hashes) do table.insert(self.hashes, hash) end
end

--- The hash of everything so far and of the test's own table; nil of nothing.
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
