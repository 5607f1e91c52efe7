--- runs.lua: what `limax compare` reads: each repetition of run folders and of the folders that a
--- study lists. All of them must be done.

local failure = require "limax.base.failure"
local folders = require "limax.tools.report.runs"

local runs = { STUDY = folders.STUDY }

---@class limax.compare.run : limax.report.run one repetition of a run
---@field arm string|nil its name in a study
---@field donor string|nil whose parameters it repeats: "parameters of random"

-- Whose parameters a run without a study repeats, by its ledger: "parameters of random".
local function donor_of(ledger)
  local line = ledger[2]
  local reads = line and (line.supervisor == "yoked" or line.supervisor == "shuffled"
    or line.supervisor == "constant_median")
  local name = reads and (line.reason or ""):match "repetition %d+ of .+ %(([%w_]+)%)"
  return name and "parameters of " .. name or nil
end

--- Everything that the comparison needs of these folders, repetition by repetition.
---@param words string[] run folders and studies
---@return limax.compare.run[]
function runs.read(words)
  local list = {}
  for _, folder in ipairs(folders.read_all(words, true)) do
    if folder.status.state ~= "done" then
      failure.raise(2, ("%s is not done (%s); only complete runs are compared"):format(folder.path,
        folder.status.state))
    end
    for _, run in ipairs(folder.runs) do
      run.donor = run.donor or donor_of(run.ledger)
      list[#list + 1] = run
    end
  end
  return list
end

--- The best of a generation under the run's first materials; nil where the simulation of its
--- champion failed under them.
---@param line table of metrics.jsonl
---@return number|nil
function runs.score(line) return line.best_standard end

--- The champion of the last generation: a robot file.
function runs.champion(run) return folders.champion(run, run.lines[#run.lines]) end

return runs
