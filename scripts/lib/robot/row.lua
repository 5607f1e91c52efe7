--- row.lua: one robot of an array (rows.lua), whose fields are read and written by name as Lua's
--- values; a field without a value is nil.

local bit = require "bit"
local ffi = require "ffi"

local names = require "limax.engine.names"
local outcome = require "limax.engine.outcome"
local records = require "limax.settings.records"

--- A robot of an array.
---@class limax.row
---@field [1] limax.rows
---@field [2] integer
---@fields robot
local Row = {}

local row = {}

local BODY_UNKNOWN = names.body_status.value.unknown

-- Each reads or writes the field `name` of the struct `each`, which belongs to the array `all`.
local readers, writers = {}, {}

function readers.whole(each, name) return tonumber(each[name]) end
function writers.whole(each, name, value) each[name] = value or 0 end

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

function readers.text(each, name, all)
  local memory, length, width = each[name], 0, all.layout.places[name].size
  while length < width and memory[length] ~= 0 do length = length + 1 end
  if length > 0 then return ffi.string(memory, length) end
end
function writers.text(each, name, value, all)
  local width = all.layout.places[name].size
  ffi.fill(each[name], width)
  if value then ffi.copy(each[name], value, math.min(#value, width)) end
end

-- A text of at most 8 bytes. Most robots have the same one: it is made once in a row.
local last_bits, last_word = ffi.new "uint64_t", nil
function readers.word(each, name, all)
  local bits = ffi.cast("const uint64_t *", each[name])[0]
  if bits ~= last_bits then last_bits, last_word = bits, readers.text(each, name, all) end
  return last_word
end
writers.word = writers.text

function readers.list(each, name, all)
  local memory, list = each[name], {}
  for k = 1, all.layout.places[name].field.count do
    local value = memory[k - 1]
    if value ~= value then break end
    list[k] = value
  end
  if list[1] then return list end
end
function writers.list(each, name, value, all)
  for k = 1, all.layout.places[name].field.count do
    each[name][k - 1] = value and value[k] or 0 / 0
  end
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

-- A number for each name.
function readers.measures(each, name, all)
  local values = {}
  for k, measure in ipairs(all.facts.measures) do
    local value = each[name][k - 1]
    if value == value then values[measure] = value end
  end
  if next(values) then return values end
end
function writers.measures(each, name, value, all)
  for k, measure in ipairs(all.facts.measures) do
    each[name][k - 1] = value and value[measure] or 0 / 0
  end
end

-- The accessors of a type of records.lua; nil for the engine's structs.
local function kind_of(field)
  local kind, list, optional = field[2]:match "^(%w+)(%[?%w*%]?)(%??)$"
  if kind:match "^S" then return kind == "S8" and "word" or "text" end
  if kind == "measures" then return kind end
  if kind == "i8" then
    return list ~= "" and "ids" or optional == "?" and "whole_or_none" or "whole"
  end
  return kind == "f8" and (list ~= "" and "list" or "number") or nil
end

local KIND = {}
for _, field in ipairs(records.robot) do KIND[field[1]] = kind_of(field) end

--- Marks all fields of a struct as absent.
function row.clear(each, all)
  for name in pairs(all.layout.places) do
    if KIND[name] then writers[KIND[name]](each, name, nil, all) end
  end
end

local made = {}

function made.body(all, each)
  local shape, counts = each.body, {}
  if shape.status == BODY_UNKNOWN then return nil end
  for m, name in ipairs(all.materials or {}) do counts[name] = shape.counts[m - 1] end
  return { letters = readers.text(each, "letters", all), hash = bit.tohex(shape.hash, 16),
    voxels = shape.voxels, masses = shape.masses, springs = shape.springs,
    size = { shape.size[0], shape.size[1], shape.size[2] }, counts = counts, mass = each.mass }
end

-- A robot that diverged may have numbers that are not finite. No file can hold them: they are left
-- out.
local function outcome_table(o)
  if o.status == 0 then return nil end
  local read = outcome.table(o)
  for name, value in pairs(read.status == "done" and {} or read) do
    for _, number in ipairs(type(value) == "table" and value or { value }) do
      if type(number) == "number" and number - number ~= 0 then read[name] = nil end
    end
  end
  return read
end

--- The outcome of trial k, or of the only simulation, as the engine has it.
---@return ffi.cdata* limax_outcome
function row.outcome_at(all, each, k)
  return all.facts.trials and each.outcome[(k or 1) - 1] or each.outcome
end

function made.outcome(all, each) return outcome_table(row.outcome_at(all, each)) end

function made.trials(all, each)
  if not all.facts.trials then return nil end
  local list = {}
  for k = 1, all.facts.trials do list[k] = outcome_table(each.outcome[k - 1]) end
  return list[1] and list or nil
end

--- What is here of robot i of an array, which may be of a share (rows.lua).
---@return limax.structured.array of whole rows, or the brief one
---@return integer its place there, from 0
function row.held(all, i)
  if not all.share then return all, i - 1 end
  local k = all.share:at(i)
  if k then return all, k - 1 end
  return all.brief, i - 1
end

--- The same of all its fields. Raises for a robot of another rank that is not here.
function row.whole(all, i)
  local array, at = row.held(all, i)
  if array ~= all.brief then return array, at end
  if all.lent[i] then return all.lent[i], all.lent_at[i] end
  return all:ask(i)
end

--- The struct that has a field of robot i.
---@param name string of the field
function row.struct(all, i, name)
  local array, at = row.held(all, i)
  if not (array and array.layout.places[name]) then array, at = row.whole(all, i) end
  return array.data[at]
end

-- The field that has what is made of it.
local OF = { body = "body", outcome = "outcome", trials = "outcome" }

--- A field of the struct of a robot.
function row.read(each, name, all) return readers[KIND[name]](each, name, all) end

function Row:__index(name)
  local all, i, kind = rawget(self, 1), rawget(self, 2), KIND[name]
  if not kind then
    return made[name] and made[name](all, row.struct(all, i, OF[name]))
  end
  if all.layout.places[name] then return readers[kind](row.struct(all, i, name), name, all) end
end

function Row:__newindex(name, value)
  local all, kind = rawget(self, 1), KIND[name]
  if value ~= nil and (kind == "measures" or name == "cases") then all:expect(name, value) end
  if kind and all.layout.places[name] then
    local array, at = row.held(all, rawget(self, 2))
    -- a field that only another rank has is written there
    if array.layout.places[name] then writers[kind](array.data[at], name, value, all) end
    all.stamp = all.stamp + 1
  elseif value ~= nil then
    error(("robots of this generation have no field %s that can be set"):format(tostring(name)), 2)
  end
end

local FIELDS = {}
for name in pairs(made) do FIELDS[#FIELDS + 1] = name end
for _, field in ipairs(records.robot) do
  local name = field[1]
  -- these are fields of its body
  if KIND[name] and name ~= "letters" and name ~= "mass" then FIELDS[#FIELDS + 1] = name end
end

--- A robot as a table of its own.
function row.record(robot)
  local record = {}
  for _, name in ipairs(FIELDS) do record[name] = robot[name] end
  return record
end

function Row:__pairs() return next, row.record(self) end

--- Robot i of an array.
function row.of(all, i) return setmetatable({ all, i }, Row) end

return row
