--- rows.lua: the robots of a generation as one structured array: the same bytes in memory, between
--- ranks and in rNN/robots/gNNNN.npy. records.lua declares its fields. `rows[i]` reads and writes
--- those of robot i: `rows[i].fitness`; a field without a value is nil.

local bit = require "bit"
local ffi = require "ffi"

local bodies = require "limax.engine.bodies"
local body = require "limax.robot.body"
local names = require "limax.engine.names"
local outcome = require "limax.engine.outcome"
local record_rules = require "limax.settings.record_rules"
local records = require "limax.settings.records"
local structured = require "limax.base.structured"

local rows = {}

---@class limax.rows a list of limax.row
---@field facts limax.record_rules.facts decide the layout
---@field layout limax.structured.layout
---@field count integer robots
---@field data ffi.cdata* struct[count]
---@field materials string[]|nil their names, in the order of the bodies' counts
---@field stamp integer changes with every write

---@class limax.row a robot: { rows, index }
local Row = {}

local BODY_UNKNOWN = names.body_status.value.unknown
local DONE = names.robot_status.value.done
local OUTCOME_SIZE = ffi.sizeof "limax_outcome"

-- ---- one field of one robot ---------------------------------------------------------------------

-- Each reads and writes the field `name` of a C struct; nil is no value.
local readers, writers = {}, {}

function readers.whole(each, name) return tonumber(each[name]) end
function writers.whole(each, name, value) each[name] = value end

function readers.whole_or_none(each, name)
  local value = tonumber(each[name])
  if value >= 0 then return value end
end
function writers.whole_or_none(each, name, value) each[name] = value or -1 end

function readers.number(each, name)
  local value = each[name]
  if value == value then return value end
end
function writers.number(each, name, value) each[name] = value or 0 / 0 end

-- The width of a text, and the length of a list.
local function size_of(self, name)
  local place = self.layout.places[name]
  return place.size, place.field.count
end

function readers.text(each, name, self)
  local width = size_of(self, name)
  local memory, length = each[name], 0
  while length < width and memory[length] ~= 0 do length = length + 1 end
  if length > 0 then return ffi.string(memory, length) end
end
function writers.text(each, name, value, self)
  local width = size_of(self, name)
  ffi.fill(each[name], width)
  if value then ffi.copy(each[name], value, math.min(#value, width)) end
end

function readers.list(each, name, self)
  local _, count = size_of(self, name)
  local memory, list = each[name], {}
  for k = 1, count do
    local value = memory[k - 1]
    if value ~= value then break end
    list[k] = value
  end
  if list[1] then return list end
end
function writers.list(each, name, value, self)
  local _, count = size_of(self, name)
  for k = 1, count do each[name][k - 1] = value and value[k] or 0 / 0 end
end

-- Two ids.
function readers.ids(each, name)
  local ids = each[name]
  if ids[0] < 0 then return {} end
  return { tonumber(ids[0]), tonumber(ids[1]) }
end
function writers.ids(each, name, value)
  each[name][0], each[name][1] = value and value[1] or -1, value and value[2] or -1
end

function readers.measures(each, name, self)
  local values = {}
  for k, measure in ipairs(self.facts.measures) do
    local value = each[name][k - 1]
    if value == value then values[measure] = value end
  end
  if next(values) then return values end
end
function writers.measures(each, name, value, self)
  for k, measure in ipairs(self.facts.measures) do
    each[name][k - 1] = value and value[measure] or 0 / 0
  end
end

-- Which of these a type of records.lua is read by.
local function kind_of(row)
  local kind, list, optional = row[2]:match "^(%w+)(%[?%w*%]?)(%??)$"
  if kind == "S" or kind:match "^S%d" then return "text" end
  if kind == "measures" then return "measures" end
  if kind == "i8" and list ~= "" then return "ids" end
  if kind == "i8" then return optional == "?" and "whole_or_none" or "whole" end
  if kind == "f8" then return list ~= "" and "list" or "number" end
end

local KIND, OF_SCORE = {}, {}
for _, row in ipairs(records.robot) do
  KIND[row[1]] = kind_of(row)
  if row.by == "simulate" or row.by == "score" or row.by == "archive" then
    OF_SCORE[#OF_SCORE + 1] = row[1]
  end
end

-- ---- a body and an outcome as tables ------------------------------------------------------------

-- What is made of several fields when it is read.
local made = {}

function made.body(self, each)
  local shape, counts = each.body, {}
  if shape.status == BODY_UNKNOWN then return nil end
  for m, name in ipairs(self.materials or {}) do counts[name] = shape.counts[m - 1] end
  return { letters = readers.text(each, "letters", self), hash = bit.tohex(shape.hash, 16),
    voxels = shape.voxels, masses = shape.masses, springs = shape.springs,
    size = { shape.size[0], shape.size[1], shape.size[2] }, counts = counts, mass = each.mass }
end

-- A robot that diverged may have passed a moment with numbers that are not finite. No file can hold
-- them: they are left out.
local function finite(read)
  if read.status == "done" then return read end
  for name, value in pairs(read) do
    for _, number in ipairs(type(value) == "table" and value or { value }) do
      if type(number) == "number" and number - number ~= 0 then read[name] = nil end
    end
  end
  return read
end

local function outcome_table(o) return o.status ~= 0 and finite(outcome.table(o)) or nil end

-- The struct of trial k, or of the only simulation.
local function outcome_at(self, each, k)
  return self.facts.trials and each.outcome[(k or 1) - 1] or each.outcome
end

function made.outcome(self, each) return outcome_table(outcome_at(self, each)) end

function made.trials(self, each)
  if not self.facts.trials then return nil end
  local list = {}
  for k = 1, self.facts.trials do list[k] = outcome_table(each.outcome[k - 1]) end
  return list[1] and list or nil
end

-- ---- rows ---------------------------------------------------------------------------------------

function Row:__index(name)
  local own = rawget(self, 1)
  local each = own.data[rawget(self, 2) - 1]
  local kind = KIND[name]
  if kind then
    if not own.layout.places[name] then return nil end
    return readers[kind](each, name, own)
  end
  return made[name] and made[name](own, each)
end

local widen_for

function Row:__newindex(name, value)
  local own = rawget(self, 1)
  if not KIND[name] then
    error(("a robot has no field %s that can be set"):format(tostring(name)), 2)
  end
  if value ~= nil then widen_for(own, name, value) end
  if not own.layout.places[name] then
    if value == nil then return end
    error(("robots of this generation have no field %s"):format(name), 2)
  end
  writers[KIND[name]](own.data[rawget(self, 2) - 1], name, value, own)
  own.stamp = own.stamp + 1
end

-- A row without any value, for each layout.
local blanks = setmetatable({}, { __mode = "k" })

local function blank_of(self)
  local blank = blanks[self.layout]
  if not blank then
    blank = structured.new(self.layout, 1)
    for name in pairs(self.layout.places) do
      local kind = KIND[name]
      if kind then writers[kind](blank.data[0], name, kind == "whole" and 0 or nil, self) end
    end
    blanks[self.layout] = blank
  end
  return blank
end

-- Makes room for robots of these facts, without values.
local function take(self, facts)
  local array = structured.new(structured.layout(record_rules.robot_fields(facts)), self.count)
  self.facts, self.layout, self.data = facts, array.layout, array.data
  for i = 0, self.count - 1 do structured.copy(self, i, blank_of(self), 0, 1) end
  self.stamp = self.stamp + 1
end

--- Makes the robots of a generation, without values.
---@param facts limax.record_rules.facts
---@param count integer
---@return limax.rows
function rows.new(facts, count)
  local self = { count = count, stamp = 0 }
  for i = 1, count do self[i] = setmetatable({ self, i }, Row) end
  take(self, facts)
  return self
end

--- Is this value a row?
function rows.is_row(value) return getmetatable(value) == Row end

local function copy_of(facts)
  local copy = {}
  for name, value in pairs(facts) do copy[name] = value end
  return copy
end

-- Gives the robots other facts, and keeps what they have.
local function change(self, facts)
  local before = { layout = self.layout, data = self.data, count = self.count }
  take(self, facts)
  structured.copy(self, 0, before, 0, self.count)
end

--- Makes room for cases and measures that a fitness returned.
---@param self limax.rows
---@param cases integer how many
---@param measures string[] names
function rows.widen(self, cases, measures)
  local found, list = {}, {}
  for _, each in ipairs { self.facts.measures or {}, measures } do
    for _, name in ipairs(each) do
      if not found[name] then list[#list + 1] = name end
      found[name] = true
    end
  end
  local had = self.facts
  if cases <= (had.cases or 0) and #list == #(had.measures or {}) then return end
  table.sort(list)
  local facts = copy_of(had)
  facts.cases = math.max(cases, had.cases or 0)
  facts.measures = list[1] and list or nil
  change(self, facts)
end

function widen_for(self, name, value)
  if name == "cases" then
    rows.widen(self, #value, {})
  elseif name == "measures" then
    local list = {}
    for measure in pairs(value) do list[#list + 1] = measure end
    rows.widen(self, 0, list)
  end
end

--- Copies robots: robot `sources[k]` of `from` becomes robot `places[k]`.
---@param self limax.rows
---@param places integer[]
---@param from limax.rows
---@param sources integer[]
function rows.copy(self, places, from, sources)
  for k = 1, #places do structured.copy(self, places[k] - 1, from, sources[k] - 1, 1) end
  self.materials = self.materials or from.materials
  self.stamp = self.stamp + 1
end

--- A copy of one robot, which keeps no generation in memory.
---@param row limax.row
---@return limax.row
function rows.single(row)
  local from, i = row[1], row[2]
  local one = rows.new(from.facts, 1)
  rows.copy(one, { 1 }, from, { i })
  return one[1]
end

--- A robot in one of its trials only, without a score.
---@param row limax.row of a robot with trials
---@param k integer
---@return limax.row
function rows.of_trial(row, k)
  local from, i = row[1], row[2]
  local facts = copy_of(from.facts)
  facts.trials, facts.cases, facts.measures = nil, nil, nil
  local one = rows.new(facts, 1)
  rows.copy(one, { 1 }, from, { i })
  rows.forget(one, 1)
  ffi.copy(one.data[0].outcome, outcome_at(from, from.data[i - 1], k), OUTCOME_SIZE)
  rows.set_status(one, 1)
  return one[1]
end

--- Describes the robots whose bodies are unknown.
---@param self limax.rows
---@param population limax.population expressed
---@param materials limax.materials
function rows.describe(self, population, materials)
  local facts = body.facts(materials)
  local texts, size = bodies.texts(population, facts.letters)
  local shapes, length = bodies.shapes(population), size - 2 -- less a line end and a zero byte
  self.materials = facts.names
  for i = 1, self.count do
    local each = self.data[i - 1]
    if each.body.status == BODY_UNKNOWN then
      each.body = shapes[i - 1]
      ffi.copy(each.letters, texts + (i - 1) * size, length)
      each.mass = body.mass(population, i, each.body.masses, facts)
    end
  end
  self.stamp = self.stamp + 1
end

--- The characters of a body's letters in a lattice.
---@param lattice integer[] voxels along x, y, z
---@return integer
function rows.letters(lattice)
  local nx, ny, nz = unpack(lattice)
  return (nx + 1) * ny * nz + nz - 2 -- lines, and lines between layers, without the last line end
end

--- A robot by hand that was simulated.
---@param described { id?: integer, generation?: integer, parents?: integer[] }
---@param population limax.population its body is robot 1
---@param materials limax.materials
---@param simulation limax.simulation
---@return limax.row
function rows.by_hand(described, population, materials, simulation)
  local one = rows.new({ letters = rows.letters(population.lattice) }, 1)
  one[1].id, one[1].generation = described.id or 1, described.generation or 0
  one[1].parents, one[1].origin = described.parents, "hand"
  rows.describe(one, population, materials)
  rows.settle(one, { simulation }, { true })
  return one[1]
end

--- A robot by hand that was simulated in several trials.
---@param list limax.row[] of each trial
---@param population limax.population its body is robot 1
---@param materials limax.materials
---@return limax.row
function rows.joined(list, population, materials)
  local facts = copy_of(list[1][1].facts)
  facts.trials = #list
  local one = rows.new(facts, 1)
  rows.copy(one, { 1 }, list[1][1], { 1 })
  for k, row in ipairs(list) do
    ffi.copy(one.data[0].outcome[k - 1], row[1].data[0].outcome, OUTCOME_SIZE)
  end
  one.data[0].body.status = BODY_UNKNOWN
  rows.describe(one, population, materials)
  rows.set_status(one, 1)
  return one[1]
end

-- ---- what simulations and fitness gave ----------------------------------------------------------

--- Takes from robot i what its simulation and its fitness gave.
---@param self limax.rows
---@param i integer
function rows.forget(self, i)
  local blank = blank_of(self)
  for _, name in ipairs(OF_SCORE) do
    local place = self.layout.places[name]
    if place then
      ffi.copy(ffi.cast("uint8_t *", self.data + (i - 1)) + place.offset,
        ffi.cast("const uint8_t *", blank.data) + place.offset, place.size)
    end
  end
  self.stamp = self.stamp + 1
end

--- Sets status and reason of robot i from its outcomes: it is done if all ended well, else what the
--- first one is that did not.
---@param self limax.rows
---@param i integer
function rows.set_status(self, i)
  local each, trials = self.data[i - 1], self.facts.trials
  local status, reason
  for k = 1, trials or 1 do
    status, reason = outcome.status(outcome_at(self, each, k))
    if status ~= "done" then
      if trials and status == "diverged" then reason = ("trial %d: %s"):format(k, reason) end
      break
    end
  end
  writers.text(each, "status", status, self)
  writers.text(each, "reason", reason, self)
  self.stamp = self.stamp + 1
end

--- Takes the outcomes of some robots from their simulations, one per trial.
---@param self limax.rows
---@param simulations limax.simulation[]
---@param mask boolean[] which ones
function rows.settle(self, simulations, mask)
  for k, simulation in ipairs(simulations) do
    local all = outcome.all(simulation)
    for i = 1, self.count do
      if mask[i] then
        ffi.copy(outcome_at(self, self.data[i - 1], k), all + (i - 1), OUTCOME_SIZE)
      end
    end
  end
  for i = 1, self.count do
    if mask[i] then rows.set_status(self, i) end
  end
end

--- The outcome of a robot that ended well, as the engine has it: of its first trial, where it has
--- some. nil for other robots.
---@param row limax.row
---@return ffi.cdata*|nil limax_outcome
function rows.done(row)
  local o = outcome_at(row[1], row[1].data[row[2] - 1])
  return o.status == DONE and o or nil
end

--- The outcomes of a robot, as the engine has them: one per trial.
---@param row limax.row
---@return ffi.cdata*[] limax_outcome
function rows.outcomes(row)
  local list = {}
  for k = 1, row[1].facts.trials or 1 do list[k] = outcome_at(row[1], row[1].data[row[2] - 1], k) end
  return list
end

--- Is a step of any simulation of a robot coarse?
---@param row limax.row
function rows.is_coarse(row)
  for _, o in ipairs(rows.outcomes(row)) do
    if o.coarse ~= 0 then return true end
  end
  return false
end

-- ---- whole robots -------------------------------------------------------------------------------

local FIELDS = {}
for _, row in ipairs(records.robot) do
  if KIND[row[1]] and row[1] ~= "letters" and row[1] ~= "mass" then FIELDS[#FIELDS + 1] = row[1] end
end
for name in pairs(made) do FIELDS[#FIELDS + 1] = name end

--- A robot as a table of its own.
---@param row limax.row
---@return table
function rows.record(row)
  local record = {}
  for _, name in ipairs(FIELDS) do record[name] = row[name] end
  return record
end

function Row:__pairs() return next, rows.record(self) end

--- The bytes of some robots as a NumPy array, or of all.
---@param self limax.rows
---@param indices integer[]|nil
---@return string
function rows.pack(self, indices)
  local some = self
  if indices then
    some = structured.new(self.layout, #indices)
    for k, i in ipairs(indices) do structured.copy(some, k - 1, self, i - 1, 1) end
  end
  return structured.header(self.layout, some.count)
    .. ffi.string(some.data, some.count * self.layout.size)
end

-- The facts of an array that was read.
local function facts_of(layout)
  local places = layout.places
  local function count(name) return places[name] and places[name].field.count or nil end
  local measures
  for k, field in ipairs(places.measures and places.measures.field.kind or {}) do
    measures = measures or {}
    measures[k] = field.name
  end
  return { letters = places.letters.size, trials = count "outcome",
    descriptors = count "descriptors", objectives = count "objectives",
    islands = places.island ~= nil, ages = places.age ~= nil,
    self_adaptive = places.step_size ~= nil, archive = places.entered ~= nil,
    novelty = places.novelty ~= nil, cases = count "cases", measures = measures }
end

-- What a robot cannot be without.
local NEEDED = { "id", "generation", "parents", "origin", "body", "mass", "letters", "outcome",
  "status", "reason", "fitness" }

-- What is wrong with a field of an array; nil if nothing is.
local function field_problem(place, wanted)
  local kind = place.field.kind
  local same = type(kind) == type(wanted.kind)
    and (type(kind) == "table" or kind == wanted.kind or kind:match "^S" and wanted.kind:match "^S")
  if not same then return "has another type than limax gives it" end
  if wanted.struct then
    if #kind ~= #wanted.kind then return "is not the engine's struct" end
    for k, field in ipairs(wanted.kind) do
      if kind[k].name ~= field.name or kind[k].kind ~= field.kind
        or kind[k].count ~= field.count then
        return "is not the engine's struct"
      end
    end
  elseif type(kind) == "table" then
    for _, field in ipairs(kind) do
      if field.kind ~= "f8" or field.count then return ("%s is no number"):format(field.name) end
    end
  end
end

-- What is wrong with the values of a robot; nil if nothing is.
local function value_problem(each, count)
  local shape = each.body
  if each.id < 1 or each.generation < 0 or each.mass ~= each.mass or each.mass < 0 then
    return "id, generation or mass is out of range"
  elseif shape.voxels < 0 or shape.voxels > count or shape.status < 0 or shape.status > 3 then
    return "its body is out of range"
  end
end

--- Reads robots from the bytes of a NumPy array; `nil, message` where they are not robots.
---@param bytes string
---@param materials string[] their names
---@return limax.rows|nil
---@return string|nil message
function rows.read(bytes, materials)
  local array, message = structured.read(bytes)
  if not array then return nil, message end
  if array.count == 0 then return nil, "has no robots" end
  local places = array.layout.places
  for _, name in ipairs(NEEDED) do
    if not places[name] then return nil, ("has no field %s"):format(name) end
  end
  for _, name in ipairs { "letters", "status", "origin" } do
    if type(places[name].field.kind) ~= "string" then
      return nil, ("the field %s is no text"):format(name)
    end
  end
  local facts = facts_of(array.layout)
  for _, field in ipairs(record_rules.robot_fields(facts)) do
    local problem = places[field.name] and field_problem(places[field.name], field)
    if problem then return nil, ("the field %s %s"):format(field.name, problem) end
  end
  local self = rows.new(facts, array.count)
  structured.copy(self, 0, array, 0, array.count)
  self.materials = materials
  for i = 0, self.count - 1 do
    local problem = value_problem(self.data[i], facts.letters)
    if problem then return nil, ("robot %d: %s"):format(i + 1, problem) end
  end
  return self
end

--- Takes some robots from others, which were made elsewhere, by their fields' names.
---@param self limax.rows
---@param indices integer[] of these robots here
---@param from limax.rows
function rows.take(self, indices, from)
  rows.widen(self, from.facts.cases or 0, from.facts.measures or {})
  for k, i in ipairs(indices) do structured.copy(self, i - 1, from, k - 1, 1) end
  self.stamp = self.stamp + 1
end

return rows
