--- run_folder.lua: the folder of a run. Files are replaced and lines appended as a unit, the
--- checkpoint last: whenever a run is killed, everything up to the generation of the checkpoint is
--- on disk, and anything beyond it is removed when the run continues. The files of a generation are
--- written while the next one is simulated.

local ffi = require "ffi"

local cut = require "limax.run.cut"
local engine_population = require "limax.engine.population"
local failure = require "limax.base.failure"
local generation_files = require "limax.run.generation_files"
local host = require "limax.host"
local keep_former = require "limax.run.keep_former"
local lines = require "limax.run.lines"
local npy = require "limax.base.npy"
local run_configuration = require "limax.run.run_configuration"
local run_files = require "limax.settings.run_files"
local sealed = require "limax.base.sealed"
local shell = require "limax.base.shell"
local source = require "limax.base.source"
local verify = require "limax.run.verify"

---@class limax.run_folder
---@field path string
---@field config table
---@field checkpoint table|nil repetition, generation and file sizes of the last generation that is
--- complete on disk
---@field writer limax.host.writer writes files asynchronously, in order
---@field pending { job: integer, checkpoint: table }[] checkpoints that are not on disk yet
---@field jobs table<integer, integer> the last job of a repetition's newest generation
---@field recent table<integer, table<integer, true>> generations by repetition: see note_recent
---@field bytes table<string, integer> length of each file that grows, as far as it is written
---@field lines limax.run.lines finds the lines of those files
---@field scored table<integer, string|nil> hash of what scored the last restored generation
---@field scored_by string|nil hash of what scores its robots now
local Folder = setmetatable({}, { __index = generation_files })
Folder.__index = Folder

local run_folder = {}

local GROWING = verify.GROWING

-- For the hashes of the lines and of the array, in place of which the writer puts them.
local UNKNOWN_LINES, UNKNOWN_ARRAY = ("?"):rep(16), ("!"):rep(16)

local function json(value) return host.json.encode(value, { indent = 2 }) .. "\n" end

local function sealed_json(value) return sealed.add(json(value)) end

--- Is there a run that can be continued?
function run_folder.is_run(path) return host.file.exists(path .. "/config.json") == "file" end

-- A folder that this process locks; nil and a message where another process uses it.
local function locked(path)
  local lock, message = host.file.lock(path)
  if not lock then return nil, message end
  local writer
  writer, message = host.file.writer()
  if not writer then failure.raise(1, message) end
  local self = setmetatable({ path = path, lock = lock, writer = writer, pending = {},
    jobs = {}, recent = {}, bytes = {}, lines = lines.new(path), scored = {} }, Folder)
  for _, name in ipairs(GROWING) do self.bytes[name] = 0 end
  return self
end

-- Sets the configuration under which robots are scored.
local function configure(self, config)
  self.config, self.scored_by = config, run_configuration.scored_by(config)
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
      :format(self.checkpoint.generation, self.checkpoint.repetition,
        shell.resume_command(self.path))
  elseif host.file.exists(self.path .. "/checkpoint") then
    state = "the generations that the folder held are as they were; limax list --check "
      .. shell.path(self.path) .. " verifies them"
  end
  failure.raise_machine("disk", message .. "; " .. state)
end

-- Waits until everything is on disk.
function Folder:settle() self:check(self.writer:wait()) end

function Folder:write_later(name, text)
  return self.writer:write(self.path .. "/" .. name, text)
end

-- Writes the genomes of an engine's population, which are copied at once.
function Folder:write_genomes(name, robots)
  local header = npy.header("<f4", { robots.count, robots.genes })
  local bytes = #header + robots.count * robots.genes * ffi.sizeof "float"
  local memory = ffi.cast("char *", self.writer:array(bytes))
  ffi.copy(memory, header, #header)
  engine_population.copy_genomes(robots, ffi.cast("float *", memory + #header))
  self.writer:write_array(self.path .. "/" .. name)
end

-- Writes a file after all that is still to be written, and waits until it is on disk.
function Folder:write(name, text)
  self:write_later(name, text)
  self:settle()
end

function Folder:make_folder(name) self:check(host.file.mkdir(self.path .. "/" .. name)) end

--- Writes STATUS: the state of the run.
---@param state "running"|"done"|"interrupted"|"failed"
function Folder:status(state, message)
  -- a run is done only with everything on disk
  if state == "failed" or state == "interrupted" then self.writer:wait() else self:settle() end
  self:update_checkpoint()
  if state == "done" then
    local missing = verify.missing(self.path, self.bytes)
    self:check(not missing, missing)
  end
  local at = self.checkpoint or {}
  self:check(host.file.write_atomic(self.path .. "/STATUS", json { schema = "limax.status/1",
    state = state, message = message, repetition = at.repetition, generation = at.generation }))
end

-- Scripts, each under its name below `place`.
function Folder:write_scripts(place, scripts)
  for _, copy in ipairs(scripts) do
    local name = place .. "/" .. copy.file
    self:make_folder(source.folder_of(name))
    self:write(name, copy.text)
  end
end

--- Adds this process, its device and the number of its ranks to those that wrote this folder.
---@param device table
function Folder:write_environment(device, ranks)
  local path = self.path .. "/environment.json"
  local environment = host.file.exists(path) and run_files.document(path, "environment")
    or { schema = "limax.environment/1", sessions = {} }
  table.insert(environment.sessions, { started = host.time(), version = host.version,
    commit = host.commit, ranks = ranks, machine = host.environment(), device = device:describe() })
  environment.hash = nil
  self:write("environment.json", sealed_json(environment))
end

-- Appends the line of a generation to a file that grows. Returns its hash.
function Folder:append(name, line)
  local text, path = host.json.encode(line) .. "\n", ("%s/%s.jsonl"):format(self.path, name)
  if name == "hashes" then
    text = sealed.add(text)
    self.writer:append_hashes(path, text)
  else
    self.writer:append(path, text)
  end
  self.lines:add(name, line.repetition, line.generation, self.bytes[name])
  self.bytes[name] = self.bytes[name] + #text
  return host.xxh3(text)
end

--- Writes a complete generation asynchronously, its checkpoint last. Raises an error of writing an
--- earlier one.
---@param written table metrics, ledger, seconds, supervision, robots, engine, champion, state,
--- archive
---@return number seconds that the run waited
function Folder:write_generation(written)
  local began = host.clock()
  local repetition, generation = written.metrics.repetition, written.metrics.generation
  -- one generation of a repetition is being written at a time, with its genomes
  self:check(self.writer:wait(self.jobs[repetition] or 0))
  local function place(kind) return verify.place(kind, repetition, generation) end
  for _, kind in ipairs { "population", "champion" } do
    self:make_folder(source.folder_of(place(kind)))
  end
  local champion = json(written.champion)
  local kept = self.config.record_population
  if kept then
    self:write_later(place "columns", written.robots)
  else
    self.writer:write_lines(self.path .. "/" .. place "population", written.robots)
  end
  self:write_genomes(place "genomes", written.engine)
  self:write_later(place "champion", champion)
  for _, kind in ipairs { "state", "archive" } do
    if written[kind] then
      self:make_folder(source.folder_of(place(kind)))
      self:write_later(place(kind), written[kind])
    end
  end
  local hashes = { schema = "limax.hashes/1", repetition = repetition, generation = generation,
    scored_by = self.scored_by, population = not kept and UNKNOWN_LINES or nil,
    [kept == "best" and "recent_columns" or "columns"] = kept and host.xxh3(written.robots) or nil,
    [kept == "best" and "recent_genomes" or "genomes"] = UNKNOWN_ARRAY,
    champion = host.xxh3(champion),
    state = written.state and host.xxh3(written.state),
    archive = written.archive and host.xxh3(written.archive) }

  local ledger, seconds = { schema = "limax.ledger/1", repetition = repetition,
    generation = generation }, {}
  for key, value in pairs(written.ledger) do ledger[key] = value end
  for key, value in pairs(written.seconds) do seconds[key] = value end
  hashes.ledger = self:append("ledger", ledger)
  hashes.metrics = self:append("metrics", written.metrics)
  seconds.write = host.clock() - began
  hashes.timing = self:append("timing", { schema = "limax.timing/1", repetition = repetition,
    generation = generation, ended = host.time(), seconds = seconds,
    supervision = written.supervision })
  self:append("hashes", hashes)
  local checkpoint = { schema = "limax.checkpoint/1", repetition = repetition,
    generation = generation, bytes = source.copy(self.bytes) }
  self.jobs[repetition] = self:write_later("checkpoint", sealed_json(checkpoint))
  self:remove_recent(repetition, generation - verify.RECENT)
  if kept == "best" then self:note_recent(repetition, generation) end
  table.insert(self.pending, { job = self.jobs[repetition], checkpoint = checkpoint })
  return host.clock() - began
end

-- ---- a new run ----------------------------------------------------------------------------------

-- What a process may leave that dies before its folder is a run.
local BEGUN = { scripts = true, STATUS = true, [".lock"] = true }
for _, name in ipairs(GROWING) do BEGUN[name .. ".jsonl"] = true end

local function is_free(path)
  for _, name in ipairs(host.file.list(path) or {}) do
    if not BEGUN[name] and not name:match "^%..*%.part$" then return false end
  end
  return true
end

--- The first free folder `runs/NAME-1`, `runs/NAME-2`, ...
function run_folder.next_free(name)
  local n = 1
  while host.file.exists(("runs/%s-%d"):format(name, n)) do n = n + 1 end
  return ("runs/%s-%d"):format(name, n)
end

--- Makes a new run folder.
---@param options { repetition: integer|nil, overrides: string[]|nil }
---@return limax.run_folder
function run_folder.create(path, experiment, options)
  local self, message = run_folder.take(path)
  if not self then failure.raise(2, message) end
  self:begin(experiment, options)
  return self
end

--- Makes and locks a folder that `begin` makes a run; nil and a message where it is used already.
---@return limax.run_folder|nil
---@return string|nil
function run_folder.take(path)
  if host.file.exists(path) == "file" then
    failure.raise(2, path .. " is a file, not a folder for a run")
  end
  local ok, message = host.file.mkdir(path)
  if not ok then failure.raise(2, message) end
  local self
  self, message = locked(path)
  if not self or is_free(path) then return self, message end
  self:close()
  return nil, ("%s is used already; name another folder, or continue it: with `limax run --resume"
    .. " %s`, or in a script's own loop with limax.start(experiment, { out = %q, resume = true })")
    :format(path, path, path)
end

--- Writes what a run begins with into a folder that was just taken.
---@param options { repetition: integer|nil, overrides: string[]|nil }
function Folder:begin(experiment, options)
  local config, scripts = run_configuration.of(experiment, options)
  configure(self, config)
  self:clean("", math.huge)
  self:clean("/scripts", math.huge)
  self:write_scripts("scripts", scripts)
  for _, name in ipairs(GROWING) do self:write(name .. ".jsonl", "") end
  self:status "running"
  -- last: a folder with a configuration is a run
  self:write("config.json", sealed_json(config))
end

-- ---- continuing a run ---------------------------------------------------------------------------

--- The configuration of a run folder; ends the command where it is not one.
---@return table config
---@return string path without a slash at its end
function run_folder.read_config(path)
  path = #path > 1 and path:gsub("/+$", "") or path
  return run_files.config(path), path
end

--- Opens a run folder and locks it. Nothing is changed yet.
---@return limax.run_folder
function run_folder.open(path)
  local config
  config, path = run_folder.read_config(path)
  if verify.is_edited(path) then
    failure.raise_damaged(("%s/config.json was edited or damaged: it does not match its hash."
      .. " Restore it; fields are changed by: %s --changed --set FIELD=VALUE"):format(path,
      shell.resume_command(path)))
  end
  local link = verify.link(path)
  if link then
    failure.raise(1, link .. " is a link: a run is not continued through links to other places;"
      .. " replace the link by a copy of what it refers to")
  end
  local self, message = locked(path)
  if not self then failure.raise(1, message) end
  configure(self, config)
  return self
end

-- Removes files of generations after `last`, and what a killed process was writing; nothing in a
-- folder that is a link to another place.
function Folder:clean(below, last)
  local path = self.path .. below
  local own = below == "" or host.file.exists(path, true) == "folder"
    and host.file.exists(source.folder_of(path), true) == "folder"
  for _, name in ipairs(own and host.file.list(path) or {}) do
    local generation = tonumber(name:match "^g(%d+)%.")
    if name:match "^%..*%.part$" or generation and generation > last then
      self:check(host.file.remove(path .. "/" .. name))
    end
  end
end

--- Removes everything after the last complete generation. Where configuration or scripts changed,
--- the former ones are kept. The new configuration comes last: it makes the change.
---@param config table the current configuration
---@param scripts table[] the current scripts
---@param changed boolean
---@param from? integer the last generation to keep
function Folder:continue(config, scripts, changed, from)
  cut(self, from)
  if changed then keep_former(self, sealed_json(self.config)) end
  configure(self, config)
  self:write_scripts("scripts", scripts)
  if changed then self:write("config.json", sealed_json(config)) end
end

--- Finds the generations that a folder holds.
---@param state limax.run.state of verify.folder
---@param keeps? fun(row: limax.run.row): boolean does this one stay? All do if left out
---@return limax.run.row|nil the last one that stays
function Folder:index(state, keeps)
  local last
  for k, row in ipairs(state.rows) do
    if not keeps or keeps(row) then
      last, self.scored[row.repetition] = row, row.scored_by
      if row.recent then self:note_recent(row.repetition, row.generation) end
      for name, offsets in pairs(state.offsets) do
        self.lines:add(name, row.repetition, row.generation, offsets[k])
      end
    end
  end
  return last
end

--- Was the newest generation of a repetition scored as the run scores now?
---@return boolean
function Folder:scores_valid(repetition)
  local scored_by = self.scored[repetition]
  return scored_by == nil or scored_by == self.scored_by
end

--- Sorts the lines of all generations by repetition. Repetitions that advance together append
--- theirs in turn; sorted, the files have the same bytes as those of one repetition after another.
function Folder:sort_lines()
  self:settle()
  for _, name in ipairs(GROWING) do
    if not self.lines:are_sorted(name) then self:rewrite(name) end
  end
end

--- Rewrites a file that grows: sorted, and only with the lines that `self.lines` knows.
function Folder:rewrite(name)
  local text = self.lines:sort(name)
  self.bytes[name] = #text
  self:write(name .. ".jsonl", text)
end

--- Lets other processes write this folder.
function Folder:close()
  self.writer:wait()
  if self.lock then self.lock:free() end
  self.lock = nil
end

return run_folder
