--- tensorboard.lua: the metrics of a run as event files of TensorBoard, one for each repetition. A
--- file is a sequence of records, each with its length and two checksums, that hold protocol
--- buffers: an Event with a Summary of named scalars. Steps are generations.

local bytes = require "limax.base.bytes"
local choice = require "limax.base.choice"
local metrics = require "limax.tools.convert.metrics"

local tensorboard = {}

-- ---- records ------------------------------------------------------------------------------------

-- The table of CRC-32C (Castagnoli's polynomial, bits reversed).
local POLYNOMIAL = 0x82f63b78
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

--- CRC-32C of a text, 0 to 2^32 - 1.
function tensorboard.crc(text)
  local value = bit.bnot(0)
  for i = 1, #text do
    local index = bit.band(bit.bxor(value, text:byte(i)), 255)
    value = bit.bxor(bit.rshift(value, 8), remainders[index])
  end
  return bit.bnot(value) % 2 ^ 32
end

-- The checksum as TensorBoard stores it: rotated, plus a constant.
local function masked_crc(text)
  local rotated = bit.ror(tensorboard.crc(text), 15) % 2 ^ 32
  return bytes.pack("uint32_t", { (rotated + 0xa282ead8) % 2 ^ 32 })
end

local function record(data)
  local length = bytes.pack("uint64_t", { #data })
  return length .. masked_crc(length) .. data .. masked_crc(data)
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

-- Wire types of a field.
local VARINT, EIGHT_BYTES, LENGTH, FOUR_BYTES = 0, 1, 2, 5

local function field(number, wire_type, data)
  if wire_type == LENGTH then data = varint(#data) .. data end
  return varint(number * 8 + wire_type) .. data
end

-- Event: 1 wall_time, 2 step, 3 file_version, 5 summary.
local function event(time, fields)
  return record(field(1, EIGHT_BYTES, bytes.pack("double", { time })) .. fields)
end

-- Summary: 1 value. Value: 1 tag, 2 simple_value.
local function scalar(tag, value)
  return field(1, LENGTH, field(1, LENGTH, tag)
    .. field(2, FOUR_BYTES, bytes.pack("float", { value })))
end

--- The event files of a run.
---@param folder string of the run
---@param to string folder of the event files
---@param notes string[] receives what they cannot carry
---@return { [1]: string, [2]: string }[] path and bytes of each file
function tensorboard.files(folder, to, notes)
  local rows, names, times = metrics.read(folder)
  local events, files, skipped = {}, {}, {}
  for i, row in ipairs(rows) do
    local repetition, time = row.repetition, times[i]
    if not events[repetition] then
      events[repetition] = { event(time, field(3, LENGTH, "brain.Event:2")) }
      files[#files + 1] = { ("%s/r%02d/events.out.tfevents.0000000000.limax"):format(to,
        repetition), events[repetition] }
    end
    local scalars = {}
    for k = 3, #names do
      local name, value = names[k], row[names[k]]
      if type(value) == "number" then
        local tag = name:gsub("%.", "/"):gsub("[^%w_/%-]", "_")
        scalars[#scalars + 1] = scalar(tag, value)
      elseif value ~= nil then
        skipped[name] = true
      end
    end
    table.insert(events[repetition], event(time, field(2, VARINT, varint(row.generation))
      .. field(5, LENGTH, table.concat(scalars))))
  end
  for _, file in ipairs(files) do file[2] = table.concat(file[2]) end
  notes[#notes + 1] = "digits beyond single precision"
  for _, name in ipairs(choice.sorted_keys(skipped)) do
    notes[#notes + 1] = name .. ": not a number"
  end
  return files
end

return tensorboard
