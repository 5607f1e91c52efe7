--- runs.lua: what `limax compare` reads: each repetition of run folders and of the folders that a
--- study lists. All of them must be done.

local failure = require "limax.base.failure"
local folders = require "limax.tools.report.runs"

local runs = {}

---@class limax.compare.run : limax.report.run one repetition of a run

--- Everything that the comparison needs of these folders, repetition by repetition.
---@param list_of_folders limax.report.folder[]
---@return limax.compare.run[]
function runs.of(list_of_folders)
  local list = {}
  for _, folder in ipairs(list_of_folders) do
    if folder.state ~= "done" then
      failure.raise(2, ("%s is not done (%s); only complete runs are compared"):format(folder.path,
        folder.state))
    end
    for _, run in ipairs(folder.runs) do list[#list + 1] = run end
  end
  return list
end

--- The same of run folders and studies by their paths.
---@param words string[]
function runs.read(words) return runs.of(folders.read_all(words, true)) end

--- The best of a generation under the run's first materials; nil where the simulation of its
--- champion failed under them.
function runs.score(line) return line.best_standard end

return runs
