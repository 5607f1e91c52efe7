--- folder.lua: writes the folder of a run (reader.lua reads it). A reader opens only files that a
--- line of the journal names, so that it needs no lock and sees no half-written file.

local ffi = require "ffi"

local check = require "limax.run.check"
local choice = require "limax.base.choice"
local config = require "limax.run.config"
local failure = require "limax.base.failure"
local files = require "limax.run.files"
local host = require "limax.host"
local journal = require "limax.run.journal"
local npy = require "limax.base.npy"
local reader = require "limax.run.reader"
local robot_file = require "limax.robot.robot_file"
local seal = require "limax.base.seal"
local shell = require "limax.base.shell"
local source = require "limax.base.source"
local structured = require "limax.base.structured"

---@class limax.run_folder : limax.run.reader
---@field writer limax.host.writer writes files asynchronously, in order
---@field lock limax.host.lock of the journal
---@field sizes table<string, integer> bytes of each growing file, by its place
---@field jobs table<integer, integer> the last job of a repetition's newest generation
---@field begun table<integer, table> arrays of a repetition's newest generation
---@field token string of this process, for names of files that are not whole
---@field pending { job: integer, line: table }[] lines of the journal that are not on disk yet
---@field on_disk table|nil the line of the newest generation that is
---@field found_newest table|nil the line of a generation that an earlier process wrote
local Folder = setmetatable({}, { __index = reader.methods })
Folder.__index = Folder

local folder = {}

folder.is_run, folder.read = reader.is_run, reader.read

-- ---- writing files ------------------------------------------------------------------------------

-- Notes which generations are on disk, with the hashes of their arrays.
local function update(self)
  local done = self.writer:done()
  while self.pending[1] and self.pending[1].job <= done do
    self.on_disk = table.remove(self.pending, 1).line
    for _, part in pairs(self.on_disk.files) do
      local job = part[2]:match "^@(%d+)$"
      if job then part[2] = self.writer:hash(tonumber(job)) end
    end
  end
end

--- Ends the run after a disk error; complete generations stay on disk.
function Folder:check(ok, message)
  update(self)
  if ok then return end
  self.writer:wait()
  for _, begun in pairs(self.begun) do
    for _, kind in ipairs(files.ARRAYS) do host.file.remove(begun[kind].path) end
  end
  local text, newest = "no generation is on disk yet", self.on_disk or self.found_newest
  if newest then
    text = ("everything up to generation %d of repetition %d is on disk; continue with: %s")
      :format(newest.generation, newest.repetition, shell.resume_command(self.path))
  end
  failure.raise_machine("disk", message .. "; " .. text)
end

--- Waits until everything is on disk.
function Folder:settle() self:check(self.writer:wait()) end

-- Makes the folder of a file.
local function make_folder_of(self, place)
  self:check(host.file.mkdir(self.path .. "/" .. source.folder_of(place)))
end

-- Writes a file asynchronously. Returns its size and hash.
local function put(self, place, text)
  local _, size, hash = self.writer:write(self.path .. "/" .. place, text)
  return { size, hash }
end

-- Appends a line to a growing file. Returns where it ends, and its hash.
local function append(self, name, repetition, line)
  local place = files.growing(name, repetition)
  local _, size, hash = self.writer:append(self.path .. "/" .. place,
    host.json.encode(line) .. "\n")
  self.sizes[place] = (self.sizes[place] or 0) + size
  return { self.sizes[place], hash }
end

-- Ends the run before its next write if another process wrote the journal: on a network file system
-- a host that was cut off loses its lock.
local function expect_journal(self)
  self.writer:expect(self.journal.path, self.journal.bytes)
end

-- Appends a line to the journal.
local function note(self, line, state_text)
  expect_journal(self)
  if line.kind ~= "generation" then line.at = self.journal.bytes end
  local text, bytes = self.journal:add(line, state_text)
  if line.kind ~= "generation" then return (self.writer:append(self.journal.path, text)) end
  local job = self.writer:append_sealed(self.journal.path, text, bytes)
  table.insert(self.pending, { job = job, line = line })
  return job
end

-- Writes a file, and waits until it and all earlier ones are on disk.
local function write_now(self, place, text)
  make_folder_of(self, place)
  put(self, place, text)
  self:settle()
end

---@class limax.run_folder.array a file of a generation that ranks write
---@field path string absolute, until it is whole
---@field name string its path then
---@field header integer bytes before the rows
---@field row integer bytes of one
---@field others string|nil sums of the hashes of rows from other ranks

--- Begins the files of a generation's robots and genomes, in which ranks then write their rows.
--- Raises an error of writing an earlier generation.
---@return table files { genomes: limax.run_folder.array, robots: limax.run_folder.array }
function Folder:begin_arrays(robots)
  local repetition, generation = robots.repetition, robots.generation
  -- one generation of a repetition is being written at a time
  self:check(self.writer:wait(self.jobs[repetition] or 0))
  expect_journal(self)
  for _, kind in ipairs(generation == 0 and { "robots", "genomes", "champion" } or {}) do
    make_folder_of(self, files.place(kind, repetition, generation))
  end
  local all, genes, here = robots.rows, robots.own.genes, host.file.absolute "." .. "/"
  local function begin(kind, header, row)
    local name = self.path .. "/" .. files.place(kind, repetition, generation)
    local path = ("%s%s/.%s.%s.part"):format(name:match "^/" and "" or here,
      source.folder_of(name), source.name_of(name), self.token)
    self.writer:begin_array(path, header, all.count, row)
    return { path = path, name = name, header = #header, row = row }
  end
  local begun = {
    genomes = begin("genomes", npy.header("<f4", { all.count, genes }), genes * ffi.sizeof "float"),
    robots = begin("robots", structured.header(all.layout, all.count), all.layout.size) }
  self.begun[repetition] = begun
  if robots.world.is_divided then self:settle() end -- others look for them now
  return begun
end

-- Gives an array its name, when all that was written before is on disk. Its hash is a placeholder
-- until then.
local function end_array(self, array, rows)
  local _, hash = self.writer:end_array(array.path, array.name, array.others)
  return { array.header + rows * array.row, hash, array.row }
end

---@class limax.run_folder.generation
---@field robots limax.population.scored recorded
---@field metrics table its line
---@field evaluations integer of its repetition, up to here
---@field arrays table from `begin_arrays`, written
---@field began number when that was called
---@field matrix number[][]|nil B of the encoding, with generation 0

--- Writes a generation asynchronously; the line of the journal comes last.
---@return number seconds that the run waited
function Folder:write(written)
  local robots = written.robots
  local repetition, generation = robots.repetition, robots.generation
  local function place(kind) return files.place(kind, repetition, generation) end
  local line = { kind = "generation", repetition = repetition, generation = generation,
    scored_by = self.scored_by, evaluations = written.evaluations,
    recent = self.config.record_population == "best" or nil,
    transcript = source.size(self.path .. "/transcript.jsonl"), files = {}, lines = {} }
  for _, kind in ipairs(files.ARRAYS) do
    line.files[kind] = end_array(self, written.arrays[kind], robots.rows.count)
  end
  line.files.champion = put(self, place "champion",
    robot_file.text(robots[robots.ranked[1]]:table()))
  line.files.matrix = written.matrix and put(self, place "matrix", npy.table(written.matrix))
  local ledger, seconds = source.copy(robots.decided.ledger), source.copy(robots.timing)
  ledger.schema, ledger.repetition, ledger.generation = "limax.ledger/1", repetition, generation
  line.lines.ledger = append(self, "ledger", repetition, ledger)
  line.lines.metrics = append(self, "metrics", repetition, written.metrics)
  seconds.write = host.clock() - written.began
  line.lines.timing = append(self, "timing", repetition, { schema = "limax.timing/1",
    repetition = repetition, generation = generation, ended = host.time(), seconds = seconds,
    supervision = robots.decided.numbers })
  self.jobs[repetition] = note(self, line, robots.state_text)
  local old = self.journal:entry(repetition, generation - files.RECENT)
  for _, kind in ipairs(old and old.recent and files.ARRAYS or {}) do
    self.writer:remove(self.path .. "/" .. files.place(kind, repetition, old.generation))
  end
  return host.clock() - written.began
end

-- ---- a new run ----------------------------------------------------------------------------------

-- Locks a folder and makes the object that writes it; nil and a message if it is locked.
local function locked(path)
  local lock, message = host.file.lock(path .. "/" .. journal.FILE)
  if not lock then return nil, message end
  local writer
  writer, message = host.file.writer()
  if not writer then failure.raise(1, message) end
  return setmetatable({ path = path, lock = lock, writer = writer, sizes = {}, jobs = {},
    begun = {}, pending = {}, token = host.xxh3(host.time() .. host.clock()) }, Folder)
end

-- Sets the configuration under which robots are scored.
local function configure(self, made)
  self.config, self.scored_by = made, config.scored_by(made)
end

-- Files that a process may leave if it ends before its folder is a run.
local BEGUN = { scripts = true, [journal.FILE] = true }

local function is_free(path)
  for _, name in ipairs(host.file.list(path) or {}) do
    if not BEGUN[name] and not name:match "^%..*%.part$" then return false end
  end
  return source.size(path .. "/" .. journal.FILE) == 0
end

--- The first free folder `runs/NAME-1`, `runs/NAME-2`, ...
function folder.next_free(name)
  local n = 1
  while host.file.exists(("runs/%s-%d"):format(name, n)) do n = n + 1 end
  return ("runs/%s-%d"):format(name, n)
end

--- Makes and locks a folder for `begin`; nil and a message if it is used already.
function folder.take(path)
  if host.file.exists(path) == "file" then
    failure.raise(2, path .. " is a file, not a folder for a run")
  end
  local ok, message = host.file.mkdir(path)
  if not ok then failure.raise(2, message) end
  source.refuse_links(path, 1)
  local used = ("%s is used already; name another folder, or continue it: with `limax run --resume"
    .. " %s`, or in a script's own loop with limax.start(experiment, { out = %q, resume = true })")
    :format(path, path, path)
  if next(host.file.list(path) or {}) and not host.file.exists(path .. "/" .. journal.FILE) then
    return nil, used
  end
  local self
  self, message = locked(path)
  if not self or is_free(path) then return self, message end
  self:close()
  return nil, used
end

-- Removes below a path all partly written files, and those for whose name `is_needless` is true.
local function clean(self, path, is_needless)
  for _, name in ipairs(host.file.list(path) or {}) do
    local inner = path .. "/" .. name
    if host.file.exists(inner, true) == "folder" then
      clean(self, inner, is_needless)
    elseif name:match "^%..*%.part$" or is_needless and is_needless(name) then
      self:check(host.file.remove(inner))
    end
  end
end

-- Writes scripts, each under its name below `place`.
local function write_scripts(self, place, scripts)
  for _, copy in ipairs(scripts) do write_now(self, place .. "/" .. copy.file, copy.text) end
end

--- Writes configuration and scripts into a folder from `take`.
---@param options { repetition: integer|nil, overrides: string[]|nil, own_loop: true|nil }
function Folder:begin(experiment, options)
  local made, scripts = config.of(experiment, options)
  clean(self, self.path)
  configure(self, made)
  write_scripts(self, "scripts", scripts)
  local text = seal.add(made)
  write_now(self, config.FILE, text)
  self.config_name, self.config_hash = config.FILE, config.hash(text)
  self.journal = assert(journal.read(self.path))
end

--- Makes a new run folder.
function folder.create(path, experiment, options)
  local self, message = folder.take(path)
  if not self then failure.raise(2, message) end
  self:begin(experiment, options)
  return self
end

--- Begins to write: adds this process, its device and the number of its ranks to the journal. From
--- here on the configuration is in force.
---@param ranks integer|nil of mpirun
function Folder:start(device, ranks)
  note(self, { kind = "begin", started = host.time(), version = host.version,
    commit = host.commit, ranks = ranks, config = self.config_name,
    config_hash = self.config_hash, machine = host.environment(), device = device:describe(),
    transcript = source.size(self.path .. "/transcript.jsonl") })
  self:settle()
end

-- ---- continuing a run ---------------------------------------------------------------------------

--- Opens and locks a run folder, to continue it. Changes nothing yet.
function folder.open(path)
  local read = folder.read(path)
  local self, message = locked(read.path)
  if not self then failure.raise(1, message) end
  -- read again: another process may have written it before the lock
  read = folder.read(read.path)
  for name, value in pairs(read) do self[name] = value end
  for _, r in ipairs(self:repetitions()) do
    self.found_newest = self.journal:entry(r, self:last(r))
  end
  configure(self, read.config)
  return self
end

-- The repetitions that lose generations after `from`: those that are damaged, or all. Refuses a
-- generation from which a run could not continue.
local function cut_of(self, damage, from)
  local damaged, all, last = {}, host.json.array {}, -1
  for _, each in ipairs(damage) do
    if each.repetition then damaged[each.repetition] = true end
  end
  for _, r in ipairs(self:repetitions()) do
    if not next(damaged) or damaged[r] then
      all[#all + 1] = r
      last = math.max(last, (self.journal.next[r] or 0) - 1)
      local kept = self.journal:entry(r, from)
      local first = math.max(0, from - files.RECENT + 1)
      local path = ("%s/%s"):format(self.path, files.place("robots", r, first))
      if kept and kept.recent and not host.file.exists(path) then
        failure.raise(2, ("--from %d: record.population = \"best\" keeps all robots of the newest"
          .. " %d generations only, and going on needs those of generation %d; leave out --from, or"
          .. " start again with record.population = \"all\""):format(from, files.RECENT, first))
      end
    end
  end
  if from > last then
    failure.raise(2, ("--from %d: the last generation in %s is %d"):format(from, self.path, last))
  end
  return all
end

-- Refuses a damaged folder. The message names the generation from which the run can continue.
local function refuse_damage(self, damage)
  local last, remedy = check.last_whole(self, damage), "restore what is damaged from a copy"
  if check.is_unreadable(damage) then
    remedy = "make every file readable, then continue with: " .. shell.resume_command(self.path)
  elseif last and failure.attempt(cut_of, self, damage, last) then
    remedy = ("everything up to generation %d is whole; go on from there with: %s --from %d")
      :format(last, shell.resume_command(self.path), last)
  end
  failure.raise(1, ("%s is damaged:\n%s\n%s"):format(self.path, check.text(damage), remedy))
end

-- The damage that a cut leaves.
local function remaining(damage, from)
  local rest = {}
  for _, each in ipairs(damage) do
    if not each.generation or each.generation <= from or each.unreadable then
      rest[#rest + 1] = each
    end
  end
  return rest
end

-- Removes the lines of removed generations from the transcript.
local function cut_transcript(self)
  local text = source.read(self.path .. "/transcript.jsonl")
  if not text then return end
  write_now(self, "transcript.jsonl", (text:gsub("[^\n]*\n", function(line)
    local r = tonumber(line:match '"repetition":(%d+)')
    local g = tonumber(line:match '"generation":(%d+)')
    return r and g and g <= self.journal:newest(r) and line or ""
  end)))
end

-- Removes configurations that never came into force, and their scripts.
local function cut_configurations(self)
  local newest = tonumber(self.config_name:match "%d+") or 1
  for _, name in ipairs(host.file.list(self.path) or {}) do
    local number = tonumber(name:match "^config%-(%d+)%.json$" or name:match "^scripts%-(%d+)$")
    local path = self.path .. "/" .. name
    if number and number > newest and host.file.exists(path) == "folder" then
      clean(self, path, function() return true end)
    elseif number and number > newest then
      self:check(host.file.remove(path))
    end
  end
end

-- Removes everything that the journal does not name.
local function cut_files(self)
  self:check(host.file.truncate(self.journal.path, self.journal.bytes))
  cut_configurations(self)
  clean(self, self.path)
  for _, name in ipairs(host.file.list(self.path) or {}) do
    local r = tonumber(name:match "^r(%d+)$")
    local last = r and self.journal:newest(r)
    for kind in pairs(r and files.PLACES or {}) do
      local path = ("%s/%s"):format(self.path, source.folder_of(files.place(kind, r, 0)))
      clean(self, path, function(file)
        local generation = tonumber(file:match "^g(%d+)%.")
        local entry = generation and self.journal:entry(r, generation)
        return generation and (not entry or entry.recent and generation <= last - files.RECENT
          and choice.contains(files.ARRAYS, kind))
      end)
    end
    for _, growing in ipairs(r and files.GROWING or {}) do
      local place = files.growing(growing, r)
      local entry = self.journal:entry(r, last)
      self.sizes[place] = entry and entry.lines[growing][1] or 0
      if host.file.exists(self.path .. "/" .. place) then
        self:check(host.file.truncate(self.path .. "/" .. place, self.sizes[place]))
      end
    end
  end
end

-- The name of the next configuration: "config-2.json" after the first one.
local function next_config(self)
  local n = tonumber(self.config_name:match "^config%-(%d+)%.json$") or 1
  return ("config-%d.json"):format(n + 1), ("scripts-%d"):format(n + 1)
end

--- Verifies a folder, then removes everything after the last generation that is named, or after the
--- generation `from`. Where configuration or scripts changed, the new ones come beside the former;
--- they are in force from the next `start` on. Nothing is changed before everything is verified.
---@param made table the current configuration
---@param scripts table[] the current scripts
---@param from? integer the last generation to keep
function Folder:continue(made, scripts, changed, from)
  local damage = check.folder(self)
  local repetitions = from and cut_of(self, damage, from)
  local rest = from and remaining(damage, from) or damage
  if rest[1] then refuse_damage(self, rest) end
  if from then
    self:check(host.file.truncate(self.journal.path, self.journal.bytes))
    note(self, { kind = "cut", from = from, repetitions = repetitions })
    self:settle()
  end
  -- also if a process was killed in between
  if (self.journal.last or {}).kind == "cut" then cut_transcript(self) end
  cut_files(self)
  configure(self, made)
  if not changed then return end
  local name, place = next_config(self)
  write_scripts(self, place, scripts)
  local text = seal.add(made)
  write_now(self, name, text)
  self.config_name, self.config_hash = name, config.hash(text)
end

-- ---- the end ------------------------------------------------------------------------------------

--- Writes how the run ended: it is done only if every named file exists.
---@param ended "done"|"stopped"|"failed"
---@param message? string why it failed
function Folder:finish(ended, message)
  if ended == "done" then self:settle() else self.writer:wait() end
  update(self)
  if ended == "done" then
    local missing = check.missing(self)
    self:check(not missing, missing)
  end
  note(self, { kind = "end", state = ended, message = message, ended = host.time() })
  self:check(self.writer:wait())
end

--- Lets other processes write this folder.
function Folder:close()
  self.writer:wait()
  if self.lock then self.lock:free() end
  self.lock = nil
end

return folder
