--- run_folder.lua: one execution, one folder. Files are replaced and lines appended as a unit,
--- the checkpoint last: whenever a run is killed, everything up to the generation of the checkpoint
--- is on disk, and anything beyond it is cut when the run continues. The files of a generation are
--- written while the next one is simulated.

local ffi = require "ffi"

local failure = require "limax.base.failure"
local host = require "limax.host"
local npy = require "limax.base.npy"
local run_configuration = require "limax.run.run_configuration"
local run_lines = require "limax.run.run_lines"
local shell = require "limax.base.shell"
local source = require "limax.base.source"

---@class limax.run_folder
---@field path string
---@field config table
---@field checkpoint table|nil repetition, generation and file sizes of the last generation that is
--- complete on disk
---@field writer limax.host.writer writes files asynchronously, in order
---@field pending { job: integer, checkpoint: table }[] checkpoints that are not on disk yet
---@field jobs table<integer, integer> the last job of a repetition's newest generation
---@field genomes table<integer, ffi.cdata*> of that generation, which is being written
---@field grown limax.run_lines the files that grow by a line per generation
local Folder = {}
Folder.__index = Folder

local run_folder = {}

local function json(value) return host.json.encode(value, { indent = 2 }) .. "\n" end

--- The path of a file of one generation in the run folder.
---@param kind "population"|"champions"
---@param ending string
---@return string
function run_folder.place(repetition, kind, generation, ending)
  return ("%s/%s/g%04d%s"):format(run_lines.folder_of(repetition), kind, generation, ending)
end

--- The command that continues the run in a folder, ready to be pasted into a shell.
---@return string
function run_folder.resume_command(path)
  return ("%s run --resume %s"):format(shell.program(), shell.quoted(path))
end

function Folder:resume_command() return run_folder.resume_command(self.path) end

--- Is there a run that can be continued?
---@return boolean
function run_folder.is_run(path) return host.file.exists(path .. "/config.json") == "file" end

-- A folder that this process locks; then what its checkpoint states.
local function locked(path, config)
  local lock, message = host.file.lock(path)
  if not lock then failure.raise(1, message) end
  local self = setmetatable({ path = path, config = config, lock = lock,
    writer = host.file.writer(), pending = {}, jobs = {}, genomes = {} }, Folder)
  if host.file.exists(path .. "/checkpoint") then
    self.checkpoint, message = source.read_json(path .. "/checkpoint")
    if not self.checkpoint then failure.raise(1, tostring(message)) end
  end
  self.grown = run_lines.new(self, self.checkpoint)
  return self
end

-- ---- writing files ------------------------------------------------------------------------------

-- Updates the checkpoint to the last one that is on disk.
function Folder:update_checkpoint()
  local done = self.writer:done()
  while self.pending[1] and self.pending[1].job <= done do
    self.checkpoint = table.remove(self.pending, 1).checkpoint
  end
end

--- Ends the run after a disk error; complete generations stay on disk.
---@param ok any
function Folder:check(ok, message)
  self:update_checkpoint()
  if ok then return end
  local state = "no generation is on disk yet"
  if self.checkpoint then
    state = ("everything up to generation %d of repetition %d is on disk; continue with: %s")
      :format(self.checkpoint.generation, self.checkpoint.repetition, self:resume_command())
  end
  failure.raise_machine("disk", message .. "; " .. state)
end

-- Waits until everything is on disk.
function Folder:settle() self:check(self.writer:wait()) end

-- Writes a file at once, after all that is still to be written.
function Folder:write(name, text)
  self:settle()
  self:check(host.file.write_atomic(self.path .. "/" .. name, text))
end

function Folder:write_later(name, text, array, bytes)
  return self.writer:write(self.path .. "/" .. name, text, array, bytes)
end

function Folder:make_folder(name) self:check(host.file.mkdir(self.path .. "/" .. name)) end

--- Writes STATUS: the state of the run.
---@param state "running"|"done"|"interrupted"|"failed"
function Folder:status(state, message)
  -- a run is done only with everything on disk
  if state == "failed" or state == "interrupted" then self.writer:wait() else self:settle() end
  self:update_checkpoint()
  local at = self.checkpoint or {}
  self:check(host.file.write_atomic(self.path .. "/STATUS", json { schema = "limax.status/1",
    state = state, message = message, repetition = at.repetition, generation = at.generation }))
end

-- Scripts as they were, each under its name.
function Folder:write_scripts(scripts)
  for _, copy in ipairs(scripts) do
    local name = "scripts/" .. copy.file
    self:make_folder(source.folder_of(name))
    self:write(name, copy.text)
  end
end

--- Adds this process and its device to the processes that wrote this folder.
---@param device table
function Folder:write_environment(device)
  local text = source.read(self.path .. "/environment.json")
  local environment = text and host.json.decode(text)
    or { schema = "limax.environment/1", sessions = {} }
  table.insert(environment.sessions, { started = host.time(), version = host.version,
    machine = host.environment(), device = device:describe() })
  self:write("environment.json", json(environment))
end

-- Writes a checkpoint: everything written so far is complete. Returns its job.
function Folder:write_checkpoint(repetition, generation)
  local bytes, ahead = self.grown:sizes()
  local checkpoint = { schema = "limax.checkpoint/1", repetition = repetition,
    generation = generation, bytes = bytes, ahead = ahead }
  local job = self:write_later("checkpoint", json(checkpoint))
  table.insert(self.pending, { job = job, checkpoint = checkpoint })
  return job
end

--- Appends the lines of this repetition from now on. All earlier repetitions must have their last
--- generation. Until the first call, lines are appended as they come.
function Folder:append_lines_of(repetition)
  self:settle()
  if not self.grown:append_lines_of(repetition) then return end
  self:write_checkpoint(self.checkpoint.repetition, self.checkpoint.generation)
  self:settle()
  self.grown:remove_waiting(repetition)
end

--- Writes a complete generation asynchronously, its checkpoint last. Raises an error of writing an
--- earlier one.
---@param written table metrics, ledger, seconds, supervision, text, engine, champion
---@return number seconds that the run waited
function Folder:write_generation(written)
  local began = host.clock()
  local repetition, generation = written.metrics.repetition, written.metrics.generation
  -- one generation of a repetition is being written at a time, with its genomes
  self:check(self.writer:wait(self.jobs[repetition] or 0))
  local robots = written.engine
  local genomes = robots:genomes_array(self.genomes[repetition])
  self.genomes[repetition] = genomes
  local function place(kind, ending)
    return run_folder.place(repetition, kind, generation, ending)
  end
  for _, kind in ipairs { "population", "champions" } do
    self:make_folder(run_lines.folder_of(repetition) .. "/" .. kind)
  end
  self:write_later(place("population", ".jsonl"), written.text)
  self:write_later(place("population", ".npy"), npy.header("<f4", { robots.count, robots.genes }),
    genomes, ffi.sizeof(genomes))
  self:write_later(place("champions", ".json"), json(written.champion))

  local ledger, seconds = { schema = "limax.ledger/1", repetition = repetition,
    generation = generation }, {}
  for key, value in pairs(written.ledger) do ledger[key] = value end
  for key, value in pairs(written.seconds) do seconds[key] = value end
  self.grown:append("ledger", ledger)
  self.grown:append("metrics", written.metrics)
  seconds.write = host.clock() - began
  self.grown:append("timing", { schema = "limax.timing/1", repetition = repetition,
    generation = generation, ended = host.time(), seconds = seconds,
    supervision = written.supervision })
  self.jobs[repetition] = self:write_checkpoint(repetition, generation)
  return host.clock() - began
end

-- ---- a new run ----------------------------------------------------------------------------------

--- The first free folder `runs/NAME-1`, `runs/NAME-2`, ...
---@return string
function run_folder.next_free(name)
  local n = 1
  while host.file.exists(("runs/%s-%d"):format(name, n)) do n = n + 1 end
  return ("runs/%s-%d"):format(name, n)
end

--- Takes a new or empty folder, which `begin` makes a run.
---@return limax.run_folder
function run_folder.take(path)
  local kind = host.file.exists(path)
  if kind == "file" then failure.raise(2, path .. " is a file, not a folder for a run") end
  if kind == "folder" and #(host.file.list(path) or {}) > 0 then
    failure.raise(2, path
      .. " is used already; name another folder, or continue it with --resume " .. path)
  end
  local ok, message = host.file.mkdir(path)
  if not ok then failure.raise(2, message) end
  return locked(path)
end

--- Writes what a run begins with into a folder that was just taken.
---@param options { repetition: integer|nil, overrides: string[]|nil }
function Folder:begin(experiment, options)
  local config, scripts = run_configuration.of(experiment, options)
  self.config = config
  self:write_scripts(scripts)
  self.grown:create()
  self:status "running"
  -- last: a folder with a configuration is a run
  self:write("config.json", json(config))
end

--- Makes a new run folder.
---@param options { repetition: integer|nil, overrides: string[]|nil }
---@return limax.run_folder
function run_folder.create(path, experiment, options)
  local self = run_folder.take(path)
  self:begin(experiment, options)
  return self
end

-- Removes a file or a folder; a link is removed and not followed.
local function remove(path)
  if host.file.remove(path) then return end
  for _, name in ipairs(host.file.list(path) or {}) do remove(path .. "/" .. name) end
  host.file.remove(path)
end

--- Removes a folder that was taken and has not become a run.
function Folder:abandon()
  if not run_folder.is_run(self.path) then remove(self.path) end
end

-- ---- continuing a run ---------------------------------------------------------------------------

--- Opens a run folder and locks it. Nothing is changed yet.
---@return limax.run_folder
function run_folder.open(path)
  path = #path > 1 and path:gsub("/+$", "") or path
  local config, message = source.read_json(path .. "/config.json")
  if not config then
    failure.raise(2, ("%s is not a run folder: %s"):format(path, tostring(message)))
  end
  if config.schema ~= "limax.config/1" then
    failure.raise(2, ("%s/config.json: expected schema limax.config/1, got %s")
      :format(path, tostring(config.schema)))
  end
  return locked(path, config)
end

-- Removes files of generations after `last`, and what a killed process was writing.
function Folder:clean(below, last)
  local path = self.path .. below
  for _, name in ipairs(host.file.exists(path) == "folder" and host.file.list(path) or {}) do
    local generation = tonumber(name:match "^g(%d+)%.")
    if name:match "^%..*%.part$" or generation and generation > last then
      self:check(host.file.remove(path .. "/" .. name))
    end
  end
end

-- Removes files of generations after the last complete one of each repetition.
function Folder:remove_unfinished()
  local last = {}
  for _, line in ipairs(self:lines "metrics") do last[line.repetition] = line.generation end
  self:clean("", math.huge)
  for _, name in ipairs(host.file.list(self.path) or {}) do
    local repetition = tonumber(name:match "^r(%d+)$")
    if repetition then
      for _, below in ipairs { "", "/population", "/champions" } do
        self:clean("/" .. name .. below, last[repetition] or -1)
      end
      self.grown:remove_waiting(repetition)
    end
  end
end

--- Cuts everything beyond the last complete generation. Where configuration or scripts changed, the
--- former ones are kept as config-N.json and scripts-N.
---@param config table the current configuration
---@param scripts table[] the current scripts
---@param changed boolean
function Folder:continue(config, scripts, changed)
  self.grown:cut()
  self:remove_unfinished()
  if not changed then return end
  local n = 1
  while host.file.exists(("%s/config-%d.json"):format(self.path, n)) do n = n + 1 end
  self:write(("config-%d.json"):format(n), json(self.config))
  if host.file.exists(self.path .. "/scripts") then
    self:check(host.file.rename(self.path .. "/scripts", ("%s/scripts-%d"):format(self.path, n)))
  end
  self:write_scripts(scripts)
  self:write("config.json", json(config))
  self.config = config
end

--- All lines of metrics, ledger or timing.
---@param name "metrics"|"ledger"|"timing"
---@return table[]
function Folder:lines(name) return self.grown:read(name) end

-- A file of a generation.
function Folder:read_generation(repetition, generation, ending)
  local path = self.path .. "/" .. run_folder.place(repetition, "population", generation, ending)
  local text, message = source.read(path)
  if not text then failure.raise(1, message) end
  return text, path
end

---@class limax.run_folder.generation
---@field metrics table its line
---@field ledger table its record
---@field text string its population file
---@field genomes string|nil float32 [robot][gene], for the newest ones

--- Everything that is kept of one repetition, generation by generation.
---@param genomes_kept integer number of newest generations with their genomes
---@return limax.run_folder.generation[]
function Folder:generations(repetition, genomes_kept)
  local list, ledgers = {}, {}
  for _, line in ipairs(self:lines "ledger") do
    if line.repetition == repetition then ledgers[line.generation] = line end
  end
  for _, line in ipairs(self:lines "metrics") do
    if line.repetition == repetition then
      local ledger = ledgers[line.generation]
      ledger.schema, ledger.repetition, ledger.generation = nil, nil, nil
      list[#list + 1] = { metrics = line, ledger = ledger,
        text = self:read_generation(repetition, line.generation, ".jsonl") }
    end
  end
  for k = math.max(1, #list - genomes_kept + 1), #list do
    local bytes, path = self:read_generation(repetition, list[k].metrics.generation, ".npy")
    local array, message = npy.decode(bytes)
    if not array then failure.raise(1, ("%s: %s"):format(path, message)) end
    list[k].genomes = array.data
  end
  return list
end

--- Lets other processes write this folder.
function Folder:close()
  self.writer:wait()
  if self.lock then self.lock:free() end
  self.lock = nil
end

return run_folder
