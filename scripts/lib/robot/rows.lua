--- rows.lua: the robots of a generation as one structured array: the same bytes in memory and in
--- rNN/robots/gNNNN.npy. records.lua declares its fields; `all[i].fitness` is one of robot i
--- (row.lua). On several ranks of mpirun each has all fields of its own share of the robots only,
--- and of all others a brief array: what ranking, survival and selection read.

local bit = require "bit"
local ffi = require "ffi"
local new_table = require "table.new"

local bodies = require "limax.engine.bodies"
local body = require "limax.robot.body"
local names = require "limax.engine.names"
local outcome = require "limax.engine.outcome"
local record_rules = require "limax.settings.record_rules"
local records = require "limax.settings.records"
local row = require "limax.robot.row"
local source = require "limax.base.source"
local structured = require "limax.base.structured"

---@class limax.rows a list of limax.row
---@field facts limax.record_rules.facts decide the layout
---@field layout limax.structured.layout
---@field count integer robots
---@field data ffi.cdata* struct[count], or those of the share
---@field share limax.share|nil nil where all robots are here
---@field brief limax.structured.array|nil of all robots, with what other ranks have of them; own
--- ones are there after rows.outline, before which there is none where `only_own`
---@field lent table<integer, limax.structured.array>|nil arrays with whole robots of others
---@field lent_at table<integer, integer>|nil their places there, from 0
---@field stored? fun(): limax.rows whole rows from a run folder
---@field materials string[]|nil their names, in the order of the bodies' counts
---@field only_own boolean there is no self[i] of a robot of another rank until it is lent
---@field stamp integer changes with every write
local Rows = {}
Rows.__index = Rows

local rows = { record = row.record }

-- Fields that other ranks do not have.
local OF_RANK = { generation = true, parents = true, origin = true, body = true, mass = true,
  letters = true, outcome = true, reason = true, entered = true, cell = true }
local HASH = { name = "hash", kind = "u8" } -- of the body

local BODY_UNKNOWN = names.body_status.value.unknown
local DONE = names.robot_status.value.done
local OUTCOME_SIZE = ffi.sizeof "limax_outcome"

-- The fields that simulations, fitness and archive write.
local OF_SCORE = {}
for _, field in ipairs(records.robot) do
  if field.by == "simulate" or field.by == "score" or field.by == "archive" then
    OF_SCORE[#OF_SCORE + 1] = field[1]
  end
end

-- ---- arrays -------------------------------------------------------------------------------------

-- A robot without values, for each layout.
local blanks = setmetatable({}, { __mode = "k" })

local function blank_of(self)
  local blank = blanks[self.layout]
  if not blank then
    blank = structured.new(self.layout, 1)
    row.clear(blank.data[0], self)
    blanks[self.layout] = blank
  end
  return blank
end

-- Clears so many robots of an array.
local function clear(array, count)
  structured.copy(array, 0, blank_of(array), 0, math.min(count, 1))
  local filled = 1
  while filled < count do
    local more = math.min(filled, count - filled)
    structured.copy(array, filled, array, 0, more)
    filled = filled + more
  end
end

-- The brief array of a generation that nothing reads anymore: new pages would cost more time than
-- all that is done with it.
local spare

-- Makes the array of what other ranks have.
local function make_brief(self)
  local known = {}
  for _, field in ipairs(self.layout.fields) do
    if not OF_RANK[field.name] then known[#known + 1] = field end
  end
  known[#known + 1] = HASH
  local layout = structured.layout(known)
  if spare and spare.layout == layout and spare.count == self.count then
    self.brief, spare = spare, nil
  else
    self.brief = structured.new(layout, self.count)
  end
  self.brief.facts = self.facts
end

-- Makes an array for robots of these facts, without values.
local function lay_out(self, facts)
  local fields = record_rules.robot_fields(facts)
  local count = self.share and self.share.count or self.count
  local array = structured.new(structured.layout(fields), count)
  self.facts, self.layout, self.data = facts, array.layout, array.data
  clear(self, count)
  if self.share then
    self.lent, self.lent_at = {}, {}
    if not self.only_own or self.brief then
      make_brief(self)
      clear(self.brief, self.count)
    end
  end
  self.stamp = self.stamp + 1
end

--- Makes robots without values.
---@param share? limax.share the robots that this rank has; all if left out
---@param only_own? boolean there is no self[i] of a robot of another rank until it is lent
function rows.new(facts, count, share, only_own)
  only_own = share ~= nil and only_own
  local self = setmetatable(only_own and {} or new_table(count, 16), Rows)
  self.count, self.stamp, self.share, self.only_own = count, 0, share, only_own
  for k = 1, only_own and share.count or count do
    local i = only_own and share:number(k) or k
    self[i] = row.of(self, i)
  end
  lay_out(self, facts)
  return self
end

--- Brings all fields of a robot of another rank, where the run folder has it.
---@return limax.rows an array that has it
---@return integer its place there, from 0
function Rows:ask(i)
  if self.stored then return self.stored(), i - 1 end
  error(("robots[%d] is of another rank of mpirun, which has most of its fields: a survival, a"
    .. " selection or a supervisor may read them"):format(i), 0)
end

--- All robots once they were scored, with what ranking and metrics read: one array is read several
--- times as fast as two.
---@return limax.structured.array
function rows.scored(self)
  if not self.share then return self end
  return assert(self.brief, "the robots of other ranks have not arrived")
end

--- The robots whose bodies' hashes are in one of equal parts of all hashes, once they were scored.
---@param part integer from 0
---@return integer[]
function rows.with_hashes(self, part, parts)
  local brief, data, list, count = self.brief, rows.scored(self).data, {}, 0
  local first, last = 2 ^ 32 * part / parts, 2 ^ 32 * (part + 1) / parts
  for i = 1, self.count do
    local hash
    if brief then hash = data[i - 1].hash else hash = data[i - 1].body.hash end
    local high = tonumber(bit.rshift(hash, 32))
    if high >= first and high < last then
      count = count + 1
      list[count] = i
    end
  end
  return list
end

--- Was robot i not simulated yet, nor failed before?
function rows.is_waiting(self, i)
  local array, at = row.held(self, i)
  return array.data[at].status[0] == 0
end

--- The id of robot i.
function rows.id(self, i)
  local array, at = row.held(self, i)
  return tonumber(array.data[at].id)
end

--- The island of robot i.
function rows.island(self, i)
  local array, at = row.held(self, i)
  return tonumber(array.data[at].island)
end

--- The hash of robot i's body.
---@return ffi.cdata* uint64_t
function rows.hash(self, i)
  local array, at = row.held(self, i)
  return array == self.brief and array.data[at].hash or array.data[at].body.hash
end

--- Writes what other ranks get of the own robots into the brief array.
function rows.outline(self)
  if not self.brief then make_brief(self) end
  for _, part in ipairs(self.share:segments()) do
    structured.copy(self.brief, part.first, self, part.place, part.count)
    for k = 0, part.count - 1 do
      self.brief.data[part.first + k].hash = self.data[part.place + k].body.hash
    end
  end
end

--- Frees what a generation that was bred has of robots of other ranks.
function rows.forget_others(self)
  if self.only_own then spare, self.brief = self.brief, nil end
end

--- Makes self[i] of robots of a list, where there are none.
function rows.show(self, list)
  for _, i in ipairs(list) do self[i] = self[i] or row.of(self, i) end
end

--- Keeps whole robots of a list, row k of an array of the same layout being robot list[k].
function rows.lend(self, list, array)
  rows.show(self, list)
  for k, i in ipairs(list) do self.lent[i], self.lent_at[i] = array, k - 1 end
  self.stamp = self.stamp + 1
end

--- Takes an array of all robots, of the same layout, in place of those of the share.
function rows.complete(self, array)
  for i = 1, self.count do self[i] = self[i] or row.of(self, i) end
  self.data, self.share, self.brief, self.lent, self.lent_at = array.data, nil, nil, nil, nil
  self.stamp = self.stamp + 1
end

--- The characters of a body's letters in a lattice.
---@param lattice integer[] voxels along x, y, z
function rows.letters(lattice)
  local nx, ny, nz = unpack(lattice)
  return (nx + 1) * ny * nz + nz - 2 -- lines, and lines between layers, without the last line end
end

--- Adds fields for cases and measures that a fitness returned, once for each new one.
---@param cases integer how many
---@param measures string[] names
function rows.widen(self, cases, measures)
  local had, found, list = self.facts, {}, {}
  for _, each in ipairs { had.measures or {}, measures } do
    for _, name in ipairs(each) do
      if not found[name] then list[#list + 1] = name end
      found[name] = true
    end
  end
  if cases <= (had.cases or 0) and #list == #(had.measures or {}) then return end
  table.sort(list)
  local facts = source.copy(had)
  facts.cases, facts.measures = math.max(cases, had.cases or 0), list[1] and list or nil
  local before, brief = { layout = self.layout, data = self.data }, self.brief
  lay_out(self, facts)
  structured.copy(self, 0, before, 0, self.share and self.share.count or self.count)
  if brief then structured.copy(self.brief, 0, brief, 0, self.count) end
end

-- Adds a field for a value of `cases` or `measures`.
function Rows:expect(name, value)
  if name == "cases" then return rows.widen(self, #value, {}) end
  local list = {}
  for measure in pairs(value) do list[#list + 1] = measure end
  rows.widen(self, 0, list)
end

--- Copies robots: robot `sources[k]` of `from` becomes robot `places[k]`.
function rows.copy(self, places, from, sources)
  for k, i in ipairs(places) do
    local to, at = row.held(self, i)
    if to ~= self.brief then
      local array, place = row.whole(from, sources[k])
      structured.copy(to, at, array, place, 1)
    elseif from.brief then -- which has all of them since they were scored
      structured.copy(to, at, from.brief, sources[k] - 1, 1)
    else
      structured.copy(to, at, from, sources[k] - 1, 1)
      to.data[at].hash = rows.hash(from, sources[k])
    end
  end
  self.materials = self.materials or from.materials
  self.stamp = self.stamp + 1
end

-- Copies one robot into an array of its own, with other facts if they are given.
local function row_copy(robot, facts)
  local one = rows.new(facts or robot[1].facts, 1)
  rows.copy(one, { 1 }, robot[1], { robot[2] })
  return one
end

--- A copy of one robot, which keeps no generation in memory.
function rows.single(robot) return row_copy(robot)[1] end

-- ---- robots by hand, and their trials -----------------------------------------------------------

--- Describes the robots of a population whose bodies are unknown.
---@param population limax.population expressed
---@param number? fun(k: integer): integer the row of its robot k; k if left out
function rows.describe(self, population, materials, number)
  local facts = body.facts(materials)
  local texts, size = bodies.texts(population, facts.letters)
  local shapes, length = bodies.shapes(population), size - 2 -- less a line end and a zero byte
  self.materials = facts.names
  for k = 1, population.count do
    local each = row.struct(self, number and number(k) or k, "body")
    if each.body.status == BODY_UNKNOWN then
      each.body = shapes[k - 1]
      ffi.copy(each.letters, texts + (k - 1) * size, length)
      each.mass = body.mass(population, k, each.body.masses, facts)
    end
  end
  self.stamp = self.stamp + 1
end

--- A robot by hand that was simulated.
---@param described { id?: integer, generation?: integer, parents?: integer[] }
---@param population limax.population its body is robot 1
function rows.by_hand(described, population, materials, simulation)
  local one = rows.new({ letters = rows.letters(population.lattice) }, 1)
  one[1].id, one[1].generation = described.id or 1, described.generation or 0
  one[1].parents, one[1].origin = described.parents, "hand"
  rows.describe(one, population, materials)
  rows.settle(one, { simulation }, { 1 })
  return one[1]
end

--- Robots by hand that were simulated together.
---@param population limax.population
function rows.together(population, materials, simulation)
  local all, at = rows.new({ letters = rows.letters(population.lattice) }, population.count), {}
  for i = 1, all.count do all[i].id, all[i].origin, at[i] = i, "hand", i end
  rows.describe(all, population, materials)
  rows.settle(all, { simulation }, at)
  return all
end

--- A robot by hand that was simulated in several trials.
---@param list limax.row[] of each trial
---@param population limax.population its body is robot 1
function rows.joined(list, population, materials)
  local facts = source.copy(list[1][1].facts)
  facts.trials = #list
  local one = row_copy(list[1], facts)
  for k, robot in ipairs(list) do
    ffi.copy(one.data[0].outcome[k - 1], robot[1].data[0].outcome, OUTCOME_SIZE)
  end
  one.data[0].body.status = BODY_UNKNOWN
  rows.describe(one, population, materials)
  rows.set_status(one, 1)
  return one[1]
end

--- A robot in one of its trials only, without a score.
---@param robot limax.row with trials
function rows.of_trial(robot, k)
  local facts = source.copy(robot[1].facts)
  facts.trials, facts.cases, facts.measures = nil, nil, nil
  local one = row_copy(robot, facts)
  rows.forget(one, 1)
  ffi.copy(one.data[0].outcome, rows.outcomes(robot)[k], OUTCOME_SIZE)
  rows.set_status(one, 1)
  return one[1]
end

-- ---- what simulations and fitness gave ----------------------------------------------------------

--- Clears the outcome and the score of robot i.
function rows.forget(self, i)
  local array, at = row.held(self, i)
  local each = ffi.cast("uint8_t *", array.data + at)
  local blank = ffi.cast("const uint8_t *", blank_of(array).data)
  for _, name in ipairs(OF_SCORE) do
    local place = array.layout.places[name]
    if place then ffi.copy(each + place.offset, blank + place.offset, place.size) end
  end
  self.stamp = self.stamp + 1
end

local LIMITS = { speed = "max_speed", stretch = "max_stretch" }

--- A reason as messages show it.
---@param reason string of a row or an outcome
---@param options? table the settings of its simulation
function rows.explained(reason, options)
  return (reason:gsub("%a+$", function(word)
    local field = LIMITS[word]
    if word == "control" then return "control: the controller gave a value that is not finite" end
    return field and ("%s beyond simulation.%s%s"):format(word, field,
      options and options[field] and (", %.6g"):format(options[field]) or "")
  end))
end

--- Sets status and reason of robot i from its outcomes: done if all ended well, else the status of
--- the first one that did not.
function rows.set_status(self, i)
  local robot, each = self[i], row.struct(self, i, "outcome")
  for k = 1, self.facts.trials or 1 do
    local o = row.outcome_at(self, each, k)
    if o.status ~= DONE then
      local status, reason = outcome.status(o)
      if self.facts.trials and status == "diverged" then
        reason = ("trial %d: %s"):format(k, reason)
      end
      robot.status, robot.reason = status, reason
      return
    end
  end
  robot.status, robot.reason = "done", nil
end

--- Fills in robot i, which is bred from two others.
---@param self limax.rows without values there
---@param first integer id of a parent
function rows.bear(self, i, generation, id, first, second)
  local each = row.struct(self, i, "parents")
  each.id, each.generation, each.parents[0], each.parents[1] = id, generation, first, second
  ffi.copy(each.origin, "bred")
end

--- Copies the outcomes of robots from their simulations, one per trial.
---@param at table<integer, integer> the place in the simulations of each row that is copied
function rows.settle(self, simulations, at)
  for k, simulation in ipairs(simulations) do
    local all = outcome.all(simulation)
    for i, place in pairs(at) do
      ffi.copy(row.outcome_at(self, row.struct(self, i, "outcome"), k), all + (place - 1),
        OUTCOME_SIZE)
    end
  end
  for i in pairs(at) do rows.set_status(self, i) end
end

--- The engine's outcomes of a robot, one per trial.
---@return ffi.cdata*[] limax_outcome
function rows.outcomes(robot)
  local all, list = robot[1], {}
  local each = row.struct(all, robot[2], "outcome")
  for k = 1, all.facts.trials or 1 do list[k] = row.outcome_at(all, each, k) end
  return list
end

--- The engine's outcome of a robot that ended well, of its first trial if it has trials; nil for
--- other robots.
---@return ffi.cdata*|nil limax_outcome
function rows.done(robot)
  local o = row.outcome_at(robot[1], row.struct(robot[1], robot[2], "outcome"))
  return o.status == DONE and o or nil
end

--- Is a step of any simulation of a robot coarse?
function rows.is_coarse(robot)
  local all = robot[1]
  local each = row.struct(all, robot[2], "outcome")
  for k = 1, all.facts.trials or 1 do
    if row.outcome_at(all, each, k).coarse ~= 0 then return true end
  end
  return false
end

return rows
