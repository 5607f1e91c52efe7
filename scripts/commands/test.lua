--- test.lua: `limax test`: runs suites of scripted regressions.

local engine = require "limax.engine"
local failure = require "limax.failure"
local host = require "limax.host"
local junit = require "limax.test.junit"
local lines = require "limax.test.lines"
local parallel = require "limax.test.parallel"
local report = require "limax.test.report"
local runner = require "limax.test.runner"
local terminal = require "limax.terminal"

local command = {
  summary = "run suites of scripted regressions",
  usage = "limax test [FILE|FOLDER ...] [options]",
  text = "Without a file or folder: the suites of limax's source tree. A folder stands for the\n"
    .. ".lua files that lie in it. Tests tagged full take minutes and run only with --tags=full.\n"
    .. "Exits 1 if a test failed or a suite did not load.",
  positional = { name = "FILE" },
  options = {
    { name = "filter", argument = "PATTERN",
      text = "only tests whose \"SUITE: TEST\" contains this, as it stands or as a Lua pattern" },
    { name = "tags", argument = "TAG,...",
      text = "only tests with one of these tags; --tags=-slow leaves out those tagged slow" },
    { name = "only", argument = "TITLE", many = true,
      text = "this \"SUITE: TEST\" alone; may come several times" },
    { name = "shuffle", argument = "SEED", kind = "integer", minimum = 0,
      text = "run in an order drawn from this number; 0 draws one and prints it" },
    { name = "jobs", short = "j", argument = "N", kind = "integer", minimum = 1, maximum = 1024,
      value = 1, text = "run the suites of so many files at a time, each in a process of its own" },
    { name = "update-golden", text = "record golden values that are new or differ, and show how" },
    { name = "reason", argument = "TEXT",
      text = "why they differ, kept in their files; asked for at a terminal" },
    { name = "list", text = "print the tests and run none" },
    { name = "tap", text = "print TAP version 13" },
    { name = "json", text = "print a line of JSON for each file and test" },
    { name = "junit", argument = "FILE", text = "also write JUnit's XML there" },
    { name = "quiet", short = "q", text = "print failures and the last line alone" },
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
    paths[1] = host.home .. "/tests/suites"
    if not host.file.exists(paths[1]) then
      failure.raise(2, ("limax's own suites are in its source tree and not in %s; name a file or "
        .. "folder of yours: limax test FILE.lua"):format(host.home))
    end
    paths[2] = paths[1] .. "/hard"
  end
  for _, path in ipairs(paths) do
    if not host.file.exists(path) then
      failure.raise(2, ("there is no file or folder %s"):format(path))
    end
  end
  return paths
end

local function choice_of(arguments)
  local choice = { filter = arguments.filter, tags = {}, only = arguments.only }
  for tag in (arguments.tags or ""):gmatch "[^,%s]+" do table.insert(choice.tags, tag) end
  if choice.filter and not pcall(string.find, "", choice.filter) then
    failure.raise(2, ("--filter: %q is no Lua pattern; %%( stands for a bracket"):format(
      choice.filter))
  end
  return choice
end

-- A number that the clock draws, small enough to be typed again.
local function drawn_seed() return 1 + math.floor(host.clock() * 1e6) % 999999 end

-- How goldens are recorded: with the reason given, else one asked for at a terminal.
local function update_of(arguments)
  if not arguments.update_golden then
    if arguments.reason then failure.raise(2, "--reason goes with --update-golden") end
    return nil
  end
  if arguments.jobs > 1 then
    failure.raise(2, "--update-golden looks at one golden after the other; leave out --jobs")
  end
  if arguments.reason == "" then failure.raise(2, "--reason is empty") end
  return {
    reason = arguments.reason,
    ask = function(text)
      if not host.terminal().stdin then return nil end
      io.stderr:write(text, "\nwhy does it change (nothing: it stays as it is)? ")
      return io.read "*l"
    end,
  }
end

local function reporter_of(arguments)
  local function write(text)
    io.stdout:write(text)
    io.stdout:flush()
  end
  if arguments.tap and arguments.json then
    failure.raise(2, "--tap and --json exclude each other")
  end
  local shown
  if arguments.tap then
    shown = report.tap(write)
  elseif arguments.json then
    shown = lines.reporter(write)
  else
    shown = report.plain(arguments.quiet, write, terminal.style())
  end
  return report.all { shown, arguments.junit and junit.reporter(arguments.junit) }
end

--- Runs the command.
---@param arguments table
---@return integer status 0 if nothing failed
function command.run(arguments)
  local paths, choice, update = paths_of(arguments), choice_of(arguments), update_of(arguments)
  local seed = arguments.shuffle
  if seed == 0 then seed = drawn_seed() end
  local files = {}
  for i, path in ipairs(runner.files(paths)) do files[i] = runner.load(path) end
  local plan = runner.plan(files, choice, seed)
  if arguments.list then return list(plan) end
  -- refuses what the environment says of threads before any test meets it
  engine.device("cpu"):free()

  if seed then io.stderr:write(("limax: --shuffle %d\n"):format(seed)) end
  local reporter = reporter_of(arguments)
  local counts
  if arguments.jobs > 1 then
    counts = parallel.run_all(plan, { jobs = arguments.jobs, choice = choice, seed = seed },
      reporter)
  else
    counts = runner.run_all(plan, update, reporter)
  end
  if counts.passed + counts.failed + counts.skipped == 0 then
    io.stderr:write "limax: no test was chosen\n"
    return 1
  end
  return counts.failed == 0 and 0 or 1
end

return command
