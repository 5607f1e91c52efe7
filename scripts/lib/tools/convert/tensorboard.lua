--- tensorboard.lua: the metrics of a run as event files of TensorBoard, one for each repetition: a
--- row of records, each with its length and two checksums, that hold protocol buffers (Event, with
--- a Summary of named scalars). Steps are generations.

local bytes = require "limax.tools.convert.bytes"
local choice = require "limax.base.choice"
local metrics = require "limax.tools.convert.metrics"

local tensorboard = {}

-- ---- checksums ----------------------------------------------------------------------------------

-- CRC-32C's polynomial (Castagnoli), bits reversed.
local POLYNOMIAL = 0x82f63b78
-- What is added to a rotated checksum, so that one of data with checksums in them is no weak one.
local MASK = 0xa282ead8

local remainders = {}
for byte = 0, 255 do
  local value = byte
  for _ = 1, 8 do
    local odd = bit.band(value, 1) == 1
    value = bit.rshift(value, 1)
    if odd then value = bit.bxor(value, POLYNOMIAL) end
  end
  remainders[byte] = value
end

--- CRC-32C of some bytes, 0 to 2^32 - 1.
---@param text string
---@return number
function tensorboard.crc(text)
  local value = bit.bnot(0)
  for i = 1, #text do
    local index = bit.band(bit.bxor(value, text:byte(i)), 255)
    value = bit.bxor(bit.rshift(value, 8), remainders[index])
  end
  return bit.bnot(value) % 2 ^ 32
end

local function masked(text)
  local crc = tensorboard.crc(text)
  return bytes.pack("uint32_t", { (bit.ror(crc, 15) % 2 ^ 32 + MASK) % 2 ^ 32 })
end

local function record(data)
  local length = bytes.pack("uint64_t", { #data })
  return length .. masked(length) .. data .. masked(data)
end

-- ---- protocol buffers ---------------------------------------------------------------------------

local function varint(value)
  local parts = {}
  repeat
    local low = value % 128
    value = (value - low) / 128
    parts[#parts + 1] = string.char(value > 0 and low + 128 or low)
  until value == 0
  return table.concat(parts)
end

-- Kinds of a field: a varint, eight bytes, a length and as many bytes, four bytes.
local VARINT, EIGHT, LENGTH, FOUR = 0, 1, 2, 5

local function field(number, kind, data)
  if kind == LENGTH then data = varint(#data) .. data end
  return varint(number * 8 + kind) .. data
end

-- Event: 1 wall_time, 2 step, 3 file_version, 5 summary. Summary: 1 value. Value: 1 tag, 2
-- simple_value.
local function event(time, rest)
  return record(field(1, EIGHT, bytes.pack("double", { time })) .. rest)
end

local function summary(tag, value)
  return field(1, LENGTH, field(1, LENGTH, tag)
    .. field(2, FOUR, bytes.pack("float", { value })))
end

--- The event files of a run.
---@param folder string of the run
---@param to string folder of the event files
---@param notes string[] receives what they cannot carry
---@return { [1]: string, [2]: string }[] path and bytes of each file
function tensorboard.files(folder, to, notes)
  local rows, names = metrics.read(folder)
  local times, parts, repetitions, texts = metrics.times(folder), {}, {}, {}
  for _, row in ipairs(rows) do
    local repetition = row.repetition
    local time = (times[repetition] or {})[row.generation] or 0
    if not parts[repetition] then
      repetitions[#repetitions + 1] = repetition
      parts[repetition] = { event(time, field(3, LENGTH, "brain.Event:2")) }
    end
    local values = {}
    for k = 3, #names do
      local value = row[names[k]]
      if type(value) == "number" then
        values[#values + 1] = summary((names[k]:gsub("%.", "/"):gsub("[^%w_/%-]", "_")), value)
      elseif value ~= nil then
        texts[names[k]] = true
      end
    end
    table.insert(parts[repetition], event(time, field(2, VARINT, varint(row.generation))
      .. field(5, LENGTH, table.concat(values))))
  end
  notes[#notes + 1] = "digits beyond those of 32 bits: a scalar is a float"
  for _, name in ipairs(choice.sorted_keys(texts)) do notes[#notes + 1] = name .. ": no number" end
  local files = {}
  for i, repetition in ipairs(repetitions) do
    files[i] = { ("%s/r%02d/events.out.tfevents.0000000000.limax"):format(to, repetition),
      table.concat(parts[repetition]) }
  end
  return files
end

return tensorboard
