--- main.lua: the command line. `limax NAME ...` runs scripts/commands/NAME.lua, and
--- `limax FILE.lua ...` a script.

local exchange = require "limax.base.exchange"
local failure = require "limax.base.failure"
local host = require "limax.host"
local options = require "limax.base.options"
local output = require "limax.base.output"
local suggest = require "limax.engine.suggest"

local main = {}

local exit_failed, exit_usage = 1, 2

-- names of the commands: the files of scripts/commands, sorted
local function command_names()
  local names = {}
  for _, file in ipairs(host.file.list(host.home .. "/scripts/commands") or {}) do
    names[#names + 1] = file:match "^(%l[%l%d_]*)%.lua$"
  end
  return names
end

local function load_command(name)
  local command = require("limax.commands." .. name)
  command.name = name
  return command
end

local function version()
  local commit = host.commit and ", commit " .. host.commit or ""
  output.write(("limax %s%s (%s)\n"):format(host.version, commit, jit.version))
end

local function overview()
  local rows = {}
  for i, name in ipairs(command_names()) do
    rows[i] = { name, load_command(name).summary }
  end
  return table.concat {
    "usage: limax NAME [arguments]   run a command\n",
    "       limax FILE.lua [words]   run a script, as by `limax run` if it returns an experiment\n",
    "       limax NAME --help        what a command takes\n",
    "       limax --version\n\n",
    "commands:\n",
    options.columns(rows),
  }
end

-- Runs a command, or prints its help.
local function call(command, arguments, action)
  if not arguments.help then return action() end
  output.write(options.help(command))
  return nil
end

-- a script, and the experiment that it may return
local function run_script(argv)
  local value = require("limax.base.script").run(unpack(argv))
  local experiments = package.loaded["limax.experiment.experiment"]
  if experiments and experiments.idle and not experiments.is(value) then
    output.warn(("limax: %s made an experiment and did nothing with it: it should end in"
      .. " `return limax.experiment { ... }`\n"):format(argv[1]))
  end
  local test = package.loaded["limax.test"]
  if test and test.begun() then
    failure.raise(exit_usage, ("%s is a suite of tests: limax test %s"):format(argv[1], argv[1]))
  end
  if type(value) ~= "table" then return nil end
  local run = load_command "run"
  if not run.is_experiment(value) then return nil end
  local arguments = options.parse(run, argv)
  return call(run, arguments, function()
    -- `limax run` refuses a script with --resume
    if arguments.resume or arguments.changed or arguments.trust then return run.run(arguments) end
    return run.run_experiment(value, arguments)
  end)
end

local function run_command(name, argv)
  local is_known = false
  for _, each in ipairs(command_names()) do is_known = is_known or each == name end
  if not is_known then
    if host.file.exists(name) == "file" then
      failure.raise(exit_usage,
        ('"%s" is not a command; a script\'s name ends in .lua'):format(name))
    end
    local ending = suggest.ending(name, command_names())
    failure.raise(exit_usage, ('unknown command "%s"%s'):format(name, ending))
  end
  local command = load_command(name)
  local arguments = options.parse(command, { unpack(argv, 2) })
  if exchange.count > 1 and not command.runs_on_ranks then
    failure.raise(exit_usage, ("`limax %s` is one process: start it without mpirun"):format(name))
  end
  return call(command, arguments, function() return command.run(arguments) end)
end

local function dispatch(argv)
  local first = argv[1]
  if first == nil then
    output.warn(overview())
    return exit_usage
  end
  if first == "--version" then return version() end
  if first == "--help" or first == "-h" or (first == "help" and not argv[2]) then
    output.write(overview())
    return nil
  end
  if first == "help" then return run_command(argv[2], { argv[2], "--help" }) end
  if first:sub(1, 1) == "-" then
    local ending = suggest.ending(first, { "--help", "--version" })
    failure.raise(exit_usage, ("unknown option %s%s"):format(first, ending))
  end
  if first:match "%.lua$" then return run_script(argv) end
  return run_command(first, argv)
end

-- Runs a command line and reports errors. Returns the status.
local function report(argv)
  local fine, value, trace = host.protect(dispatch, argv)
  if fine then return value or 0 end
  io.stdout:flush()
  local shows = exchange.shows(value, trace)
  if value == host.interrupt then
    if shows then output.warn("limax: interrupted\n") end
    return host.signal.status()
  end
  local status = failure.status(value)
  if not shows then return status or exit_failed end
  output.warn("limax: ", status and tostring(value) or failure.text(value, trace), "\n")
  return status or exit_failed
end

--- Runs a command line and reports errors.
---@param argv string[] the words after the program's name
---@return integer status of the process
function main.main(argv) return exchange.finish(report(argv)) end

return main
