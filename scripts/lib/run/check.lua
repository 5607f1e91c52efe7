--- check.lua: whether a run folder holds, byte for byte, what its journal names: every generation,
--- configuration, scripts, prompts and transcript. Reads only.

local config = require "limax.run.config"
local files = require "limax.run.files"
local host = require "limax.host"
local parts = require "limax.run.parts"
local sealed = require "limax.base.sealed"
local source = require "limax.base.source"
local terminal = require "limax.base.terminal"

local check = {}

local function add(damage, file, reason, repetition, generation)
  table.insert(damage, { file = file, reason = reason, repetition = repetition,
    generation = generation })
end

-- The text of a file, or what `get` makes of it, of a size if one is wanted; nil if it cannot be
-- read, which is then added.
local function read(folder, damage, file, repetition, generation, wanted, get)
  local size = wanted and source.size(folder.path .. "/" .. file)
  if size and size ~= wanted then
    add(damage, file, ("has %d bytes instead of %d"):format(size, wanted), repetition, generation)
    return nil
  end
  local text, message, missing = (get or source.read_own)(folder.path .. "/" .. file)
  if text ~= nil then return text end
  add(damage, file, missing and "is missing"
    or ("could not be read (%s)"):format(message:match "([^:]*)$":gsub("^ ", "")), repetition,
    generation)
  damage[#damage].unreadable = not missing or nil
end

-- The lines of a growing file.
local function check_lines(folder, damage, name, r)
  local file = files.growing(name, r)
  local text, at = read(folder, damage, file, r, 0), 0
  for g = 0, text and folder:last(r) or -1 do
    local ends, hash = unpack(folder.journal:entry(r, g).lines[name])
    if #text < ends then
      return add(damage, file, ("has only %d of %d bytes"):format(#text, ends), r, g)
    elseif host.xxh3(text:sub(at + 1, ends)) ~= hash then
      add(damage, ("%s, line %d"):format(file, g + 1), "does not match its hash", r, g)
    end
    at = ends
  end
end

-- The configurations that the journal names, and the scripts of each.
local function check_configurations(folder, damage)
  local names, hashes = { folder.config_name }, {}
  for _, line in ipairs(folder.journal.begins) do
    if line.config ~= names[1] and not hashes[line.config] then names[#names + 1] = line.config end
    hashes[line.config] = line.config_hash
  end
  for k, name in ipairs(names) do
    local text = read(folder, damage, name)
    local made, owner = config.parse(text or "", "")
    if text and (hashes[name] and config.hash(text) ~= hashes[name] or owner == "edited") then
      add(damage, name, "was changed since it was written")
    elseif text and not made then
      add(damage, name, "is invalid: " .. owner:gsub("%c", "?"))
    end
    local place = source.name_of(folder:scripts_path(name))
    for _, script in ipairs(made and made.run.scripts or {}) do
      local copy = read(folder, damage, place .. "/" .. script.file)
      if copy and host.sha256(copy) ~= script.sha256 then
        add(damage, place .. "/" .. script.file, "does not match its SHA-256 in " .. names[k])
      end
    end
  end
end

-- The transcript, and the prompts that it names.
local function check_transcript(folder, damage)
  local wanted = folder.journal.transcript
  if wanted == 0 and not host.file.exists(folder.path .. "/transcript.jsonl") then return end
  local text, number, prompts = read(folder, damage, "transcript.jsonl"), 0, {}
  if text and #text < wanted then
    add(damage, "transcript.jsonl", ("has only %d of %d bytes"):format(#text, wanted))
  end
  for line in (text or ""):gmatch "[^\n]*\n" do
    number = number + 1
    if not sealed.check(line) then
      add(damage, ("transcript.jsonl, line %d"):format(number), "does not match its hash",
        tonumber(line:match '"repetition":(%d+)'), tonumber(line:match '"generation":(%d+)'))
    end
    local prompt = line:match '"template_sha256":"(%x+)"'
    if prompt then prompts[prompt] = true end
  end
  for hash in pairs(prompts) do
    local file = ("prompts/%s.md"):format(hash)
    local prompt = read(folder, damage, file)
    if prompt and host.sha256(prompt) ~= hash then
      add(damage, file, "does not match its name, which is its SHA-256")
    end
  end
end

--- Lists the damage of a run folder.
function check.folder(folder)
  local damage = {}
  for _, each in ipairs(folder.journal.damage) do damage[#damage + 1] = each end
  check_configurations(folder, damage)
  check_transcript(folder, damage)
  folder:each_file(function(_, place, part, entry)
    local whole = read(folder, damage, place, entry.repetition, entry.generation, part[1],
      function(path) return parts.is_whole(path, part) end)
    if whole == false then
      add(damage, place, "does not match its hash", entry.repetition, entry.generation)
    end
  end)
  for _, r in ipairs(folder:repetitions()) do
    for _, name in ipairs(files.GROWING) do check_lines(folder, damage, name, r) end
  end
  return damage
end

--- Is there a file that could not be read? It may be whole.
function check.is_unreadable(damage)
  for _, each in ipairs(damage) do
    if each.unreadable then return true end
  end
  return false
end

--- Names a file that a run which has ended lacks; nil if it has all. Reads only names and sizes.
function check.missing(folder)
  local message
  local function look(place, wanted)
    local path = folder.path .. "/" .. place
    local size = source.size(path)
    if not size then
      message = path .. " is gone: something else removed it while the run went on"
    elseif size ~= wanted then
      message = ("%s has %d bytes, and %d were written: something else changed it while the run"
        .. " went on"):format(path, size, wanted)
    end
  end
  folder:each_file(function(_, place, part) look(place, part[1]) end)
  for _, r in ipairs(folder:repetitions()) do
    local last = folder.journal:entry(r, folder:last(r))
    for _, name in ipairs(files.GROWING) do look(files.growing(name, r), last.lines[name][1]) end
  end
  return message
end

-- Longest list that a message shows.
local MOST_SHOWN = 12

--- The damage as text, a line for each part of a file.
function check.text(damage)
  local lines = {}
  for k = 1, math.min(#damage, MOST_SHOWN) do
    lines[k] = ("  %s %s"):format(terminal.word(damage[k].file), damage[k].reason)
  end
  local hidden = #damage - MOST_SHOWN
  if hidden > 0 then lines[#lines + 1] = ("  ... and %d more"):format(hidden) end
  return table.concat(lines, "\n")
end

--- The last generation up to which everything is whole; nil if the damage belongs to no
--- generation, or to the first one.
function check.last_whole(folder, damage)
  local last = -1
  for _, r in ipairs(folder:repetitions()) do last = math.max(last, folder:last(r)) end
  for _, each in ipairs(damage) do
    if not each.generation then return nil end
    last = math.min(last, each.generation - 1)
  end
  return last >= 0 and last or nil
end

return check
