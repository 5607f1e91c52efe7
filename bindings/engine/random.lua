--- random.lua: random numbers for scripts. They depend only on seed, repetition, stream,
--- generation, individual and draw.

local ffi = require "ffi"
local abi = require "limax.engine.abi"
local names = require "limax.engine.names"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"

local C = abi.C

-- the counter has 24 bits for a repetition
local repetition_rule = schema.whole(1, 2 ^ 24 - 1)
local counter_rule = schema.whole(0, 2 ^ 32 - 1, 0)
local stream_rule = schema.choice(names.stream.names)

---@class limax.random
---@field draw integer numbers drawn so far
local methods = strict.methods "random"
local class = { __index = methods, __newindex = strict.read_only("a random stream",
  "what a function keeps is in its last argument, `state`") }

-- The number of the next draw.
local function next_draw(self)
  self.draw = self.draw + 1
  return self.draw - 1
end

--- Uniform in [0, 1).
---@return number
function methods:uniform() return (C.limax_random_uniform(self.key, next_draw(self))) end

--- Standard normal, N(0, 1).
---@return number
function methods:normal() return (C.limax_random_normal(self.key, next_draw(self))) end

--- One of 1, 2, ... n, or of least, least + 1, ... most.
---@param n integer n, or least
---@param most integer|nil
---@return integer
function methods:integer(n, most)
  local least = 1
  if most == nil then most = n else least = n end
  if type(least) ~= "number" or type(most) ~= "number" or least ~= math.floor(least)
    or most ~= math.floor(most) or not (least <= most and most - least < 2 ^ 32 - 1) then
    schema.refuse("random:integer", "a whole number from 1 to 2^32 - 1, or two of them, least <= "
      .. "most", least == 1 and most or ("%s, %s"):format(tostring(n), tostring(most)))
  end
  return C.limax_random_integer(self.key, next_draw(self), most - least + 1)
    + least
end

--- A stream of random numbers.
---@param seed number|string|ffi.cdata*
---@param repetition integer 1, 2, ...
---@param stream "selection"|"supervision"|"user"|"variation"
---@param generation integer|nil 0 if left out
---@param individual integer|nil 0 if left out
---@return limax.random
local function random(seed, repetition, stream, generation, individual)
  local key = ffi.new "limax_random_key"
  key.seed = schema.uint64(seed, "random: seed")
  key.repetition = schema.demand(repetition_rule, repetition, "random: repetition")
  key.stream = names.stream.value[schema.demand(stream_rule, stream, "random: stream")]
  key.generation = schema.demand(counter_rule, generation, "random: generation")
  key.individual = schema.demand(counter_rule, individual, "random: individual")
  return setmetatable({ key = key, draw = 0 }, class)
end

function class:__tostring() return ("random (%d drawn)"):format(self.draw) end

return random
