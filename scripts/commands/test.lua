--- test.lua: `limax test`: runs suites of scripted regressions.

local engine = require "limax.engine"
local failure = require "limax.failure"
local host = require "limax.host"
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
    { name = "update-golden", text = "record golden values that are new or differ, and say which" },
    { name = "list", text = "print the tests and run none" },
    { name = "tap", text = "print TAP version 13" },
    { name = "quiet", short = "q", text = "print failures and the last line alone" },
  },
}

local function list(files, choice)
  local broken = false
  for _, file in ipairs(files) do
    print(file.path)
    if file.failure then
      broken = true
      print("  does not load: " .. file.failure)
    end
    for _, instance in ipairs(file.instances) do
      if runner.chosen(instance, choice) then
        local tags = table.concat(instance.case.tags, ", ")
        print(("  %s: %s%s"):format(instance.suite, instance.label,
          tags ~= "" and (" (%s)"):format(tags) or ""))
      end
    end
  end
  return broken and 1 or 0
end

--- Runs the command.
---@param arguments table
---@return integer status 0 if nothing failed
function command.run(arguments)
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
  local choice = { filter = arguments.filter, tags = {} }
  for tag in (arguments.tags or ""):gmatch "[^,%s]+" do table.insert(choice.tags, tag) end
  if choice.filter and not pcall(string.find, "", choice.filter) then
    failure.raise(2, ("--filter: %q is no Lua pattern; %%( stands for a bracket"):format(
      choice.filter))
  end
  local files = {}
  for i, path in ipairs(runner.files(paths)) do files[i] = runner.load(path) end
  if arguments.list then return list(files, choice) end
  -- refuses what the environment says of threads before any test meets it
  engine.device("cpu"):free()

  local function write(text)
    io.stdout:write(text)
    io.stdout:flush()
  end
  local reporter = arguments.tap and report.tap(write)
    or report.plain(arguments.quiet, write, terminal.style())
  local counts = runner.run_all(files, choice, arguments.update_golden == true, reporter)
  if counts.passed + counts.failed + counts.skipped == 0 then
    io.stderr:write "limax: no test was chosen\n"
    return 1
  end
  return counts.failed == 0 and 0 or 1
end

return command
