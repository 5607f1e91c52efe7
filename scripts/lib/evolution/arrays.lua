--- arrays.lua: writes the robots and the genomes of a generation. Rank 0 begins a file for each and
--- gives it its name at the end (run/folder.lua); in between each rank writes the rows of its own
--- robots. Where a rank cannot write there, on a host with another file system, rank 0 collects all
--- genomes and writes alone.

local ffi = require "ffi"

local division = require "limax.evolution.division"
local engine_population = require "limax.engine.population"
local exchange = require "limax.base.exchange"
local host = require "limax.host"
local source = require "limax.base.source"

local arrays = {}

-- Of the running kernel: processes that share it share the parts of files that are not on disk.
local BOOT = "/proc/sys/kernel/random/boot_id"

-- Bytes that a rank writes at a time, of several.
local CHUNK = 2 ^ 24

-- Can every rank write into the file that rank 0 began?
local function is_shared(path)
  if exchange.count == 1 then return true end
  local file = io.open(path, "r+b")
  if file then file:close() end
  for _, writes in ipairs(exchange.all(file ~= nil)) do
    if not writes then return false end
  end
  return true
end

-- Adds what all ranks wrote to the files of rank 0; returns what failed.
local function report(files, writer)
  local _, problem = writer:wait()
  local sums = {}
  for kind, file in pairs(files) do
    sums[kind] = not exchange.is_first and writer:sum(file.path) or nil
  end
  local all = exchange.all { problem = problem, sums = sums }
  for r = 2, #all do
    problem = problem or all[r].problem and ("rank %d: %s"):format(r - 1, all[r].problem)
    for kind, sum in pairs(all[r].sums) do
      files[kind].others = (files[kind].others or "") .. sum
    end
  end
  return problem
end

--- Writes robots and genomes into the folder of a run, asynchronously where there is one rank only.
--- Collective.
---@return table|nil files of `begin_arrays`, on rank 0 with the sums of the hashes of other ranks
---@return string|nil problem of any rank
function arrays.write(run, robots)
  local boot = source.read(BOOT)
  local files, began = unpack(exchange.first(function()
    return { run.folder:begin_arrays(robots), boot }
  end))
  run.writer = run.folder and run.folder.writer or run.writer or assert(host.file.writer())
  local writer, syncs = run.writer, not boot or boot ~= began
  local share, all = robots.share, robots.rows
  local segments, collects = share:segments(), not is_shared(files.genomes.path)
  if collects then
    division.complete(robots)
    segments = exchange.is_first and { { first = 0, count = share.total, place = 0 } } or {}
    if not exchange.is_first then division.collect_genomes(robots) end
  end
  -- several ranks wait anyway, and need no memory for all rows at once
  local pauses, before, last = exchange.count > 1 and not collects, nil, nil
  local function put_rows(file, first, count, place, fill)
    if pauses and before then writer:wait(before) end
    fill(ffi.cast("char *", writer:array(count * file.row)), first, count, place)
    before, last = last, writer:write_rows(file.path, file.header + first * file.row, file.row,
      share.total - first - count, syncs)
  end
  local function put(file, fill)
    for _, segment in ipairs(segments) do
      local step = pauses and math.ceil(CHUNK / file.row) or segment.count
      for k = 0, segment.count - 1, step do
        put_rows(file, segment.first + k, math.min(step, segment.count - k), segment.place + k,
          fill)
      end
    end
  end
  -- the longer array first: it takes the memory of the one before
  put(files.genomes, function(memory, _, count, place)
    memory = ffi.cast("float *", memory)
    if collects then return division.collect_genomes(robots, memory) end
    engine_population.copy_genomes(robots.own, memory, place, count)
  end)
  put(files.robots, function(memory, first, count, place)
    ffi.copy(memory, all.data + (all.share and place or first), count * files.robots.row)
  end)
  return files, exchange.count > 1 and report(files, writer) or nil
end

return arrays
