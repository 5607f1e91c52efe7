--- ranks.lua: the processes of a run that mpirun or srun started together, over MPI
--- (bindings/mpi/ranks.cpp). In any other process there is one rank, and nothing is loaded.

local ffi = require "ffi"
local failure = require "limax.base.failure"
local host = require "limax.host"

---@class limax.ranks
---@field index integer of this process, from 0
---@field count integer processes
local ranks = { index = 0, count = 1 }

local LIBRARY = "liblimax_mpi.so"
-- s between polls for ranks that still work: short at first, then so long that others get the core
local SHORTEST_WAIT, LONGEST_WAIT = 1e-5, 1e-3
-- s of polling at a time where all ranks transfer more bytes than this. Otherwise pauses are
-- better: the core may be needed by the rank that is waited for.
local POLLING, LARGE = 1e-3, 2 ^ 20

-- Processes that the launcher started.
local function started()
  local slurm = os.getenv "PMIX_RANK" or os.getenv "PMI_RANK"
  return tonumber(os.getenv "OMPI_COMM_WORLD_SIZE" or os.getenv "PMI_SIZE"
    or slurm and os.getenv "SLURM_STEP_NUM_TASKS") or 1
end

-- Memory that MPI reads and writes until a gather is complete, also where an interrupt ends it.
local in_flight -- luacheck: ignore

-- Waits for other ranks.
local function wait()
  local pause = SHORTEST_WAIT
  while ffi.C.limax_ranks_done(0) == 0 do
    host.wait(pause)
    pause = math.min(2 * pause, LONGEST_WAIT)
  end
end

-- Waits for a transfer in which all ranks take part: MPI moves data only while it is polled.
local function transfer(bytes)
  local polling = bytes > LARGE and POLLING or 0
  while ffi.C.limax_ranks_done(polling) == 0 do host.wait(SHORTEST_WAIT) end
end

--- Exchanges texts: every rank calls it with its own, and gets those of all. A rank that is lost
--- ends the others as Ctrl-C does.
---@return string[] by rank; the first one is rank 0's
function ranks.gather(text)
  if ranks.count == 1 then return { text } end
  local own, sizes = ffi.new("int64_t[1]", #text), ffi.new("int64_t[?]", ranks.count)
  in_flight = { text, own, sizes }
  ffi.C.limax_ranks_gather_sizes(own, sizes)
  wait()
  local total, list = 0, {}
  for r = 0, ranks.count - 1 do total = total + tonumber(sizes[r]) end
  if total >= 2 ^ 31 then
    failure.raise(1, ("the ranks cannot exchange %d bytes at once, only less than 2^31: a smaller "
      .. "population is needed"):format(total))
  end
  local all = ffi.new("char[?]", math.max(total, 1))
  in_flight[4] = all
  ffi.C.limax_ranks_gather(text, sizes, all)
  transfer(total)
  local place = 0
  for r = 0, ranks.count - 1 do
    list[r + 1] = r == ranks.index and text or ffi.string(all + place, tonumber(sizes[r]))
    place = place + tonumber(sizes[r])
  end
  in_flight = nil
  return list
end

-- Waits for what was begun with this memory, in which all ranks take part at the same time.
local function complete(bytes, ...)
  in_flight = { ... }
  transfer(bytes)
  in_flight = nil
end

local function sum_of(numbers)
  local sum = 0
  for _, number in ipairs(numbers) do sum = sum + number end
  return sum
end

--- Adds up the values of all ranks in place: int64_t[count].
function ranks.sum(values, count)
  if ranks.count == 1 then return end
  ffi.C.limax_ranks_sum(values, count)
  complete(8 * count, values)
end

--- Completes items in place, of which each rank has a part, in the order of the ranks.
---@param numbers integer[] of each rank, from 1
---@param bytes integer of an item
---@param owner? any keeps the memory
function ranks.share(items, numbers, bytes, owner)
  local list = ffi.new("int[?]", ranks.count, numbers)
  ffi.C.limax_ranks_share(items, list, bytes)
  complete(sum_of(numbers) * bytes, items, list, owner)
end

--- Sends items to each rank and receives some from each. Both lists of counts are by rank, from 1,
--- and agree between ranks; both memories hold the items in the order of the ranks.
---@param bytes integer of an item
---@param owner? any keeps the memory
function ranks.trade(out, sent, into, received, bytes, owner)
  local function counts(list) return ffi.new("int[?]", ranks.count, list) end
  local a, b = counts(sent), counts(received)
  ffi.C.limax_ranks_trade(out, a, into, b, bytes)
  complete((sum_of(sent) + sum_of(received)) * bytes, out, a, into, b, owner)
end

--- Does this rank report that the run ended early? Rank 0 does, or rank 1 where rank 0 is lost.
function ranks.reports()
  return ranks.count == 1 or ffi.C.limax_ranks_reports() == 1
end

--- Ends all work of MPI in this process, whose memory is about to be freed.
function ranks.stop()
  if ranks.count > 1 then ffi.C.limax_ranks_stop() end
end

--- Leaves the other ranks at the end of all work. Collective.
function ranks.finish()
  if ranks.count == 1 then return end
  ranks.gather "" -- while others still work
  ffi.C.limax_ranks_finish()
end

local function start()
  local loaded, message = host.open_library(LIBRARY)
  if not loaded then
    failure.raise(1, ("mpirun started %d processes, but limax was built without MPI (%s): install"
      .. " libopenmpi-dev and build again, or run it without mpirun"):format(started(), message))
  end
  ffi.cdef [[
    int limax_ranks_start(int* own, int* count);
    void limax_ranks_gather_sizes(const int64_t* own, int64_t* sizes);
    void limax_ranks_gather(const char* text, const int64_t* sizes, char* all);
    void limax_ranks_sum(int64_t* values, int count);
    void limax_ranks_share(void* items, const int* numbers, int bytes);
    void limax_ranks_trade(const void* out, const int* sent, void* in, const int* received,
      int bytes);
    int limax_ranks_done(double seconds);
    int limax_ranks_reports(void);
    void limax_ranks_stop(void);
    void limax_ranks_finish(void);
  ]]
  local own, count = ffi.new "int[1]", ffi.new "int[1]"
  if ffi.C.limax_ranks_start(own, count) ~= 0 then
    failure.raise(1, "this MPI does not serve several threads (MPI_THREAD_MULTIPLE)")
  end
  ranks.index, ranks.count = own[0], count[0]
end

if started() > 1 then start() end

return ranks
