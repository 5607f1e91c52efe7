--- verify.lua: whether a run folder holds, byte for byte, what its run wrote: every generation up
--- to the checkpoint, configuration, scripts and transcript. Reads only.

local host = require "limax.host"
local run_files = require "limax.settings.run_files"
local sealed = require "limax.base.sealed"
local source = require "limax.base.source"

local verify = {}

--- The files that grow by one line per generation; `hashes` has the hashes of the other lines.
verify.GROWING = { "metrics", "ledger", "timing", "hashes" }

--- The files of one generation, as `hashes` names them; one that it does not name is not there. A
--- run that keeps only the best robots has the recent ones of its newest generations only.
verify.FILES = { population = { "population", ".jsonl" }, genomes = { "population", ".npy" },
  columns = { "population", ".robots.npy" }, champion = { "champions", ".json" },
  state = { "state", ".json" }, archive = { "archive", ".jsonl" },
  recent_columns = { "population", ".robots.npy" }, recent_genomes = { "population", ".npy" } }

--- How many newest generations have recent files: those whose robots a run that goes on reads.
verify.RECENT = 3

-- Is the file of this kind still there, when `last` is the newest generation?
local function is_expected(kind, generation, last)
  return not kind:find "^recent_" or generation > last - verify.RECENT
end

--- The path of a file of one generation in the run folder.
---@param kind "population"|"genomes"|"columns"|"champion"|"state"|"archive"|"recent_columns"|
---"recent_genomes"
function verify.place(kind, repetition, generation)
  local folder, ending = unpack(verify.FILES[kind])
  return ("r%02d/%s/g%04d%s"):format(repetition, folder, generation, ending)
end

---@class limax.run.damage
---@field file string below the folder
---@field reason string
---@field repetition integer|nil that it belongs to
---@field generation integer|nil
---@field unreadable boolean|nil is it there, but could not be read?

---@class limax.run.row a generation that the folder should hold
---@field repetition integer
---@field generation integer
---@field scored_by string|nil
---@field metrics string hash of its line in that file; likewise the next two
---@field ledger string
---@field timing string
---@field recent boolean are all its robots kept only while it is one of the newest generations?

---@class limax.run.state
---@field checkpoint table|nil
---@field damage limax.run.damage[]
---@field rows limax.run.row[]
---@field offsets table<string, integer[]> of each row's whole line in each growing file

-- Adds a file that is missing, or could not be read and may be whole.
local function add_unread(state, damage, file, message, missing)
  damage.file, damage.unreadable = file, not missing
  damage.reason = missing and "is missing"
    or ("could not be read (%s)"):format(message:match "([^:]*)$":gsub("^ ", ""))
  table.insert(state.damage, damage)
end

-- The text of a file; nil where it cannot be read, which is then added as this damage. Without one
-- the file may be missing.
local function read(state, path, file, damage)
  local text, message, missing = source.read(path .. "/" .. file)
  if not text and (damage or not missing) then
    add_unread(state, damage or {}, file, message, missing)
  end
  return text
end

-- The object of a sealed text, checked: it may be damaged, or from somebody else. Else nil and why.
local function open(text, kind)
  local value, reason = sealed.open(text)
  local problem = value and run_files.problem(value, kind)
  if problem then return nil, "is invalid: " .. problem:gsub("%c", "?") end
  return value, reason
end

-- Calls `visit(text, at)` for each line of a growing file up to the checkpoint.
local function each_line(state, path, name, visit)
  local file = name .. ".jsonl"
  local bytes = state.checkpoint and state.checkpoint.bytes[name]
  local opened, message, missing = source.open(path .. "/" .. file)
  if not opened then return add_unread(state, {}, file, message, missing) end
  local size, problem = opened:seek "end"
  if not size then
    opened:close()
    return add_unread(state, {}, file, problem)
  end
  opened:seek "set"
  if bytes and size < bytes then
    table.insert(state.damage, { file = file,
      reason = ("has only %d of %d bytes"):format(size, bytes) })
  end
  local whole, broken = source.each_line(opened, bytes, visit)
  opened:close()
  if broken then
    add_unread(state, {}, file, broken)
  elseif bytes and whole < math.min(bytes, size) then
    table.insert(state.damage, { file = file, reason = "does not consist of whole lines" })
  end
end

local function check_files(state, path, hashes, last)
  local repetition, generation = hashes.repetition, hashes.generation
  for kind in pairs(verify.FILES) do
    local file = verify.place(kind, repetition, generation)
    local text = hashes[kind] and (is_expected(kind, generation, last)
      or host.file.exists(path .. "/" .. file))
      and read(state, path, file, { repetition = repetition, generation = generation })
    if text and host.xxh3(text) ~= hashes[kind] then
      table.insert(state.damage, { file = file, repetition = repetition, generation = generation,
        reason = "does not match its hash" })
    end
  end
end

-- Rows from the lines of hashes.jsonl, and the damage of the files that these name.
local function read_rows(state, path)
  local last, all, k = {}, {}, 0
  each_line(state, path, "hashes", function(text, at)
    k = k + 1
    local file, hashes, reason = ("hashes.jsonl, line %d"):format(k), open(text, "hashes")
    if not hashes then
      -- which generation it was follows from the line before
      local before = state.rows[#state.rows]
      table.insert(state.damage, { file = file, reason = reason,
        repetition = before and before.repetition, generation = before and before.generation + 1 })
    else
      local expected = (last[hashes.repetition] or -1) + 1
      if hashes.generation ~= expected then
        table.insert(state.damage, { file = file, repetition = hashes.repetition,
          generation = math.min(expected, hashes.generation),
          reason = ("is of generation %d, and %d was expected"):format(hashes.generation,
            expected) })
      end
      last[hashes.repetition] = hashes.generation
      all[#all + 1] = hashes
      table.insert(state.rows, { repetition = hashes.repetition, generation = hashes.generation,
        scored_by = hashes.scored_by, metrics = hashes.metrics, ledger = hashes.ledger,
        timing = hashes.timing, recent = hashes.recent_columns ~= nil })
      state.offsets.hashes[#state.rows] = at
    end
  end)
  for _, hashes in ipairs(all) do check_files(state, path, hashes, last[hashes.repetition]) end
end

-- Finds each row's line in a growing file. The lines of one repetition are in order; those of
-- several are sorted only at the end of a run.
local function match_lines(state, path, name)
  local place_of, offsets, strange, number = {}, state.offsets[name], {}, 0
  for k, row in ipairs(state.rows) do place_of[row[name]] = k end
  each_line(state, path, name, function(text, at)
    local k = place_of[host.xxh3(text)]
    number = number + 1
    if k then offsets[k] = at else strange[#strange + 1] = number end
  end)
  local missing, last = false, {}
  for k, row in ipairs(state.rows) do
    if offsets[k] and offsets[k] < (last[row.repetition] or 0) then
      table.insert(state.damage, { file = name .. ".jsonl", reason = ("has the line of generation"
        .. " %d of repetition %d in the wrong place"):format(row.generation, row.repetition),
        repetition = row.repetition, generation = row.generation - 1 })
    end
    last[row.repetition] = offsets[k] or last[row.repetition]
    if not offsets[k] then
      missing = true
      table.insert(state.damage, { file = name .. ".jsonl", reason = ("has no undamaged line of"
        .. " generation %d of repetition %d"):format(row.generation, row.repetition),
        repetition = row.repetition, generation = row.generation })
    end
  end
  -- without a checkpoint the last lines may have no row
  for _, line in ipairs(state.checkpoint and not missing and strange or {}) do
    table.insert(state.damage, { file = ("%s.jsonl, line %d"):format(name, line),
      reason = "is not a line that the run wrote" })
  end
end

-- A sealed file; returns its object.
local function check_sealed(state, path, file, kind)
  local text = read(state, path, file)
  if not text then return nil end
  local value, reason = open(text, kind)
  if not value then table.insert(state.damage, { file = file, reason = reason }) end
  return value
end

-- Every script of a configuration must be in one of these folders.
local function check_scripts(state, path, config, ...)
  for _, script in ipairs(config and config.run.scripts or {}) do
    local found = false
    for _, folder in ipairs { ... } do
      local text = source.read(("%s/%s/%s"):format(path, folder, script.file))
      found = found or text and host.sha256(text) == script.sha256
    end
    if not found then
      table.insert(state.damage, { file = ("%s/%s"):format(..., script.file),
        reason = "is missing or does not match its SHA-256 in the configuration" })
    end
  end
end

-- The configuration, those before it, and the scripts of each.
local function check_configurations(state, path)
  local last
  for n = 1, math.huge do
    local file = ("config-%d.json"):format(n)
    if not host.file.exists(path .. "/" .. file) then break end
    check_scripts(state, path, check_sealed(state, path, file, "config"), "scripts-" .. n)
    last = n
  end
  -- a process that was killed while it changed the run may have replaced scripts, after it copied
  -- the configuration
  local is_kept = last and source.read(path .. "/config.json")
    == source.read(("%s/config-%d.json"):format(path, last))
  check_scripts(state, path, check_sealed(state, path, "config.json", "config"), "scripts",
    is_kept and "scripts-" .. last or nil)
end

local function check_transcript(state, path)
  local file, message, missing = source.open(path .. "/transcript.jsonl")
  local k = 0
  if not file then
    if not missing then add_unread(state, {}, "transcript.jsonl", message) end
    return
  end
  source.each_line(file, nil, function(text)
    k = k + 1
    local line, reason = sealed.open(text)
    if not line then
      line = host.json.decode(text)
      local place = type(line) == "table" and line or {}
      table.insert(state.damage, { file = ("transcript.jsonl, line %d"):format(k), reason = reason,
        repetition = tonumber(place.repetition), generation = tonumber(place.generation) })
    end
  end)
  file:close()
end

--- What is in a run folder, and what is damaged.
---@param path string
---@return limax.run.state
function verify.folder(path)
  local state = { damage = {}, rows = {}, offsets = {} }
  for _, name in ipairs(verify.GROWING) do state.offsets[name] = {} end
  check_configurations(state, path)
  check_sealed(state, path, "environment.json", "environment")
  check_transcript(state, path)
  state.checkpoint = check_sealed(state, path, "checkpoint", "checkpoint")
  read_rows(state, path)
  if not host.file.exists(path .. "/checkpoint") then
    -- a run that was killed before its first checkpoint has no more than one line
    if #state.rows < 2 and not verify.is_unreadable(state) then
      return { damage = {}, rows = {}, offsets = {} }
    end
    table.insert(state.damage, { file = "checkpoint", reason = "is missing" })
  end
  for _, name in ipairs(verify.GROWING) do
    if name ~= "hashes" then match_lines(state, path, name) end
  end
  return state
end

--- Is there a file that could not be read? It may be whole.
---@param state limax.run.state
function verify.is_unreadable(state)
  for _, each in ipairs(state.damage) do
    if each.unreadable then return true end
  end
  return false
end

--- The first file of a run folder that is a symbolic link: a write would change another file, and
--- the folder may come from somebody else. A repetition may be stored elsewhere.
---@return string|nil path
function verify.link(path)
  for _, name in ipairs(host.file.list(path) or {}) do
    local file = path .. "/" .. name
    if not name:match "^r%d+$" and host.file.exists(file, true) == "other" then return file end
  end
end

--- Was the configuration of a folder changed by something else than limax? It would be taken for
--- that of another experiment. Folders of limax before 0.2 have no hashes.
---@param path string
function verify.is_edited(path)
  return host.file.exists(path .. "/hashes.jsonl") ~= nil
    and not sealed.open(source.read(path .. "/config.json") or "")
end

--- What is not there any longer of a run that has ended; nil where everything is there. Looks at
--- names and sizes only.
---@param path string
---@param bytes table<string, integer> of the files that grow
---@return string|nil message
function verify.missing(path, bytes)
  local message
  for _, name in ipairs(verify.GROWING) do
    local file, problem, missing = source.open(("%s/%s.jsonl"):format(path, name))
    if not file and not missing then return problem end
    local size = file and file:seek "end" or 0
    if size ~= bytes[name] then
      message = ("%s/%s.jsonl has %d bytes, and %d were written: something else changed it while"
        .. " the run went on"):format(path, name, size, bytes[name])
    elseif name == "hashes" and not message then
      file:seek "set"
      source.each_line(file, nil, function(line)
        local row = host.json.decode(line)
        for kind in pairs(verify.FILES) do
          local one = path .. "/" .. verify.place(kind, row.repetition, row.generation)
          if row[kind] and not kind:find "^recent_" and not host.file.exists(one) then
            message = one .. " is gone: something else removed it while the run went on"
          end
        end
      end)
    end
    if file then file:close() end
  end
  return message
end

-- Longest list that a message shows.
local MOST_SHOWN = 12

--- The damage as text, a line for each file.
---@param damage limax.run.damage[]
function verify.text(damage)
  local names, first, more, lines = {}, {}, {}, {}
  for _, each in ipairs(damage) do
    local name = each.file:match "^[^,]*"
    if first[name] then
      more[name] = more[name] + 1
    else
      names[#names + 1] = name
      first[name], more[name] = each, 0
    end
  end
  for k = 1, math.min(#names, MOST_SHOWN) do
    local each, others = first[names[k]], more[names[k]]
    lines[k] = ("  %s %s"):format(each.file, each.reason)
      .. (others > 0 and (", and %d more in this file"):format(others) or "")
  end
  local hidden = #names - MOST_SHOWN
  if hidden > 0 then lines[#lines + 1] = ("  ... and %d more files"):format(hidden) end
  return table.concat(lines, "\n")
end

--- A warning for readers of a damaged folder; nil where nothing is damaged, or nothing can be
--- verified because limax before 0.2 wrote it.
---@param path string
---@return string|nil
function verify.warning(path)
  if not host.file.exists(path .. "/hashes.jsonl") then return nil end
  local damage = verify.folder(path).damage
  return damage[1] and ("! %s is damaged, its numbers may be wrong:\n%s\n"):format(path,
    verify.text(damage)) or nil
end

--- The last generation up to which everything is whole; nil where the damage belongs to no
--- generation, or to the first one.
---@param state limax.run.state
---@return integer|nil
function verify.last_whole(state)
  local last = -1
  for _, row in ipairs(state.rows) do last = math.max(last, row.generation) end
  for _, each in ipairs(state.damage) do
    if each.generation then
      last = math.min(last, each.generation - 1)
    elseif each.file ~= "checkpoint" and not each.file:find "%.jsonl" then
      return nil
    end
  end
  return last >= 0 and last or nil
end

return verify
