--- rank_share.lua: divides the cores and GPUs of a host among its ranks of mpirun. All must compute
--- the same bits.

local ffi = require "ffi"

local at_once = require "limax.tools.study.at_once"
local exchange = require "limax.base.exchange"
local failure = require "limax.base.failure"
local host = require "limax.host"
local run_config = require "limax.run.config"

local rank_share = {}

ffi.cdef "int setenv(const char* name, const char* value, int overwrite);"

-- The cores that this process may use, as Linux lists them: "0-3,8".
local function allowed_cores()
  local file = io.open "/proc/self/status"
  local text = file and file:read "*a" or ""
  if file then file:close() end
  return text:match "Cpus_allowed_list:%s*(%S+)" or ""
end

-- The GPUs that this process may use, as CUDA_VISIBLE_DEVICES names them.
local function visible_gpus()
  local visible, list = os.getenv "CUDA_VISIBLE_DEVICES", {}
  for word in (visible or ""):gmatch "[^,%s]+" do list[#list + 1] = word end
  for k = 0, visible and -1 or 63 do
    local device = io.open(("/dev/nvidia%d"):format(k))
    if device then
      device:close()
      list[#list + 1] = tostring(#list)
    end
  end
  return list
end

--- Takes this rank's share: the number of its threads, unless one is given, and its GPUs, from now
--- on in CUDA_VISIBLE_DEVICES. All ranks must call it.
function rank_share.take(threads)
  if exchange.count == 1 then return threads end
  local facts, gpus = host.environment(), visible_gpus()
  local ranks = exchange.all { host = facts.hostname, cores = allowed_cores(),
    gpus = table.concat(gpus, ",") }
  local own = ranks[exchange.index + 1]
  -- this rank's place among those that see the same
  local function place_among(name)
    local place, places = 0, 0
    for k, rank in ipairs(ranks) do
      if rank.host == own.host and rank[name] == own[name] then
        places = places + 1
        if k <= exchange.index + 1 then place = places end
      end
    end
    return place, places
  end
  local place, places = place_among "gpus"
  if #gpus > 1 and places > 1 then
    ffi.C.setenv("CUDA_VISIBLE_DEVICES", at_once.share(place, places, gpus), 1)
  end
  if threads or (os.getenv "LIMAX_THREADS" or "") ~= "" then return threads end
  local _, sharing = place_among "cores"
  return math.max(1, math.floor(facts.cores / sharing))
end

--- Refuses ranks that would not compute the same.
function rank_share.check(experiment, device)
  if exchange.count == 1 then return end
  local about, config = device:describe(), run_config.of(experiment, {})
  local ranks = exchange.all {
    { "limax", ("%s %s"):format(host.version, host.commit or "") },
    { "script or configuration", host.sha256(host.json.encode(config)) },
    { "kind of device", about.gpus and about.gpus[1].name or jit.arch .. " CPU" } }
  for r, facts in ipairs(ranks) do
    for k, fact in ipairs(facts) do
      if fact[2] ~= ranks[1][k][2] then
        failure.raise(2, ("rank %d has another %s than rank 0 (%s and %s), and would not give the"
          .. " same numbers: start all with the same files, on nodes of one kind"):format(r - 1,
          fact[1], fact[2], ranks[1][k][2]))
      end
    end
  end
end

return rank_share
