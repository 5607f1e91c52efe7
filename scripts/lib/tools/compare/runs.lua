--- runs.lua: what `limax compare` reads: each repetition of run folders and of the folders that a
--- study lists. All of them must be done.

local arms = require "limax.tools.report.arms"
local failure = require "limax.base.failure"
local folders = require "limax.tools.report.runs"

local runs = {}

---@class limax.compare.run : limax.report.run one repetition of a run
---@field arm string|nil its name in a study
---@field donor string|nil whose parameters it repeats: "parameters of random"

--- Everything that the comparison needs of these folders, repetition by repetition.
---@param words string[] run folders and studies
function runs.read(words)
  local list = {}
  for _, folder in ipairs(folders.read_all(words, true)) do
    if folder.status.state ~= "done" then
      failure.raise(2, ("%s is not done (%s); only complete runs are compared"):format(folder.path,
        folder.status.state))
    end
    for _, run in ipairs(folder.runs) do
      -- without a study the ledger names the supervisor whose parameters a run repeats
      local line = run.ledger[2] or {}
      local donor = arms.REPEATS[line.supervisor]
        and (line.reason or ""):match "repetition %d+ of .+ %(([%w_]+)%)"
      run.donor = run.donor or donor and "parameters of " .. donor or nil
      list[#list + 1] = run
    end
  end
  return list
end

--- The best of a generation under the run's first materials; nil where the simulation of its
--- champion failed under them.
function runs.score(line) return line.best_standard end

return runs
