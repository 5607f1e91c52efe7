--- division.lua: a generation on several ranks of mpirun. All have all robots; each simulates and
--- scores a slice of those without a score, and gets the results of the others. Each breeds the
--- whole generation. The next exchange detects a rank that computes something else.

local ffi = require "ffi"

local engine_population = require "limax.engine.population"
local exchange = require "limax.base.exchange"
local failure = require "limax.base.failure"
local host = require "limax.host"
local rows_file = require "limax.robot.rows_file"
local state = require "limax.run.state"

local division = {}

-- Robots of each generation whose genomes and bodies are compared: the last, which are offspring,
-- and others in the next generations.
local COMPARED = 256

-- Divides the robots of a mask into equal parts: a list of indices per rank, in order.
local function divide(mask)
  local list, slices, count = {}, {}, exchange.count
  for i = 1, #mask do
    if mask[i] then list[#list + 1] = i end
  end
  for r = 1, count do
    local first = math.floor(#list * (r - 1) / count)
    slices[r] = {}
    for k = first + 1, math.floor(#list * r / count) do slices[r][k - first] = list[k] end
  end
  return slices
end

--- The robots of a mask that this rank simulates.
function division.own(robots, mask)
  robots.slices = robots.slices or divide(mask)
  local own = {}
  for i = 1, #mask do own[i] = false end
  for _, i in ipairs(robots.slices[exchange.index + 1]) do own[i] = true end
  return own
end

-- Hashes of the genomes and bodies that each rank made, in the order in which they were made.
local function fingerprint(robots)
  local made, count = robots.engine, math.min(#robots, COMPARED)
  local others = #robots - count
  local first = others - robots.generation * COMPARED % (others + 1)
  local memory = ffi.new("float[?]", count * made.genes)
  engine_population.copy_genomes(made, memory, first, count)
  local numbers, all = {}, robots.rows.data
  local parents, bodies = ffi.new("int64_t[?][2]", #robots), ffi.new("uint64_t[?]", count)
  for name, value in pairs(robots.parameters) do numbers[name] = ("%.17g"):format(value) end
  for i = 0, #robots - 1 do parents[i] = all[i].parents end
  for k = 0, count - 1 do bodies[k] = all[first + k].body.hash end
  local function hash(values) return host.xxh3(ffi.string(values, ffi.sizeof(values))) end
  return { { "parameters", host.xxh3(host.json.encode(numbers)) }, { "parents", hash(parents) },
    { "genomes", hash(memory) }, { "bodies", hash(bodies) },
    { "state", robots.before.state and state.encode(robots.before.state) } }
end

local REASON = "; its functions may depend only on their arguments, not on a clock, a file, or"
  .. " variables of the script"

-- Raises if ranks made different robots.
local function compare_made(robots, messages)
  for r = 2, #messages do
    for k, part in ipairs(messages[1].made) do
      if messages[r].made[k][2] ~= part[2] then
        failure.raise(1, ("generation %d: the %s of ranks 0 and %d differ: a function of the"
          .. " experiment gave them different results%s"):format(robots.generation, part[1], r - 1,
          REASON))
      end
    end
  end
end

-- Raises if functions that score robots wrote to the state, which other ranks do not receive.
local function check_state(robots, own_state)
  local before = robots.before.state
  if before and state.encode(own_state) ~= state.encode(before) then
    failure.raise(2, "the fitness, a descriptor or an objective writes to `state`: on several ranks"
      .. " of mpirun each scores a part of the robots only. Write to it in the survival or the"
      .. " selection, or run on one rank")
  end
end

-- Copies the robots that another rank scored into this generation.
local function take(robots, slice, bytes)
  if not slice[1] then return end
  local sent, message = rows_file.read(bytes, robots.rows.materials)
  if not sent then failure.raise(1, "a rank sent robots that cannot be read: it " .. message) end
  local all = robots.rows.data
  for k, i in ipairs(slice) do
    local one, own = sent.data[k - 1], all[i - 1]
    if one.id ~= own.id or one.body.hash ~= own.body.hash then
      failure.raise(1, ("generation %d: the bodies of ranks differ"):format(robots.generation)
        .. REASON)
    end
  end
  rows_file.take(robots.rows, slice, sent)
end

--- Sends the robots that this rank scored to all others, and receives theirs.
---@param robots limax.population.scored simulated and scored here
---@param failures scoring.failure[] of the robots that were scored here
---@param own_state table|nil that the functions that score may have written to
function division.exchange(robots, failures, own_state)
  if not robots.slices then return failures end
  check_state(robots, own_state)
  local all, slices, r = robots.rows, robots.slices, exchange.index + 1
  local began = host.clock()
  local messages = exchange.all { made = fingerprint(robots), failures = failures,
    warnings = exchange.take_warnings(), robots = rows_file.pack(all, slices[r]) }
  robots.timing.ranks = host.clock() - began
  compare_made(robots, messages)
  local failed = {}
  for k, message in ipairs(messages) do
    if k ~= r then take(robots, slices[k], message.robots) end
    for _, each in ipairs(message.failures) do failed[#failed + 1] = each end
    for _, each in ipairs(message.warnings) do robots.world.say(each.text, each.key) end
  end
  return failed
end

return division
