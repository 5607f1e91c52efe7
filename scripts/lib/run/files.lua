--- files.lua: where a run folder has its files.

local files = {}

--- The files of a generation, by repetition and generation; the matrix B of the encoding comes with
--- generation 0.
files.PLACES = { robots = "r%02d/robots/g%04d.npy", genomes = "r%02d/genomes/g%04d.npy",
  champion = "r%02d/champions/g%04d.json", matrix = "r%02d/B.npy" }

--- The files that grow by a line for each generation of a repetition.
files.GROWING = { "metrics", "ledger", "timing" }

--- The files with a row for each robot. A run that keeps only the best robots has these of so many
--- newest generations: those that a run that goes on reads.
files.ARRAYS, files.RECENT = { "robots", "genomes" }, 3

--- The path of a file of a generation below the run folder.
---@param kind "robots"|"genomes"|"champion"|"matrix"
function files.place(kind, repetition, generation)
  return files.PLACES[kind]:format(repetition, generation)
end

--- The path of a growing file.
---@param name "metrics"|"ledger"|"timing"
function files.growing(name, repetition) return ("r%02d/%s.jsonl"):format(repetition, name) end

return files
