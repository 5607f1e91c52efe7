--- columns.lua: the robots of one generation as columns, one list per field, with their outcomes in
--- memory as the engine has them. A row is a robot's record: it reads and writes the columns, and
--- is the robot's line in the population file.

local ffi = require "ffi"
local new_table = require "table.new"

local body_columns = require "limax.robot.body_columns"
local choice = require "limax.base.choice"
local host = require "limax.host"
local names = require "limax.engine.names"
local npy_records = require "limax.base.npy_records"
local outcome = require "limax.engine.outcome"
local robot_trials = require "limax.robot.robot_trials"

---@class limax.columns
---@field count integer robots
---@field rows limax.row[]
---@field lists any[][] of the fields, in the order of their names here
---@field bodies limax.body_columns
---@field parents ffi.cdata* int64_t[count][2] ids, -1 for none
---@field outcomes ffi.cdata*[] limax_outcome[count] of each trial, or of the only simulation
---@field has_trials boolean do the records hold the outcomes of trials?
local Columns = {}
Columns.__index = Columns

local columns = {}

-- What a simulation and a fitness give, and the rest.
local OF_SCORE = { "fitness", "cases", "measures", "descriptors", "objectives", "novelty",
  "status", "reason" }
local OTHERS = { "id", "generation", "origin", "island", "age", "step_size" }
local SIZE = ffi.sizeof "limax_outcome"
local DONE = names.robot_status.value.done
local SCHEMA_TEXT = "limax.population/1"
local SCHEMA = ffi.new("char[?]", #SCHEMA_TEXT, SCHEMA_TEXT)
local LISTS, NAMES = {}, {}
for _, list in ipairs { OF_SCORE, OTHERS } do
  for _, name in ipairs(list) do
    LISTS[name], NAMES[#NAMES + 1] = true, name
  end
end

-- ---- rows ---------------------------------------------------------------------------------------

---@class limax.row a robot's record: { columns, index }
local Row = {}

-- What is made of the columns when it is read.
local made, MADE = {}, { "parents", "body", "outcome", "trials" }

function made.parents(all, i)
  local list, ids = host.json.array {}, all.parents
  for k = 1, 2 do
    local id = tonumber(ids[2 * i - 3 + k])
    if id >= 0 then list[k] = id end
  end
  return list
end

function made.body(all, i) return all.bodies:table(i) end

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

local function outcome_of(all, i, k)
  local o = all.outcomes[k] and all.outcomes[k][i - 1]
  return o and o.status ~= 0 and finite(outcome.table(o)) or nil
end

function made.outcome(all, i) return outcome_of(all, i, 1) end

function made.trials(all, i)
  local list = {}
  for k = 1, all.has_trials and #all.outcomes or 0 do list[k] = outcome_of(all, i, k) end
  return list[1] and list or nil
end

function Row:__index(name)
  local all, i = self[1], self[2]
  if LISTS[name] then return all[name][i] end
  if not made[name] then return nil end
  local value = made[name](all, i)
  rawset(self, name, value)
  return value
end

function Row:__newindex(name, value)
  if not LISTS[name] then error(("a robot's record has no field %s"):format(tostring(name)), 2) end
  self[1][name][self[2]] = value
end

-- The fields of a row as a table of its own.
local function plain(row)
  local copy = { schema = SCHEMA_TEXT }
  for _, name in ipairs(NAMES) do copy[name] = row[name] end
  for _, name in ipairs(MADE) do copy[name] = row[name] end
  return copy
end

function Row:__pairs() return next, plain(self) end

-- Forgets what was made of a row's columns.
local function changed(row)
  for _, name in ipairs(MADE) do rawset(row, name, nil) end
end

--- A robot's record as a table of its own, which keeps no generation in memory.
---@param record table a row or such a table
---@return table
function columns.plain(record)
  local copy = {}
  for name, value in pairs(record) do copy[name] = value end
  return copy
end

-- ---- columns ------------------------------------------------------------------------------------

--- Makes the columns of a generation.
---@param count integer robots
---@return limax.columns
function columns.new(count)
  local lists = {}
  local self = { count = count, rows = {}, lists = lists, outcomes = {}, has_trials = false,
    bodies = body_columns.new(count), parents = ffi.new("int64_t[?]", 2 * count) }
  ffi.fill(self.parents, ffi.sizeof(self.parents), 0xff) -- none: -1
  for k, name in ipairs(NAMES) do
    lists[k] = new_table(count, 0)
    self[name] = lists[k]
  end
  for i = 1, count do self.rows[i] = setmetatable({ self, i }, Row) end
  return setmetatable(self, Columns)
end

--- The columns of a row; nil for a plain record.
---@return limax.columns|nil
function columns.of(record) return getmetatable(record) == Row and record[1] or nil end

-- Structs of the outcomes of plain records.
local structs = setmetatable({}, { __mode = "k" })

--- The outcome of a robot that ended well, as the engine has it: of its first trial, where it has
--- some. nil for other robots.
---@param record table a row or a plain record
---@return ffi.cdata*|nil limax_outcome
function columns.done(record)
  if getmetatable(record) == Row then
    local all = record[1].outcomes[1]
    local o = all and all[record[2] - 1]
    return o and o.status == DONE and o or nil
  end
  local read = record.outcome
  if not read or read.status ~= "done" then return nil end
  if not structs[read] then
    structs[read] = ffi.new "limax_outcome"
    outcome.write(structs[read], read)
  end
  return structs[read]
end

--- Is a step of any simulation of robot i coarse?
function Columns:is_coarse(i)
  for _, all in ipairs(self.outcomes) do
    if all[i - 1].coarse ~= 0 then return true end
  end
  return false
end

--- Sets the parents of robot i; none if left out.
---@param first? integer id
---@param second? integer id
function Columns:set_parents(i, first, second)
  self.parents[2 * i - 2], self.parents[2 * i - 1] = first or -1, second or -1
  rawset(self.rows[i], "parents", nil)
end

--- Makes room for the outcomes of so many simulations of each robot.
---@param simulations integer
---@param are_trials boolean
function Columns:expect(simulations, are_trials)
  self.has_trials = are_trials
  for k = #self.outcomes + 1, simulations do
    self.outcomes[k] = ffi.new("limax_outcome[?]", self.count)
  end
end

--- Copies robots of another generation: robot `sources[k]` of `from` becomes robot `places[k]`.
---@param from limax.columns
---@param places integer[]
---@param sources integer[]
function Columns:copy(from, places, sources)
  local count, parents, of = #places, self.parents, from.parents
  for n, list in ipairs(self.lists) do
    local other = from.lists[n]
    for k = 1, count do list[places[k]] = other[sources[k]] end
  end
  for k = 1, count do
    local i, j = 2 * places[k] - 2, 2 * sources[k] - 2
    parents[i], parents[i + 1] = of[j], of[j + 1]
    changed(self.rows[places[k]])
  end
  self:expect(#from.outcomes, from.has_trials)
  for trial, all in ipairs(from.outcomes) do
    local into = self.outcomes[trial]
    for k = 1, count do ffi.copy(into + places[k] - 1, all + sources[k] - 1, SIZE) end
  end
  self.bodies:copy(from.bodies, places, sources)
end

-- Writes a plain record into row i.
local function write(self, i, record)
  for _, name in ipairs(NAMES) do self[name][i] = record[name] end
  self:set_parents(i, record.parents[1], record.parents[2])
  if record.body then self.bodies:write(i, record.body) end
  local trials = record.trials or { record.outcome }
  self:expect(#trials, record.trials ~= nil)
  for k, each in ipairs(trials) do outcome.write(self.outcomes[k][i - 1], each) end
end

--- Makes columns of plain records.
---@param records table[]
---@return limax.columns
function columns.from(records)
  local self = columns.new(#records)
  for i, record in ipairs(records) do write(self, i, record) end
  return self
end

--- Takes from robot i what its simulation and its fitness gave.
function Columns:forget_score(i)
  for _, name in ipairs(OF_SCORE) do self[name][i] = nil end
  for _, all in ipairs(self.outcomes) do ffi.fill(all + i - 1, SIZE) end
  changed(self.rows[i])
end

--- What simulations and fitness gave some robots, as plain data.
---@param indices integer[]
---@return table
function Columns:scores(indices)
  local scores = { outcomes = {} }
  for _, name in ipairs(OF_SCORE) do
    local from, list = self[name], {}
    for k, i in ipairs(indices) do list[k] = from[i] end
    scores[name] = list
  end
  for trial, all in ipairs(self.outcomes) do
    local memory = ffi.new("limax_outcome[?]", #indices)
    for k, i in ipairs(indices) do ffi.copy(memory + k - 1, all + i - 1, SIZE) end
    scores.outcomes[trial] = ffi.string(memory, #indices * SIZE)
  end
  return scores
end

--- Takes these from the columns of another process.
---@param indices integer[]
---@param scores table as from `scores`
function Columns:set_scores(indices, scores)
  for _, name in ipairs(OF_SCORE) do
    for k, i in ipairs(indices) do self[name][i] = scores[name][k] end
  end
  for trial, text in ipairs(scores.outcomes) do
    local memory = ffi.cast("const char *", text)
    for k, i in ipairs(indices) do
      ffi.copy(self.outcomes[trial] + i - 1, memory + (k - 1) * SIZE, SIZE)
    end
  end
  for _, i in ipairs(indices) do changed(self.rows[i]) end
end

--- Sets status and reason of robot i from its outcomes.
function Columns:set_status(i)
  local list = {}
  for k, all in ipairs(self.outcomes) do
    local status, reason = outcome.status(all[i - 1])
    if status ~= "done" then
      self.status[i], self.reason[i] = robot_trials.status_of(status, reason,
        self.has_trials and k or nil)
      return
    end
    list[k] = status
  end
  self.status[i], self.reason[i] = list[1], nil
end

--- Takes the outcomes of some robots from their simulations, one per trial.
---@param simulations limax.simulation[]
---@param mask boolean[] which ones
---@param are_trials boolean
function Columns:settle(simulations, mask, are_trials)
  self:expect(#simulations, are_trials)
  -- parents may have been in more trials
  for k = #self.outcomes, #simulations + 1, -1 do self.outcomes[k] = nil end
  for k, simulation in ipairs(simulations) do outcome.copy(simulation, self.outcomes[k], mask) end
  for i = 1, self.count do
    if mask[i] then
      changed(self.rows[i])
      self:set_status(i)
    end
  end
end

-- ---- the population file ------------------------------------------------------------------------

-- A part of a field's name as host.rows reads it.
local function escaped(name)
  return (name:gsub("[%%%.%['\\%c\128-\255]", function(letter)
    return ("%%%02X"):format(letter:byte())
  end))
end

-- The fields of the outcomes of simulation k.
local function outcome_fields(self, k, prefix)
  local states, reasons, all = {}, {}, self.outcomes[k]
  for i = 1, self.count do states[i], reasons[i] = outcome.status(all[i - 1]) end
  local list = outcome.fields(all, prefix)
  list[#list + 1] = npy_records.texts(prefix .. "status", states, self.count)
  list[#list + 1] = npy_records.texts(prefix .. "reason", reasons, self.count)
  table.sort(list, function(a, b) return a.name < b.name end)
  return list
end

local function measure_fields(self)
  local found, list = {}, {}
  for i = 1, self.count do
    for name in pairs(self.measures[i] or {}) do found[name] = true end
  end
  for k, name in ipairs(choice.sorted_keys(found)) do
    local values = {}
    for i = 1, self.count do values[i] = (self.measures[i] or {})[name] end
    list[k] = npy_records.numbers("measures." .. name, "<f8", values, self.count)
  end
  return list
end

--- The population file as a NumPy array of records, of which `host.rows.lines` makes the lines.
---@return string bytes of a .npy file
function Columns:pack()
  local fields, count = {}, self.count
  local function add(list)
    for _, each in ipairs(list) do fields[#fields + 1] = each end
  end
  local function texts(name) add { npy_records.texts(name, self[name], count) } end
  local function lists(name) add { npy_records.lists(name, self[name], count) } end
  local function numbers(name, kind)
    if next(self[name]) then add { npy_records.numbers(name, kind, self[name], count) } end
  end
  -- sorted by name
  numbers("age", "<i8")
  add(self.bodies:fields(escaped))
  lists "cases"
  lists "descriptors"
  numbers("fitness", "<f8")
  numbers("generation", "<i8")
  numbers("id", "<i8")
  numbers("island", "<i8")
  add(measure_fields(self))
  numbers("novelty", "<f8")
  lists "objectives"
  texts "origin"
  add(outcome_fields(self, 1, "outcome."))
  add { { name = "parents", kind = "<i8", memory = self.parents, count = 2 } }
  texts "reason"
  add { { name = "schema", kind = "|S", memory = SCHEMA, stride = 0, width = #SCHEMA_TEXT } }
  texts "status"
  numbers("step_size", "<f8")
  for k = 1, self.has_trials and #self.outcomes or 0 do
    add(outcome_fields(self, k, ("trials[%d]."):format(k)))
  end
  return npy_records.pack(count, fields)
end

return columns
