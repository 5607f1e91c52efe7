--- archive.lua: the library of archives: robots that a run remembers beyond their generation. After
--- each generation its new robots that have a score are offered to the archive; its rows are plain
--- tables, `population.archive[i].id .generation .index .fitness .descriptors .cell`, and may be
--- parents.

local choice = require "limax.base.choice"
local cells = require "limax.experiment.archives.cells"
local centres = require "limax.experiment.archives.centres"
local engine = require "limax.engine"
local novelty = require "limax.experiment.archives.novelty"
local pareto = require "limax.experiment.archives.pareto"
local measures = require "limax.experiment.measures"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"

local archive = strict.module "limax.archive"

---@class limax.archive.row a robot of an archive
---@field id integer number in its run
---@field generation integer that it was new in
---@field index integer its place in that generation
---@field fitness number its score when it entered
---@field descriptors? number[] in the order of the archive's descriptors
---@field objectives? number[] in the order of the objectives
---@field cell? integer of a grid or CVT archive, from 1
---@field island? integer of which it is the best in its cell, with "map_elites" and islands
---@field novelty? number of a novelty archive, when it entered

---@class limax.archive.definition
---@field name string
---@field descriptors? limax.measure[]
---@field objectives? limax.measure[]
---@field choose fun(rows: limax.archive.row[], place: table<integer, integer>, candidates:
--- limax.archive.row[], random: limax.random|nil): limax.archive.row[], table<integer, boolean>|nil
--- the candidates that enter, and the ids that leave; `place` has the row of each cell. Rows that
--- entered before (random is nil) all enter again.
---@field measure? fun(rows: limax.archive.row[]): table more than its size and best fitness, for
--- metrics.jsonl
---@field appraise? fun(robots: limax.row[], rows: limax.archive.row[]) adds to the robots of a
--- scored generation, before any of them enters
---@field reference? number[] of the objectives
---@field islands? integer their number, where each has its own cells
---@field axes? { least: number, most: number, cells: integer, stride: integer }[] of a grid

---@class limax.archive.entry: limax.choice.entry
---@field make fun(options: table): limax.archive.definition

--- Options of each archive, by its name.
---@type table<string, limax.archive.entry>
archive.entries = {}

--- The names of descriptors and objectives, each with its unit: fitness, voxels, voxel_share,
--- muscle_share, mass, length, distance, speed, path_length, height, contact, energy and strain.
archive.measures = measures.entries

local qd_offset = schema.number { value = 0, unit = "of the fitness",
  note = "is subtracted from every fitness in the QD score" }

--- grid: each descriptor's range is divided into cells of equal size; a cell keeps its best robot.
--- A value out of the range belongs to the nearest cell. As GridArchive of pyribs.
archive.entries.grid = {
  options = {
    descriptors = measures.rule { most = 8, range = true },
    cells = schema.number { value = 10, unit = "cells along a descriptor", minimum = 1,
      maximum = 1e6, integer = true, note = "a descriptor may have its own number" },
    qd_offset = qd_offset,
  },
  make = cells.grid,
}

-- Limits of a tessellation.
local MOST_DIMENSIONS = 16
local cvt_cells = { unit = "cells", minimum = 1, maximum = 1e5, integer = true,
  note = "1000 as in the paper's first experiments" }
local cvt_samples = schema.number { unit = "random points", minimum = 1, maximum = 1e7,
  integer = true, note = "if left out 20 for each cell, but no more than 1e5, or three for each" }

--- cvt: cells around evenly spread centres (Lloyd's algorithm), as many as named whatever the
--- number of descriptors is; a cell keeps its best robot. Vassiliades et al., "Using centroidal
--- Voronoi tessellations to scale up MAP-Elites", 2018.
archive.entries.cvt = {
  options = {
    descriptors = measures.rule { most = MOST_DIMENSIONS, range = true },
    cells = schema.number(cvt_cells, 1000),
    samples = cvt_samples,
    qd_offset = qd_offset,
  },
  make = cells.cvt,
}

--- novelty: an archive without cells. `robot.novelty` is the mean distance to the k nearest
--- neighbours in archive and population, in descriptors of which a range counts as 1. In each
--- generation `add` robots enter at random, or those of at least the novelty `threshold`; beyond
--- `capacity` the oldest leave. Lehman and Stanley, "Abandoning objectives", 2011.
archive.entries.novelty = {
  options = {
    descriptors = measures.rule { most = 16 },
    k = schema.number { value = 15, unit = "neighbours", minimum = 1, maximum = 1000,
      integer = true, note = "usual" },
    add = schema.number { unit = "robots in a generation", minimum = 0, maximum = 1e6,
      integer = true, note = "6 if neither is named" },
    threshold = schema.number { unit = "distance", minimum = 0 },
    capacity = schema.number { value = 10000, unit = "robots", minimum = 1, maximum = 1e6,
      integer = true, note = "with 4096 robots novelty then takes some 0.1 s" },
  },
  make = novelty,
}

--- pareto: the robots that no other robot of the run dominates in all objectives; beyond `capacity`
--- those leave whose neighbours are nearest (crowding distance of NSGA-II). With a `reference`
--- point, in the objectives' own units, metrics.jsonl has the hypervolume of two or three.
archive.entries.pareto = {
  options = {
    objectives = measures.rule { least = 2, most = 8, objective = true },
    capacity = schema.number { value = 1000, unit = "robots", minimum = 1, maximum = 1e6,
      integer = true, note = "more than a front of two objectives usually has" },
    reference = schema.list(schema.number {}, { expected = "a list of numbers" }),
  },
  make = pareto,
}

--- The centres of a CVT archive's cells, in the unit cube of its ranges.
---@param cell_count integer
---@param dimensions integer its descriptors
---@param samples? integer as the option of that name
---@return number[][] [cell][dimension]
function archive.centres(cell_count, dimensions, samples)
  local what = "limax.archive.centres"
  schema.demand(schema.number(cvt_cells), cell_count, what .. ": cell_count")
  schema.demand(schema.whole(1, MOST_DIMENSIONS), dimensions, what .. ": dimensions")
  if samples ~= nil then schema.demand(cvt_samples, samples, what .. ": samples") end
  local refusal = centres.refusal(cell_count, dimensions, samples)
  if refusal then engine.fail(("%s: %s"):format(what, refusal)) end
  return centres.of(cell_count, dimensions, samples)
end

--- The archive that an experiment names: a name, or { name, option = value }.
---@param spec string|table
---@return limax.archive.definition
function archive.get(spec)
  if type(spec) == "function" then
    engine.fail('archive: expected a name or { "name", option = value }, got a function; a function'
      .. " may be a descriptor")
  end
  local name, options = choice.read("archive", spec, archive.entries)
  local definition = archive.entries[name].make(options)
  if type(definition) == "string" then engine.fail(("archive %q: %s"):format(name, definition)) end
  definition.name = name
  return definition
end

return strict.close("limax.archive", archive)
