--- generation_files.lua: reads the files of one generation of a run: its robots, their genomes, the
--- state of the script, and what entered the archive.

local ffi = require "ffi"

local failure = require "limax.base.failure"
local npy = require "limax.base.npy"
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
---@param kind "population"|"genomes"|"champion"|"state"|"archive"
---@return string|nil
---@return string path
function Files:text(kind, repetition, generation)
  self:settle()
  local path = self.path .. "/" .. verify.place(kind, repetition, generation)
  local text, message, missing = source.read(path)
  if not text and not (missing and OPTIONAL[kind]) then failure.raise(1, message) end
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
---@return table<integer, ffi.cdata*> genomes float[genes]
function Files:robots(repetition, generation, indices, genes)
  local text, path = self:text("population", repetition, generation)
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
    genomes[index] = ffi.new("float[?]", genes)
    ffi.copy(genomes[index], file:read(size), size)
  end
  file:close()
  return records, genomes
end

return Files
