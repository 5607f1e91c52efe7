--- trust.lua: `limax trust DIR`: shows what a folder of somebody else would run, and seals it with
--- the key of this user.

local failure = require "limax.base.failure"
local host = require "limax.host"
local output = require "limax.base.output"
local reader = require "limax.run.reader"
local scripts = require "limax.run.scripts"
local seal = require "limax.base.seal"
local source = require "limax.base.source"
local study_file = require "limax.run.study_file"
local terminal = require "limax.base.terminal"

local command = {
  summary = "show what a run folder would run, and seal it with your key",
  usage = "limax trust [--yes] DIR",
  text = [[
Scripts, overrides, prompts and addresses in a run folder or a sweep take effect only if you sealed
it: limax does so with every folder that it makes for you, with a key in ~/.config/limax/key
($LIMAX_KEY_FILE names another one). A folder of somebody else, of another machine or that was
edited is refused by `limax run --resume` and `limax sweep --resume`, and its fitness by `limax
compare`; it can be read by all other commands. Look at what this command lists before you answer
yes. Of a sweep or a study all its runs are sealed too.]],
  positional = { least = 1, most = 1, name = "DIR" },
  options = { { name = "yes", text = "do not ask" } },
}

local function say(text, ...) output.write("  ", terminal.word(text:format(...)), "\n") end

-- Lists what a run would do with the rights of its user.
local function show_run(folder)
  local run = folder.config.run
  output.write(terminal.word(folder.path), ":\n")
  local path, is_original = scripts.chosen(folder)
  if run.script then
    say("runs      %s%s", path, is_original and "" or " (the original is gone)")
  end
  for _, copy in ipairs(run.scripts) do
    local file = folder:scripts_path() .. "/" .. copy.file
    say("script    %s, %s bytes", file, tostring(source.size(file) or "no"))
  end
  for _, override in ipairs(run.overrides) do say("override  %s", override) end
  local supervisor = folder.config.supervisor
  for _, name in ipairs(type(supervisor) == "table" and { "url", "prompt", "run" } or {}) do
    if supervisor[name] then say("%-9s %s", name, tostring(supervisor[name])) end
  end
end

local function show_study(path, study)
  output.write(terminal.word(path), ":\n")
  if study.script then say("runs      %s", study.script.path) end
  for _, run in ipairs(study.runs) do
    for _, change in ipairs(run.changes or {}) do say("override  %s (%s)", change, run.path) end
  end
end

-- Seals a document again, with its other bytes as they are.
local function seal_file(path)
  local sealed = seal.again(assert(source.read_own(path)))
  if not sealed then failure.raise(1, "there is no key to seal " .. path .. " with") end
  source.write(path, sealed)
end

-- The folders of a study's runs that have begun.
local function folders_of(path, study)
  local list = {}
  for _, run in ipairs(study and study.runs or {}) do
    local folder = path .. "/" .. run.path
    if reader.is_run(folder) then list[#list + 1] = reader.read(folder) end
  end
  if not study then list[1] = reader.read(path) end
  return list
end

function command.run(arguments)
  local path = arguments[1]:gsub("(.)/+$", "%1")
  local study = study_file.exists(path) and study_file.read(path) or nil
  local list = folders_of(path, study)
  if study then show_study(path, study) end
  for _, folder in ipairs(list) do
    show_run(folder)
    scripts.texts(folder) -- what would run must be what it recorded
  end
  if not arguments.yes then
    if not host.terminal().stdin then
      failure.raise(2, "limax trust: there is no terminal to ask; --yes seals without asking")
    end
    output.write "Seal this with your key, so that it may run with your rights? [y/N] "
    io.stdout:flush()
    if not (io.read "*l" or ""):lower():match "^%s*y" then
      output.write "not sealed\n"
      return 1
    end
  end
  if study then seal_file(path .. "/" .. study_file.NAME) end
  for _, folder in ipairs(list) do seal_file(folder.path .. "/" .. folder.config_name) end
  output.write("sealed with key ", seal.key_name() or "none", "\n")
  return 0
end

return command
