--- reader.lua: a run folder as commands read it. Every file and every line is compared with the
--- journal, and every object with its fields (settings/records.lua): a damaged or foreign file ends
--- the command with one message that names file, line, field and what was expected.

local ffi = require "ffi"

local choice = require "limax.base.choice"
local config = require "limax.run.config"
local failure = require "limax.base.failure"
local files = require "limax.run.files"
local host = require "limax.host"
local journal = require "limax.run.journal"
local npy = require "limax.base.npy"
local parts = require "limax.run.parts"
local record_rules = require "limax.settings.record_rules"
local records = require "limax.settings.records"
local rows_file = require "limax.robot.rows_file"
local source = require "limax.base.source"
local study_file = require "limax.run.study_file"

---@class limax.run.reader
---@field path string
---@field config table in force
---@field config_name string its file
---@field config_hash string
---@field is_edited boolean has the configuration another hash than in the journal?
---@field owner "own"|"other"|"edited"|"none" whose configuration it is (base/seal.lua)
---@field key string|nil name of the key that sealed it
---@field journal limax.journal
local Reader = {}
Reader.__index = Reader

local reader = { methods = Reader }

local RULES = { metrics = record_rules.rule(records.generation),
  ledger = record_rules.rule(records.ledger), timing = record_rules.rule(records.timing) }

-- Ends the command; a damaged file may contain anything, but no control character is shown.
local function damaged(where, message)
  failure.raise_damaged(("%s: %s"):format(where, (tostring(message):gsub("%c", "?"))))
end

--- Is this path a run folder?
function reader.is_run(path)
  return host.file.exists(path .. "/" .. config.FILE) == "file"
    and host.file.exists(path .. "/" .. journal.FILE) ~= nil
end

-- The end of a message about a folder that is not a run folder but holds some.
local function runs_in(folder)
  if study_file.exists(folder) then
    local first = study_file.read(folder).runs[1]
    return ("; it is a sweep or a study: name one of its runs%s; limax report %s shows them all"):
      format(first and (", such as %s/%s"):format(folder, first.path) or "", folder)
  end
  local parent = folder:match "^(.*)/r%d+$"
  if parent and reader.is_run(parent) then
    return ("; it is a repetition of the run %s: name that"):format(parent)
  end
  for _, name in ipairs(host.file.list(folder) or {}) do
    local path = folder .. "/" .. name
    if reader.is_run(path) then
      return ("; it holds runs, such as %s: limax list %s"):format(path, folder)
    end
  end
  return ""
end

--- Reads a run folder as it is now; ends the command if it is not one.
function reader.read(path)
  path = #path > 1 and path:gsub("/+$", "") or path
  if not reader.is_run(path) then
    failure.raise(2, ("%s is not a run folder: it has no config.json and journal.jsonl%s"):format(
      path, runs_in(path)))
  end
  source.refuse_links(path, 1)
  local read, message = journal.read(path)
  if not read then failure.raise_damaged(message) end
  local self = setmetatable({ path = path, journal = read, config_name = read.config }, Reader)
  local where = path .. "/" .. read.config
  local text, problem = source.read_own(where)
  if not text then failure.raise_damaged(problem) end
  self.config_hash = config.hash(text)
  self.config, self.owner, self.key = config.parse(text, "")
  if not self.config then damaged(where, (self.owner:gsub("^: ", ""))) end
  self.is_edited = read.config_hash ~= nil and read.config_hash ~= self.config_hash
  if self.is_edited then self.owner = "edited" end
  return self
end

--- A message if the configuration is not the one that the journal names; nil if it is.
function Reader:edited_text()
  return self.is_edited and ("%s/%s was changed since it was written: its hash is not that in %s")
    :format(self.path, self.config_name, journal.FILE) or nil
end

--- A reader that another rank made: of its scripts only.
---@param facts { path: string, config: table, config_name: string, owner: string }
function reader.of(facts) return setmetatable(facts, Reader) end

--- The folder of the scripts of a configuration.
---@param name? string of its file; that in force if left out
function Reader:scripts_path(name)
  return self.path .. "/" .. (name or self.config_name):gsub("^config", "scripts")
    :gsub("%.json$", "")
end

--- The repetitions that have a generation.
function Reader:repetitions()
  local list = {}
  for _, r in ipairs(choice.sorted_keys(self.journal.generations)) do
    if self.journal:newest(r) >= 0 then list[#list + 1] = r end
  end
  return list
end

--- The newest generation of a repetition; -1 where it has none.
function Reader:last(repetition) return self.journal:newest(repetition) end

--- The evaluations of a repetition so far.
function Reader:evaluations(repetition)
  local entry = self.journal:entry(repetition, self:last(repetition))
  return entry and entry.evaluations or 0
end

--- Waits for what this process still writes to the folder: a reader writes nothing.
function Reader:settle() end

-- The object of a line of a growing file.
local function object_of(text, name, where, entry)
  if host.xxh3(text) ~= entry.lines[name][2] then
    damaged(where, ("the line of generation %d does not match its hash in %s"):format(
      entry.generation, journal.FILE))
  end
  local value, message = host.json.decode(text, "")
  if value == nil then damaged(where, (message:gsub("^: ", ""):gsub("^line 1, ", ""))) end
  message = type(value) ~= "table" and "expected a JSON object" or select(2, RULES[name](value, ""))
  if message then damaged(where, message) end
  if value.repetition ~= entry.repetition or value.generation ~= entry.generation then
    damaged(where, ("generation: expected %d of repetition %d"):format(entry.generation,
      entry.repetition))
  end
  return value
end

-- Calls `visit(text, entry, where)` with the lines of some generations of a growing file.
local function each_line(self, name, repetition, first, last, visit)
  if last < first then return end
  self:settle()
  local path = ("%s/%s"):format(self.path, files.growing(name, repetition))
  if host.file.exists(path, true) == "other" then damaged(path, "is a link, or no file") end
  local file, message = source.open(path)
  if not file then failure.raise_damaged(message) end
  local before = self.journal:entry(repetition, first - 1)
  local at, size = before and before.lines[name][1] or 0, file:seek "end"
  file:seek("set", at)
  for generation = first, last do
    local entry = self.journal:entry(repetition, generation)
    local ends = entry.lines[name][1]
    if ends > size then damaged(path, "has fewer bytes than journal.jsonl states") end
    local text = file:read(ends - at) or ""
    at = ends
    visit(text, entry, ("%s, line %d"):format(path, generation + 1))
  end
  file:close()
end

--- The lines of a growing file, of all generations that the journal names.
function Reader:lines(name, repetition)
  local list = {}
  each_line(self, name, repetition, 0, self:last(repetition), function(text, entry, where)
    list[#list + 1] = object_of(text, name, where, entry)
  end)
  return list
end

--- The line of one generation, without the fields that identify it.
function Reader:line(name, repetition, generation)
  local found
  each_line(self, name, repetition, generation, generation, function(text, entry, where)
    found = object_of(text, name, where, entry)
  end)
  found.schema = nil
  if name == "ledger" then found.repetition, found.generation = nil, nil end
  return found
end

--- Calls `visit(kind, place, part, entry)` for each file that the run should have: all but the
--- robots of generations that keep only the best one.
---@param visit fun(kind: string, place: string, part: any[], entry: table)
function Reader:each_file(visit)
  for _, r in ipairs(self:repetitions()) do
    for g = 0, self:last(r) do
      local entry = self.journal:entry(r, g)
      local gone = entry.recent and g <= self:last(r) - files.RECENT
      for kind, part in pairs(entry.files) do
        if not (gone and choice.contains(files.ARRAYS, kind)) then
          visit(kind, files.place(kind, r, g), part, entry)
        end
      end
    end
  end
end

-- The reason why a file of robots is missing; the end of a message.
local function why_missing(entry)
  return entry.recent and (": record.population = \"best\" keeps all robots of the newest %d"
    .. " generations only; \"all\" keeps them"):format(files.RECENT) or ""
end

--- Does the folder have all robots of a generation?
function Reader:has_robots(repetition, generation)
  local entry = self.journal:entry(repetition, generation)
  return entry ~= nil and (not entry.recent or generation > self:last(repetition) - files.RECENT)
end

local function mismatch(path)
  damaged(path, ("does not match its size and hash in %s"):format(journal.FILE))
end

--- What the journal states of a file of a generation: bytes, hash, and of an array those of a row.
---@return any[]
---@return string path
function Reader:part(kind, repetition, generation)
  self:settle()
  local path = ("%s/%s"):format(self.path, files.place(kind, repetition, generation))
  local entry = self.journal:entry(repetition, generation)
  local part = entry and entry.files[kind]
  if not part then
    failure.raise(1, ("%s is not kept%s"):format(path, entry and why_missing(entry)
      or ": the run has no such generation"))
  end
  if (source.size(path) or part[1]) ~= part[1] then
    damaged(path, ("has not the size that %s states"):format(journal.FILE))
  end
  return part, path
end

-- Ends the command: a file of a generation cannot be read.
local function unreadable(self, path, message, missing, repetition, generation)
  local entry = self.journal:entry(repetition, generation)
  if missing and entry.recent then
    failure.raise(1, ("%s is not kept%s"):format(path, why_missing(entry)))
  end
  failure.raise_damaged(message)
end

--- The bytes of a file of a generation.
---@return string
---@return string path
function Reader:file(kind, repetition, generation)
  local part, path = self:part(kind, repetition, generation)
  local text, message, missing = source.read_own(path)
  if not text then unreadable(self, path, message, missing, repetition, generation) end
  if #text ~= part[1] or host.xxh3(text, part[3]) ~= part[2] then mismatch(path) end
  return text, path
end

-- The names of the materials, in the order of a body's counts.
local function materials_of(self)
  local names = {}
  for k, material in ipairs(self.config.materials.materials or self.config.materials) do
    names[k] = material.name
  end
  return names
end

--- The bytes of a generation's robots.
function Reader:robots(repetition, generation)
  return (self:file("robots", repetition, generation))
end

--- The robots of a generation.
function Reader:rows(repetition, generation)
  local bytes, path = self:file("robots", repetition, generation)
  local all, message = rows_file.read(bytes, materials_of(self))
  if all and all.count ~= self.config.population then
    message = ("holds %d robots; the run has %d"):format(all.count, self.config.population)
    all = nil
  end
  if not all then damaged(path, message) end
  return all
end

-- As Reader:genomes, for folders from before hashes of arrays were sums: all genomes are read at
-- once.
local function genomes_at_once(self, repetition, generation, genes)
  local bytes, path = self:file("genomes", repetition, generation)
  local array, message = npy.decode(bytes)
  if not array then damaged(path, message) end
  local robots, width, at = array.shape[1], array.shape[2], 0
  if array.kind ~= "<f4" or robots ~= self.config.population or not width
    or width ~= (genes or width) then
    damaged(path, "does not hold the run's genomes")
  end
  width = width * ffi.sizeof "float"
  return function(count)
    at = at + count * width
    return array.data:sub(at - count * width + 1, at)
  end
end

--- Opens the genomes of a generation, whose hash is checked when the last one is read.
---@param genes? integer that each must have
---@return fun(count: integer): string bytes of the genomes of the next robots
function Reader:genomes(repetition, generation, genes)
  local part, path = self:part("genomes", repetition, generation)
  if not part[3] then return genomes_at_once(self, repetition, generation, genes) end
  local file, message, missing = parts.open(path, part)
  if not file then unreadable(self, path, message, missing, repetition, generation) end
  genes = genes or part[3] / ffi.sizeof "float"
  local header = npy.header("<f4", { self.config.population, genes })
  if part[1] ~= #header + self.config.population * genes * ffi.sizeof "float"
    or part[3] ~= genes * ffi.sizeof "float" or file:read(#header) ~= header then
    damaged(path, "does not hold the run's genomes")
  end
  return function(count)
    local bytes = file:read(count * part[3])
    if #bytes < count * part[3] or file.left == 0 and not file:close() then mismatch(path) end
    return bytes
  end
end

--- The genomes of some robots of a generation.
---@param wanted table<integer, any> keys are the robots' indices
---@param genes? integer that each must have
---@return table<integer, string>
function Reader:genomes_of(repetition, generation, wanted, genes)
  local read, found = self:genomes(repetition, generation, genes), {}
  for i = 1, self.config.population do
    local bytes = read(1)
    if wanted[i] ~= nil then found[i] = bytes end
  end
  return found
end

--- The values from which a run continues after a generation, besides its robots.
---@return table generation, metrics, ledger, evaluations, state
function Reader:kept(repetition, generation)
  local entry = self.journal:entry(repetition, generation)
  return { generation = generation, metrics = self:line("metrics", repetition, generation),
    ledger = self:line("ledger", repetition, generation), evaluations = entry.evaluations,
    state = entry.state, scores_valid = entry.scored_by == config.scored_by(self.config) }
end

return reader
