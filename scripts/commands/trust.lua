--- trust.lua: `limax trust DIR`: shows the scripts that a folder of somebody else would run, and
--- seals it with the key of this user.

local choice = require "limax.base.choice"
local config = require "limax.run.config"
local failure = require "limax.base.failure"
local flat = require "limax.base.flat"
local host = require "limax.host"
local output = require "limax.base.output"
local reader = require "limax.run.reader"
local scripts = require "limax.run.scripts"
local seal = require "limax.base.seal"
local shell = require "limax.base.shell"
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

-- Lists the original of a script: `use` is what runs it.
local function show_original(path, recorded, use)
  local state = "not there"
  if scripts.is_there(path) then
    state = scripts.changed(path, recorded)[1] and "other than the script that ran"
      or "the script that ran"
  end
  say("original  %s (%s); runs with %s", path, state, use)
end

-- Lists what a run would do with the rights of its user.
local function show_run(folder)
  local run, supervisor = folder.config.run, folder.config.supervisor
  output.write(terminal.word(folder.path), ":\n")
  local texts, place = scripts.texts(folder) -- what would run must be what it recorded
  for _, copy in ipairs(run.scripts) do
    say("%-9s %s/%s, %d bytes", copy.file == run.script and "runs" or "script", place, copy.file,
      #texts[copy.file])
  end
  if run.path then show_original(run.path, run.scripts, "--resume if its text is the same, and with"
    .. " --changed") end
  for _, override in ipairs(run.overrides) do say("override  %s", override) end
  local options = type(supervisor) == "table" and next(supervisor)
    and flat.add(supervisor, "supervisor", {}, flat.text) or {}
  for _, name in ipairs(choice.sorted_keys(options)) do say("%-9s %s", name, options[name]) end
end

local function show_study(path, study)
  output.write(terminal.word(path), ":\n")
  if study.script then
    show_original(study.script.path, study.script.scripts, "sweep --resume if its text is the same")
  end
  for _, run in ipairs(study.runs) do
    for _, change in ipairs(run.changes or {}) do say("override  %s (%s)", change, run.path) end
  end
end

-- The documents that the command seals: path, and the text that is shown.
local function documents_of(path, study, folders)
  local list = {}
  if study then list[1] = { path = path .. "/" .. study_file.NAME } end
  for _, folder in ipairs(folders) do
    list[#list + 1] = { path = folder.path .. "/" .. folder.config_name, folder = folder }
  end
  for _, each in ipairs(list) do
    local text, message = source.read_own(each.path)
    if not text then failure.raise_damaged(message) end
    local sealed
    sealed, message = seal.again(text)
    if not sealed then failure.raise(1, ("%s cannot be sealed: %s"):format(each.path, message)) end
    if each.folder and config.hash(text) ~= each.folder.config_hash then
      failure.raise(1, each.path .. " changed while it was read")
    elseif each.folder and each.folder.is_edited then
      failure.raise(1, each.folder:edited_text())
    end
    each.text, each.sealed = text, sealed
  end
  return list
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

local function is_agreed()
  if not host.terminal().stdin then
    failure.raise(2, "limax trust: there is no terminal to ask; --yes seals without asking")
  end
  output.write "Seal this with your key, so that it may run with your rights? [y/N] "
  io.stdout:flush()
  return (io.read "*l" or ""):lower():match "^%s*y" ~= nil
end

function command.run(arguments)
  local path = arguments[1]:gsub("(.)/+$", "%1")
  local study = study_file.exists(path) and study_file.read(path) or nil
  local folders = folders_of(path, study)
  local documents = documents_of(path, study, folders)
  if study then show_study(path, study) end
  for _, folder in ipairs(folders) do show_run(folder) end
  if not arguments.yes and not is_agreed() then
    output.write "not sealed\n"
    return 1
  end
  for _, each in ipairs(documents) do
    if source.read_own(each.path) ~= each.text then
      failure.raise(1, ("%s changed after it was shown: run limax trust %s again"):format(each.path,
        shell.path(path)))
    end
    source.write(each.path, each.sealed)
  end
  output.write("sealed with key ", seal.key_name() or "none", "\n")
  return 0
end

return command
