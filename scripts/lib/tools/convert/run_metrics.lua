--- run_metrics.lua: the metrics of a run as CSV, and as event files of TensorBoard: a sequence of
--- records, each with its length and two checksums, that hold protocol buffers: an Event with a
--- Summary of named scalars.

local bytes = require "limax.base.bytes"
local choice = require "limax.base.choice"
local csv = require "limax.base.csv"
local failure = require "limax.base.failure"
local flat = require "limax.base.flat"
local host = require "limax.host"
local runs = require "limax.tools.report.runs"
local timestamp = require "limax.base.timestamp"

local run_metrics = {}

local function plain(value)
  if type(value) ~= "table" and value ~= host.json.null then return value end
end

-- The rows of a run by repetition and generation: `quantiles.q10` is the field q10 of the object
-- quantiles. Then the columns: repetition and generation, and the others sorted. Then when each
-- generation ended, seconds since 1970, 0 if unknown.
local function read(folder)
  local rows, seen, times = {}, {}, {}
  for _, run in ipairs(runs.read(folder).runs) do
    for k, line in ipairs(run.lines) do
      rows[#rows + 1] = flat.add(line, "", {}, plain)
      rows[#rows].schema = nil
      for name in pairs(rows[#rows]) do seen[name] = true end
      times[#rows] = timestamp.seconds((run.timing[k] or {}).ended) or 0
    end
  end
  if #rows == 0 then failure.raise(2, folder .. ": no generation has been scored yet") end
  seen.repetition, seen.generation = nil, nil
  return rows, { "repetition", "generation", unpack(choice.sorted_keys(seen)) }, times
end

--- The metrics of a run as CSV (RFC 4180). Missing values are empty.
function run_metrics.csv(folder)
  local rows, names = read(folder)
  return csv.encode(names, rows)
end

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

-- The CRC-32C of a text as TensorBoard stores it: rotated, plus a constant.
local function masked_crc(text)
  local value = bit.bnot(0)
  for i = 1, #text do
    value = bit.bxor(bit.rshift(value, 8), remainders[bit.band(bit.bxor(value, text:byte(i)), 255)])
  end
  local rotated = bit.ror(bit.bnot(value), 15) % 2 ^ 32
  return bytes.pack("uint32_t", { (rotated + 0xa282ead8) % 2 ^ 32 })
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

-- A record of an Event: 1 wall_time, 2 step, 3 file_version, 5 summary.
local function event(time, fields)
  local data = field(1, EIGHT_BYTES, bytes.pack("double", { time })) .. fields
  local length = bytes.pack("uint64_t", { #data })
  return length .. masked_crc(length) .. data .. masked_crc(data)
end

-- Summary: 1 value. Value: 1 tag, 2 simple_value.
local function scalar(tag, value)
  return field(1, LENGTH, field(1, LENGTH, tag)
    .. field(2, FOUR_BYTES, bytes.pack("float", { value })))
end

--- The event files of a run, one for each repetition. Steps are generations.
---@param to string folder of the event files
---@return { [1]: string, [2]: string }[] path and bytes of each file
function run_metrics.tensorboard(folder, to, notes)
  local rows, names, times = read(folder)
  local events, files, skipped = {}, {}, {}
  for i, row in ipairs(rows) do
    local repetition, time, scalars = row.repetition, times[i], {}
    if not events[repetition] then
      events[repetition] = { event(time, field(3, LENGTH, "brain.Event:2")) }
      files[#files + 1] = { ("%s/r%02d/events.out.tfevents.0000000000.limax"):format(to,
        repetition), events[repetition] }
    end
    for k = 3, #names do
      local name, value = names[k], row[names[k]]
      if type(value) == "number" then
        scalars[#scalars + 1] = scalar((name:gsub("%.", "/"):gsub("[^%w_/%-]", "_")), value)
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

return run_metrics
