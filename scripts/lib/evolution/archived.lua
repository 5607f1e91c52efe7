--- archived.lua: the archive of one repetition: its rows, what is needed to breed from them, and
--- its files. A generation's file has the rows that entered; replaying all of them gives the
--- archive. Genomes are copied from memory, and after a resume from the population files.

local columns = require "limax.robot.columns"
local engine = require "limax.engine"
local host = require "limax.host"
local run_files = require "limax.settings.run_files"
local source = require "limax.base.source"
local view = require "limax.engine.view"

---@class limax.archived
---@field rows limax.archive.row[]
---@field entered limax.archive.row[] of the newest generation
local Archive = {}
Archive.__index = Archive

local archived = {}

-- draws for a child have its index; no population is as large
local INDIVIDUAL = 2 ^ 32 - 1

--- Makes an empty archive.
---@param definition limax.archive.definition
---@param seed number|string
---@param repetition integer
---@return limax.archived
function archived.new(definition, seed, repetition)
  return setmetatable({ definition = definition, seed = seed, repetition = repetition, rows = {},
    place = {}, entered = {}, kept = setmetatable({}, { __mode = "k" }) }, Archive)
end

-- Takes rows in and ids out.
local function apply(self, entered, leaving)
  local rows, place = self.rows, self.place
  if leaving then
    local count = 0
    for k = 1, #rows do
      local row = rows[k]
      rows[k] = nil
      if not leaving[row.id] then
        count = count + 1
        rows[count] = row
      end
    end
  end
  for _, row in ipairs(entered) do
    local at = row.cell and place[row.cell] or #rows + 1
    rows[at] = row
    if row.cell then place[row.cell] = at end
  end
end

-- The rows before this generation: a population may be scored again, by another fitness.
local function rewind(self, generation)
  local rows = self.rows
  if self.generation == generation then
    for k = #rows, 1, -1 do rows[k] = nil end
    self.place = {}
    apply(self, self.before)
  else
    self.generation, self.before = generation, {}
    for k, row in ipairs(rows) do self.before[k] = row end
  end
end

--- Offers the new robots of a scored generation. Where each island has its own cells, those that
--- came from another one are new too: none else is older.
---@param robots limax.population.scored
function Archive:update(robots)
  rewind(self, robots.generation)
  local definition = self.definition
  if definition.appraise then definition.appraise(robots.records, self.rows) end
  local candidates = {}
  for i, record in ipairs(robots.records) do
    if record.fitness and (definition.islands or record.generation == robots.generation) then
      candidates[#candidates + 1] = { id = record.id, generation = robots.generation, index = i,
        island = definition.islands and record.island, fitness = record.fitness,
        descriptors = record.descriptors,
        objectives = record.objectives, novelty = record.novelty }
    end
  end
  local random =
    engine.random(self.seed, self.repetition, "selection", robots.generation, INDIVIDUAL)
  local entered, leaving = definition.choose(self.rows, self.place, candidates, random)
  apply(self, entered, leaving)
  self.entered = entered
  for _, row in ipairs(entered) do
    self.kept[row] = { record = columns.plain(robots.records[row.index]),
      genome = view.memory(robots.engine:genome_copy(row.index)) }
  end
end

--- Copies of the rows, for scripts, which may change them and name them as parents.
---@return limax.archive.row[]
function Archive:list()
  local list = source.copy(self.rows)
  for k, row in ipairs(self.rows) do self.kept[list[k]] = self.kept[row] end
  return list
end

--- What metrics.jsonl has of it.
---@return table
function Archive:measure()
  local rows, best = self.rows, nil
  local line = self.definition.measure and self.definition.measure(rows) or {}
  for _, row in ipairs(rows) do best = math.max(best or row.fitness, row.fitness) end
  line.filled, line.best = #rows, best
  return line
end

--- The lines of the newest generation's file.
---@return string
function Archive:text()
  local lines = {}
  for k, row in ipairs(self.entered) do
    lines[k] = host.json.encode { schema = "limax.archive/1", id = row.id, index = row.index,
      fitness = row.fitness, descriptors = row.descriptors, objectives = row.objectives,
      cell = row.cell, island = row.island, novelty = row.novelty }
      .. "\n"
  end
  return table.concat(lines)
end

--- The record of a row; nil for a table that is no row of this archive.
---@param row any
---@return table|nil
function Archive:record(row) return self.kept[row] and self.kept[row].record end

--- The genome of a row.
---@param row limax.archive.row
---@return ffi.cdata*|string float[genes]
function Archive:genome(row) return self.kept[row].genome end

--- Replays the file of a generation.
---@param text string of the file
---@param path string its name
function Archive:replay(generation, text, path)
  local rows = run_files.archive(text, path)
  for _, row in ipairs(rows) do
    row.schema, row.generation = nil, generation
  end
  apply(self, self.definition.choose(self.rows, self.place, rows))
end

--- Replays the files of a folder up to a generation.
---@param folder limax.run_folder
---@param last integer
---@param genes integer of a genome
function Archive:restore(folder, last, genes)
  for generation = 0, last do
    local text, path = folder:text("archive", self.repetition, generation)
    self:replay(generation, text or "", path)
  end
  self.generation, self.before = last, {}
  local by_generation = {}
  for _, row in ipairs(self.rows) do
    by_generation[row.generation] = by_generation[row.generation] or {}
    table.insert(by_generation[row.generation], row)
  end
  for generation, rows in pairs(by_generation) do
    local indices = {}
    for k, row in ipairs(rows) do indices[k] = row.index end
    local records, genomes = folder:robots(self.repetition, generation, indices, genes)
    for _, row in ipairs(rows) do
      self.kept[row] = { record = records[row.index], genome = genomes[row.index] }
    end
  end
end

return archived
