--- archived.lua: the archive of one repetition as a list that each generation inherits and extends.
--- A robot's row says whether it entered and where (`entered`, `cell`): replaying the robots of all
--- generations gives the archive. On several ranks of mpirun each has all rows of the list, and the
--- genomes of the robots that it bred.

local ffi = require "ffi"

local division = require "limax.evolution.division"
local engine = require "limax.engine"
local rows = require "limax.robot.rows"
local rows_file = require "limax.robot.rows_file"
local source = require "limax.base.source"

---@class limax.archived
---@field rows limax.archive.row[] each with its robot, and its genome or the rank that has it
---@field place table<integer, integer> of the row of each cell
---@field members table<limax.archive.row, integer> their places in the list
---@field ranges number[][] { least, most } of each descriptor over all scored robots

local archived = {}

-- index of the archive's random numbers; those of a child have its index, and no population is so
-- large
local INDIVIDUAL = 2 ^ 32 - 1

-- The keys under which a row has the row of its robot, the rank that has its genome, from 1, and
-- there the genome, float[genes]; and a copy for scripts the row that it shows.
local ROBOT, RANK, GENOME, SHOWN = {}, {}, {}, {}

-- Makes the archive after robots entered and ids left.
local function changed(before, entered, leaving, ranges)
  local list, place, members = {}, {}, {}
  for _, row in ipairs(before and before.rows or {}) do
    if not (leaving and leaving[row.id]) then
      list[#list + 1] = row
      members[row] = #list
      if row.cell then place[row.cell] = #list end
    end
  end
  for _, row in ipairs(entered) do
    local at = row.cell and place[row.cell] or #list + 1
    if list[at] then members[list[at]] = nil end
    list[at], members[row] = row, at
    if row.cell then place[row.cell] = at end
  end
  return { rows = list, place = place, members = members, ranges = ranges }
end

-- The ranges of the descriptors with those of more robots.
local function ranges_with(ranges, robots)
  local wider = source.copy(ranges)
  for _, row in ipairs(robots) do
    for k, value in ipairs(row.fitness and row.descriptors or {}) do
      local range = wider[k] or { value, value }
      wider[k] = { math.min(range[1], value), math.max(range[2], value) }
    end
  end
  return wider
end

-- Makes the row of robot i of a generation.
local function row_of(definition, row, generation, i)
  return { id = row.id, generation = generation, index = i,
    island = definition.islands and row.island or nil, fitness = row.fitness,
    descriptors = row.descriptors, objectives = row.objectives, novelty = row.novelty }
end

--- Offers the new robots of a scored generation. If each island has its own cells, robots that came
--- from another island are new too.
---@param before limax.archived|nil that of the generation before
---@param robots limax.population.scored whose rows get `novelty`, `entered` and `cell`
function archived.enter(before, robots)
  local definition, world = robots.world.archive, robots.world
  before = before or changed(nil, {}, nil, {})
  if definition.appraise then definition.appraise(robots.rows, before.rows) end
  local candidates = {}
  for i, row in ipairs(robots.rows) do
    -- ids count on with each generation
    local is_new = row.id > robots.generation * #robots
    if row.fitness and (definition.islands or is_new) then
      candidates[#candidates + 1] = row_of(definition, row, robots.generation, i)
    end
    row.entered, row.cell = nil, nil
  end
  local random = engine.random(world.config.seed, robots.repetition, "selection",
    robots.generation, INDIVIDUAL)
  local entered, leaving = definition.choose(before.rows, before.place, candidates, random)
  local list = {}
  for k, row in ipairs(entered) do
    list[k] = row.index
    robots.rows[row.index].entered, robots.rows[row.index].cell = k, row.cell
  end
  if robots.rows.brief then rows.outline(robots.rows) end -- novelty
  division.lend(robots, list)
  for _, row in ipairs(entered) do
    row[ROBOT] = rows.single(robots.rows[row.index])
    row[GENOME], row[RANK] = division.genome(robots, row.index)
  end
  return changed(before, entered, leaving, ranges_with(before.ranges, robots.rows))
end

--- Adds the robots of a recorded generation that entered the archive.
function archived.replay(before, definition, generation, robots)
  local list = {}
  before = before or changed(nil, {}, nil, {})
  for i, robot in ipairs(robots) do
    if robot.entered then
      local row = row_of(definition, robot, generation, i)
      row.cell = robot.cell
      list[#list + 1] = { at = robot.entered, row = row }
    end
  end
  table.sort(list, function(a, b) return a.at < b.at end)
  for k, each in ipairs(list) do list[k] = each.row end
  local entered, leaving = definition.choose(before.rows, before.place, list)
  return changed(before, entered, leaving, ranges_with(before.ranges, robots))
end

--- Gives a row its robot.
function archived.complete(row, robot) row[ROBOT] = robot end

--- Copies of the rows for scripts, which may change them and name them as parents.
function archived.shown(self)
  local list = {}
  for k, row in ipairs(self.rows) do
    local copy = {}
    for name, value in pairs(row) do
      if type(name) == "string" then copy[name] = source.copy(value) end
    end
    copy[SHOWN] = row
    list[k] = copy
  end
  return list
end

--- The numbers of an archive for metrics.jsonl.
function archived.measure(self, definition)
  local line, best = definition.measure and definition.measure(self.rows) or {}, nil
  for _, row in ipairs(self.rows) do best = math.max(best or row.fitness, row.fitness) end
  line.filled, line.best = #self.rows, best
  return line
end

--- Notes about cells that no robot reached.
---@param self limax.archived
---@param definition limax.archive.definition
---@return string[]
function archived.notes(self, definition)
  return definition.notes and definition.notes(self.rows, self.ranges) or {}
end

--- The robot of a row that a script names as a parent; nil for a table that is not a row of this
--- archive.
function archived.robot(self, shown)
  local row = type(shown) == "table" and rawget(shown, SHOWN)
  return row and self.members[row] and row[ROBOT] or nil
end

--- The rank that has the genome of such a row, from 1, and the row's place in the list.
function archived.rank(shown) return shown[SHOWN][RANK] end
function archived.place(self, shown) return self.members[shown[SHOWN]] end

--- The genome of a row that this rank has.
---@param place integer in the list
---@return ffi.cdata* float[genes]
function archived.genome(self, place) return self.rows[place][GENOME] end

--- An archive as plain data, without genomes.
function archived.pack(self)
  local list = {}
  for k, row in ipairs(self.rows) do
    local plain = {}
    for name, value in pairs(row) do
      if type(name) == "string" then plain[name] = value end
    end
    list[k] = { row = plain, robot = rows_file.pack(row[ROBOT][1]) }
  end
  return { rows = list, ranges = self.ranges }
end

--- The archive of such data, whose genomes are divided among the ranks in equal parts.
---@param materials string[] their names
---@param genes integer of each
---@param read (fun(count: integer): string)|nil genomes of the next rows, on the first rank
function archived.unpack(packed, materials, genes, read)
  local entered, share = {}, division.share(#packed.rows, 0)
  for k, each in ipairs(packed.rows) do
    entered[k] = each.row
    archived.complete(each.row, assert(rows_file.read(each.robot, materials))[1])
    each.row[RANK] = division.owner(share, k)
  end
  division.deal(share, genes, read, function(memory, first, count)
    for k = first + 1, first + count do
      local genome = ffi.new("float[?]", genes)
      ffi.copy(genome, memory + (k - first - 1) * genes, genes * ffi.sizeof "float")
      entered[share:number(k)][GENOME] = genome
    end
  end)
  return changed(nil, entered, nil, packed.ranges)
end

return archived
