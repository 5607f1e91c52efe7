--- list.lua: `limax list [DIR]`: the runs in a folder with state, best and arm; with --robots the
--- best robots of a run.

local check = require "limax.run.check"
local failure = require "limax.base.failure"
local host = require "limax.host"
local output = require "limax.base.output"
local reader = require "limax.run.reader"
local robot_list = require "limax.tools.report.robot_list"
local runs = require "limax.tools.report.runs"
local source = require "limax.base.source"
local terminal = require "limax.base.terminal"

local command = {
  summary = "list runs with state, best and arm, or the best robots of a run",
  usage = "limax list [--check] [DIR] or limax list --robots RUN [N]",
  text = [[
Lists the run folders in DIR ("runs" if left out), up to three folders deep, which includes the runs
of a study. DIR may be a run folder itself. A run that cannot be read is listed as damaged, with the
reason on the standard error; the status is then still 0, with --check it is 1. Where a run has an
archive with cells, coverage and QD score are those of its repetition with the larger QD score.
Where a run was continued by --changed with fields that change what a score means, these are named
with the generation, and best is that of the generations since.

--robots lists the N best robots (10 if left out) of the last generations of all repetitions of a
run, which are always kept; better robots of earlier generations may be missing unless survival
keeps them, as the default "elitist" does. The generation is that of a robot's first appearance,
parents are ids, lengths are in m and s; with trials, distance and speed are those of the first
trial; the body has its extent and its number of voxels. limax picture RUN --robot ID draws one of
the repetition with the best champion.]],
  positional = { most = 1, name = "DIR" },
  exclusive = { { "check", "robots" } },
  options = {
    { name = "check", text = "read every file of each run, and name those that are damaged" },
    { name = "robots", argument = "RUN", text = "list the best robots of this run" },
  },
}

local MOST_ROBOTS = 10

-- The runs of a study are in NAME/ARM/rNN.
local DEPTH = 3

-- The run folders at `path` and below.
local function folders_below(path, depth, list)
  local has_part = host.file.exists(path .. "/config.json", true)
    or host.file.exists(path .. "/journal.jsonl", true)
  -- one of the two may be missing
  if has_part and (runs.is_folder(path) or host.file.exists(path .. "/r01") == "folder") then
    list[#list + 1] = path
    return list
  end
  for _, name in ipairs(depth > 0 and host.file.list(path) or {}) do
    local inner = path .. "/" .. name
    if host.file.exists(inner, true) == "folder" then folders_below(inner, depth - 1, list) end
  end
  return list
end

local function supervisor_name(config)
  local supervisor = config.supervisor
  if type(supervisor) ~= "table" then return supervisor end
  return supervisor.name or supervisor[1] or source.place(supervisor)
end

-- A row of the table, or nil and a message if the folder cannot be read.
local function row_of(path)
  local fine, folder = failure.attempt(runs.read, path)
  if not fine then return nil, failure.bare(folder) end
  local best, archive
  for _, run in ipairs(folder.runs) do
    for _, line in ipairs(runs.comparable(run)) do
      local score = runs.score(line)
      if score and (not best or score > best) then best = score end
    end
    local kept = run.lines[#run.lines].archive
    if kept and kept.qd_score and not (archive and archive.qd_score >= kept.qd_score) then
      archive = kept
    end
  end
  local config = folder.config
  return { terminal.word(path), folder.state, terminal.word(supervisor_name(config)),
    tostring(config.seed), #folder.runs, ("%d/%d"):format(runs.generations(folder)), best or "-",
    archive and archive.coverage or nil, archive and archive.qd_score or nil,
    changed = table.concat(runs.changed(folder.runs), "; ") }
end

-- A folder and its damage.
local function checked(path)
  local fine, folder = failure.attempt(reader.read, path)
  local found = folder
  if fine then fine, found = failure.attempt(check.folder, folder) end
  return folder, fine and check.text(found) or "  " .. failure.bare(found)
end

-- Prints the damage of each folder; returns status 1 if there is any.
local function verify(found)
  local damaged = 0
  for _, path in ipairs(found) do
    local folder, text = checked(path)
    if text ~= "" then
      damaged = damaged + 1
      output.write(("%s is damaged:\n%s\n"):format(terminal.word(path), text))
    else
      local generations = 0
      for _, r in ipairs(folder:repetitions()) do
        generations = generations + folder:last(r) + 1
      end
      output.write(("%s: %d generations, undamaged\n"):format(terminal.word(path), generations))
    end
  end
  if damaged == 0 then return 0 end
  output.warn(("limax: %d of %d run folders %s damaged\n"):format(damaged, #found,
    damaged == 1 and "is" or "are"))
  return 1
end

-- The number of robots to list.
local function count_of(word)
  local count = word and tonumber(word) or MOST_ROBOTS
  if word and not (word:find "^%d+$" and count >= 1) then
    failure.raise(2, ('limax list --robots RUN N: N is "%s"; expected a whole number from 1')
      :format(word))
  end
  return count
end

function command.run(arguments)
  if arguments.robots then
    local count = count_of(arguments[1])
    output.write(robot_list.text(runs.read(arguments.robots), count, terminal.style()), "\n")
    return 0
  end
  local path = arguments[1] or "runs"
  if host.file.exists(path) ~= "folder" then
    failure.raise(arguments[1] and 2 or 1, ("%s is not a folder%s"):format(path,
      arguments[1] and "" or ': no runs here yet; see "limax run --help"'))
  end
  local found = folders_below(#path > 1 and path:gsub("/+$", "") or path, DEPTH, {})
  if #found == 0 then failure.raise(1, ("there is no run folder in %s"):format(path)) end
  if arguments.check then return verify(found) end
  local lines, problems = {}, {}
  for k, each in ipairs(found) do
    local row, problem = row_of(each)
    lines[k] = row or { terminal.word(each), "damaged" }
    if problem then problems[#problems + 1] = ("limax: %s\n"):format(terminal.word(problem)) end
  end
  local columns = { "run", "state", "arm", "seed", "repetitions", "generations", "best" }
  for _, row in ipairs(lines) do
    if row[9] then columns[8], columns[9] = "coverage", "QD score" end
  end
  for _, row in ipairs(lines) do
    if (row.changed or "") ~= "" then columns.changed = #columns + 1 end
  end
  if columns.changed then
    columns[#columns + 1] = "changed"
    for _, row in ipairs(lines) do row[#columns] = row.changed end
  end
  output.write(terminal.table(columns, lines, terminal.style()), "\n")
  output.warn(table.concat(problems))
  return 0
end

return command
