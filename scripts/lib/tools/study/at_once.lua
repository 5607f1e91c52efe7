--- at_once.lua: runs of a sweep in child processes of the same executable, several at a time.

local cells = require "limax.tools.study.cells"
local child = require "limax.base.child"
local exchange = require "limax.base.exchange"
local failure = require "limax.base.failure"
local host = require "limax.host"
local shell = require "limax.base.shell"
local sweep = require "limax.tools.study.sweep"

local at_once = {}

-- s between polls of the children
local POLL_INTERVAL = 0.05
-- the longest messages of a child that are printed, bytes
local MOST_TEXT = 2 ^ 16

--- The GPUs of one of several places: each place has at least one, and each GPU is used.
---@return string as CUDA_VISIBLE_DEVICES names them
function at_once.share(place, places, gpus)
  local list = {}
  for k, name in ipairs(gpus) do
    if (k - place) % math.min(places, #gpus) == 0 then list[#list + 1] = name end
  end
  return table.concat(list, ",")
end

-- A line about a run that has ended, and its messages.
local function report(self, state, status, settings)
  local run = self.runs[state.number]
  local errors = state.child.err
  errors:seek "set"
  local text = errors:read(MOST_TEXT) or ""
  state.child:close_files()
  local what
  if status ~= "0" then
    what = ("FAILED with status %s\n%s"):format(status, text)
  elseif not sweep.is_done(self, run) then
    what = "in use by another process"
  else
    local result = cells.result(self.out .. "/" .. run.path)
    what = ("%d generations, %d evaluations, best %s, %.1f s"):format(result.generations,
      result.evaluations, result.best and ("%.4g"):format(result.best) or "-",
      host.clock() - state.began)
    for line in text:gmatch "[^\n]+" do settings.warn(line) end
  end
  settings.say(("[%d/%d] %s: %s"):format(state.number, #self.runs, run.path, what),
    status ~= "0")
  return status == "0"
end

---@class limax.at_once.settings
---@field numbers integer[] of the runs
---@field places integer runs at a time
---@field threads integer of each run
---@field device string
---@field gpus string[] of which each run sees its share
---@field say fun(text: string, is_failure: boolean) receives a line per run
---@field warn fun(text: string) receives each warning of a run

-- Does another rank compute a run, or has it done so meanwhile?
local function is_elsewhere(self, number)
  if exchange.count == 1 then return false end
  local lock = sweep.claim(self, number)
  if lock then lock:free() end
  return not lock or sweep.is_done(self, self.runs[number])
end

--- Runs these runs of a sweep, and ends all children before it returns or raises.
---@param self limax.sweep
---@return integer failed
function at_once.run(self, settings)
  local next_run, failed, busy = 1, 0, {}
  local folder, message = host.file.temporary()
  if not folder then failure.raise(1, message) end
  local function start(place)
    local number
    repeat
      number = settings.numbers[next_run]
      if not number then return end
      next_run = next_run + 1
    until not is_elsewhere(self, number)
    local words = sweep.command(self, number, { threads = settings.threads,
      device = settings.device }) .. " --quiet"
    if settings.gpus[1] then
      words = ("env CUDA_VISIBLE_DEVICES=%s %s"):format(
        shell.quoted(at_once.share(place, settings.places, settings.gpus)), words)
    end
    busy[place] = { number = number, began = host.clock(),
      child = child.start(words, ("%s/%d"):format(folder, number)) }
  end
  local fine, value, trace = host.protect(function()
    repeat
      for place = 1, settings.places do
        local state = busy[place]
        local status = state and state.child:status()
        if status then
          busy[place] = nil
          state.child:close()
          if not report(self, state, status, settings) then failed = failed + 1 end
        end
        if not busy[place] then start(place) end
      end
      host.wait(POLL_INTERVAL)
    until not next(busy)
  end)
  -- all are interrupted before the first is waited for
  for _, state in pairs(busy) do state.child:interrupt() end
  for _, state in pairs(busy) do state.child:close() end
  host.file.remove_temporary(folder)
  if not fine then error(value == host.interrupt and value or trace or value, 0) end
  return failed
end

return at_once
