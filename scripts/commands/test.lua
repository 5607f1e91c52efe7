--- test.lua: `limax test`: runs suites of tests.

local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local processes = require "limax.tools.test.processes"
local report = require "limax.tools.test.report"
local runner = require "limax.tools.test.runner"
local terminal = require "limax.base.terminal"

local command = {
  summary = "run suites of tests",
  usage = "limax test [FILE|FOLDER ...] [options]",
  text = "Without a file or folder: the suites of limax's source tree. Of a folder: its .lua\n"
    .. "files. Tests tagged full take minutes and run only with --tags=full. Each file runs in\n"
    .. "its own process: a test that crashes, or loops beyond its limit, is ended and fails, and\n"
    .. "those after it run. Exits 1 if a test failed or a suite did not load.",
  positional = { name = "FILE" },
  exclusive = { { "json", "json-seq" } },
  options = {
    { name = "filter", argument = "PATTERN",
      text = "only tests whose \"SUITE: TEST\" contains this, literally or as a Lua pattern" },
    { name = "tags", argument = "TAG,...",
      text = "only tests with one of these tags; --tags=-slow excludes those tagged slow" },
    { name = "only", argument = "TITLE", many = true,
      text = "only this \"SUITE: TEST\"; may be repeated" },
    { name = "jobs", short = "j", argument = "N", kind = "integer", minimum = 1, maximum = 1024,
      value = 1, text = "files to run at a time" },
    { name = "limit", argument = "S", kind = "number", minimum = 0.001,
      text = "seconds that a test may take if it sets no limit" },
    { name = "one-process", text = "run in this process, for a debugger: a limit ends no "
      .. "test" },
    { name = "update-golden", text = "record golden values that are new or differ, and show how" },
    { name = "reason", argument = "TEXT", text = "why they differ, stored in their files" },
    { name = "list", text = "print the tests and run none" },
    { name = "json", text = "print a line of JSON for each file and test" },
    { name = "json-seq", text = "the same from this process, a record separator before each "
      .. "(RFC 7464)" },
    { name = "quiet", short = "q", text = "print only failures and the last line" },
  },
}

local function list(plan)
  local broken = false
  for _, entry in ipairs(plan.files) do
    print(entry.file.path)
    if entry.file.failure then
      broken = true
      print("  does not load: " .. entry.file.failure)
    end
    for _, instance in ipairs(entry.instances) do
      local tags = table.concat(instance.case.tags, ", ")
      print(("  %s%s"):format(runner.title(instance),
        tags ~= "" and (" (%s)"):format(tags) or ""))
    end
  end
  return broken and 1 or 0
end

local function paths_of(arguments)
  local paths = { unpack(arguments) }
  if #paths == 0 then
    local suites = host.home .. "/tests/suites"
    if not host.file.exists(suites) then
      failure.raise(2, ("limax's own suites are in its source tree, not in %s; name a file or "
        .. "folder: limax test FILE.lua"):format(host.home))
    end
    for _, room in ipairs(host.file.list(suites)) do
      -- a folder of another version may be left there, empty
      local folder = suites .. "/" .. room
      if #host.file.list(folder) > 0 then paths[#paths + 1] = folder end
    end
  end
  for _, path in ipairs(paths) do
    if not host.file.exists(path) then
      failure.raise(2, ("there is no file or folder %s"):format(path))
    end
  end
  return paths
end

local function choice_of(arguments)
  local choice = { filter = arguments.filter, tags = {}, only = arguments.only,
    limit = arguments.limit }
  for tag in (arguments.tags or ""):gmatch "[^,%s]+" do table.insert(choice.tags, tag) end
  if choice.filter and not pcall(string.find, "", choice.filter) then
    failure.raise(2, ("--filter: %q is not a Lua pattern; %%( matches a bracket"):format(
      choice.filter))
  end
  return choice
end

-- How goldens are recorded.
local function update_of(arguments)
  if not arguments.update_golden then
    if arguments.reason then failure.raise(2, "--reason goes with --update-golden") end
    return nil
  end
  return { reason = arguments.reason }
end

-- Refuses several jobs if one process runs all tests.
local function check_jobs(arguments)
  for _, name in ipairs { "json_seq", "one_process", "update_golden" } do
    if arguments[name] and arguments.jobs > 1 then
      failure.raise(2, ("--%s and --jobs exclude each other"):format((name:gsub("_", "-"))))
    end
  end
end

-- The reporter, and a function that prints what tests print themselves: on standard error if the
-- results are for programs.
local function reporter_of(arguments)
  local within_line = false
  local function write(text)
    if within_line then text = "\n" .. text end
    within_line = false
    io.stdout:write(text)
    io.stdout:flush()
  end
  local function echo(text, is_error)
    local stream = (is_error or arguments.json) and io.stderr or io.stdout
    stream:write(text)
    stream:flush()
    if stream == io.stdout then within_line = text:sub(-1) ~= "\n" end
  end
  local shown
  if arguments.json or arguments.json_seq then
    shown = report.json(write, arguments.json_seq and processes.SEPARATOR or "")
  else
    shown = report.plain(arguments.quiet, write, terminal.style())
  end
  return shown, echo
end

--- Runs the command.
---@return integer status 0 if nothing failed
function command.run(arguments)
  local paths, choice, update = paths_of(arguments), choice_of(arguments), update_of(arguments)
  check_jobs(arguments)
  local files = {}
  for i, path in ipairs(runner.files(paths)) do files[i] = runner.load(path) end
  local plan = runner.plan(files, choice)
  if arguments.list then return list(plan) end
  -- fails early if the environment's number of threads is invalid
  engine.device("cpu"):free()

  local reporter, echo = reporter_of(arguments)
  local counts = { event = "end", passed = 0, failed = 0, skipped = 0 }
  local function take(event)
    local status = event.event == "file" and event.failure and "failed" or event.status
    if status then counts[status] = counts[status] + 1 end
    reporter(event)
  end
  take { event = "begin", total = plan.total }
  if update or arguments.one_process or arguments.json_seq then
    runner.run_all(plan, update, take)
  else
    processes.run_all(plan, { jobs = arguments.jobs, choice = choice, echo = echo }, take)
  end
  take(counts)
  if counts.passed + counts.failed + counts.skipped == 0 then
    io.stderr:write "limax: no test was chosen\n"
    return 1
  end
  return counts.failed == 0 and 0 or 1
end

return command
