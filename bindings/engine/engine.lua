--- engine.lua: the engine's objects for Lua, over the C interface of limax.h. Indices count from 1,
--- every failure raises at the caller's line, every object has `:free()` and keeps what it needs
--- alive. The library in scripts/lib uses this; scripts rarely need it.

local abi = require "limax.engine.abi"
local device = require "limax.engine.device"
local encoding = require "limax.engine.encoding"
local fault = require "limax.engine.fault"
local materials = require "limax.engine.materials"
local memory = require "limax.engine.memory"
local modes = require "limax.engine.modes"
local names = require "limax.engine.names"
local pareto = require "limax.engine.pareto"
local population = require "limax.engine.population"
local random = require "limax.engine.random"
local scene = require "limax.engine.scene"
local script_slopes = require "limax.engine.script_slopes"
local simulation = require "limax.engine.simulation"
local view = require "limax.engine.view"

---@class limax.engine
---@field version string of the engine's library
---@field names table the enumerations of the C interface: traces, integrators, states
return {
  version = abi.version,
  names = names,

  device = device.device,
  materials = materials.materials,
  encoding = encoding.encoding,
  population = population.population,
  effects = scene.effects,
  sensors = scene.sensors,
  scene = scene.scene,
  simulation = simulation.simulation,
  advance_together = simulation.advance_together,
  begin_together = simulation.begin_together,
  modes = modes,
  script_slopes = script_slopes,
  random = random,
  pareto = pareto,

  is_view = view.is_view,
  bytes_held = memory.bytes_held,
  collect = memory.collect,
  fail = fault.raise,
  where = fault.where,
  place = fault.place,
}
