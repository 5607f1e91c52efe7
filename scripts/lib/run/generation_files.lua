--- generation_files.lua: reads the files of one generation of a run: its robots, their genomes, the
--- state of the script, and what entered the archive. Of a run that keeps only the best robots it
--- removes the others when newer generations are complete.

local ffi = require "ffi"

local failure = require "limax.base.failure"
local host = require "limax.host"
local npy = require "limax.base.npy"
local population_file = require "limax.run.population_file"
local run_files = require "limax.settings.run_files"
local source = require "limax.base.source"
local verify = require "limax.run.verify"

--- What a run folder inherits (run_folder.lua).
---@class limax.generation_files
---@field path string of the run folder
local Files = {}

-- Files that only some runs have.
local OPTIONAL = { state = true, archive = true }

--- The text of a file that is complete; nil where the run wrote none.
---@param kind "genomes"|"champion"|"state"|"archive"
---@return string|nil
---@return string path
function Files:text(kind, repetition, generation)
  self:settle()
  local path = self.path .. "/" .. verify.place(kind, repetition, generation)
  local text, message, missing = source.read(path)
  if not text and not (missing and OPTIONAL[kind]) then
    failure.raise(1, missing and self:without(path, repetition, generation) or message)
  end
  return text, path
end

-- Why a file of robots is not there, where the run keeps only the best ones; else nil.
function Files:without(path, repetition, generation)
  return self.config.record_population == "best" and ("%s is not kept: record.population = \"best\""
    .. " keeps all robots of the newest %d generations only, and this reads those of generation %d"
    .. " of repetition %d; \"all\" or \"columns\" keeps them"):format(path, verify.RECENT,
    generation, repetition) or nil
end

--- Are all robots of a generation kept?
---@return boolean
function Files:has_robots(repetition, generation)
  local function there(kind)
    return host.file.exists(self.path .. "/" .. verify.place(kind, repetition, generation)) ~= nil
  end
  return there "columns" or there "population"
end

--- The lines of a generation's robots.
---@return string
---@return string path
function Files:lines_of(repetition, generation)
  self:settle()
  local text, path, message, missing = population_file.read(self.path, repetition, generation)
  if not text then
    failure.raise(1, missing and self:without(path, repetition, generation) or message)
  end
  return text, path
end

--- The genomes of a generation.
---@return string float32 [robot][gene]
function Files:genomes_of(repetition, generation)
  local bytes, path = self:text("genomes", repetition, generation)
  local array, message = npy.decode(bytes)
  if not array then failure.raise(1, ("%s: %s"):format(path, message)) end
  return array.data
end

--- Some robots of a generation: their lines in its population file, and their genomes.
---@param indices integer[]
---@param genes integer of a genome
---@return table<integer, table> records
---@return table<integer, string> genomes float32 [gene]
function Files:robots(repetition, generation, indices, genes)
  local text, path = self:lines_of(repetition, generation)
  local file = assert(io.open(self.path .. "/" .. verify.place("genomes", repetition, generation),
    "rb"))
  local size, wanted = genes * ffi.sizeof "float", {}
  for _, index in ipairs(indices) do wanted[index] = true end
  local records, genomes, count = {}, {}, 0
  for line in text:gmatch "[^\n]*\n" do
    count = count + 1
    if wanted[count] then records[count] = run_files.robots(line, path)[1] end
  end
  local first = file:seek "end" - count * size
  for _, index in ipairs(indices) do
    file:seek("set", first + (index - 1) * size)
    genomes[index] = file:read(size)
  end
  file:close()
  return records, genomes
end

--- Notes that all robots of a generation are kept only until it is no longer one of the newest.
function Files:note_recent(repetition, generation)
  self.recent[repetition] = self.recent[repetition] or {}
  self.recent[repetition][generation] = true
end

--- Removes the robots of such a generation, after the checkpoint of a later one.
function Files:remove_recent(repetition, generation)
  if not (self.recent[repetition] or {})[generation] then return end
  for _, kind in ipairs { "recent_columns", "recent_genomes" } do
    self.writer:remove(self.path .. "/" .. verify.place(kind, repetition, generation))
  end
  self.recent[repetition][generation] = nil
end

return Files
