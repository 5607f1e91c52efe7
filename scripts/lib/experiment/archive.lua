--- archive.lua: the library of archives: robots that a run remembers beyond their generation. After
--- each generation its new robots that have a score are offered to the archive; its rows are plain
--- tables, `population.archive[i].id .generation .index .fitness .descriptors .cell`, and may be
--- parents.

local choice = require "limax.base.choice"
local cells = require "limax.experiment.archives.cells"
local engine = require "limax.engine"
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

---@class limax.archive.definition
---@field name string
---@field descriptors? limax.measure[]
---@field objectives? limax.measure[]
---@field choose fun(rows: limax.archive.row[], place: table<integer, integer>, candidates:
--- limax.archive.row[], random: limax.random|nil): limax.archive.row[], table<integer, boolean>|nil
--- the candidates that enter, and the ids that leave; `place` has the row of each cell. Of rows
--- that entered before (random is nil) all enter again.
---@field measure fun(rows: limax.archive.row[]): table what metrics.jsonl has of it

---@class limax.archive.entry: limax.choice.entry
---@field make fun(options: table): limax.archive.definition

--- Options of each archive, by its name.
---@type table<string, limax.archive.entry>
archive.entries = {}

--- What descriptors and objectives may be called: fitness, voxels, voxel_share, muscle_share, mass,
--- length, distance, speed, path_length, height, contact, energy and strain, each with its unit.
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

--- The archive that an experiment names: a name, or { name, option = value }.
---@param spec string|table
---@return limax.archive.definition
function archive.get(spec)
  local name, options = choice.read("archive", spec, archive.entries)
  local definition = archive.entries[name].make(options)
  if type(definition) == "string" then engine.fail(("archive %q: %s"):format(name, definition)) end
  definition.name = name
  return definition
end

return strict.close("limax.archive", archive)
