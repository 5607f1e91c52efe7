--- cut.lua: before a run is continued: its folder must be whole, and ends with a whole generation.

local failure = require "limax.base.failure"
local host = require "limax.host"
local sealed = require "limax.base.sealed"
local shell = require "limax.base.shell"
local source = require "limax.base.source"
local verify = require "limax.run.verify"

local GROWING = verify.GROWING

-- Refuses a damaged folder, and says from which generation it can go on.
local function refuse_damage(folder, state)
  local last, remedy = verify.last_whole(state), "restore what is damaged from a copy"
  if not host.file.exists(folder.path .. "/hashes.jsonl") then
    remedy = "limax before 0.2 wrote no hashes: such a run can be read, but not continued"
  elseif verify.is_unreadable(state) then
    remedy = "make every file readable, then continue with: " .. shell.resume_command(folder.path)
  elseif last then
    remedy = ("everything up to generation %d is whole; go on from there with: %s --from %d")
      :format(last, shell.resume_command(folder.path), last)
  end
  failure.raise(1, ("%s is damaged:\n%s\n%s"):format(folder.path, verify.text(state.damage),
    remedy))
end

-- The damage that remains when all generations after `from` are dropped: in the repetitions that
-- are damaged, or in all. `state.keeps` is then whether a generation stays.
local function drop_after(folder, state, from)
  local damaged, rest, last = {}, {}, -1
  for _, each in ipairs(state.damage) do
    if each.repetition then damaged[each.repetition] = true end
    local dropped = each.generation and each.generation > from
      or not each.generation and (each.file == "checkpoint" or each.file:find "%.jsonl")
    if not dropped or each.unreadable then rest[#rest + 1] = each end
  end
  local any = next(damaged) ~= nil
  function state.keeps(at)
    return at.generation <= from or any and not damaged[at.repetition]
  end
  for _, row in ipairs(state.rows) do
    last = math.max(last, row.generation)
    local first = math.max(0, from - verify.RECENT + 1)
    if row.recent and row.generation == from
      and not folder:has_robots(row.repetition, first) then
      failure.raise(2, ("--from %d: record.population = \"best\" keeps all robots of the newest %d"
        .. " generations only, and going on needs those of generation %d; leave out --from, or"
        .. " start again with record.population = \"columns\""):format(from, verify.RECENT, first))
    end
  end
  if from > last then
    failure.raise(2, ("--from %d: the last generation in %s is %d"):format(from, folder.path, last))
  end
  state.damage = rest
end

-- Rewrites the files that grow with the rows that stay, and the transcript; the checkpoint last.
local function rewrite(folder, state, at)
  for _, name in ipairs(GROWING) do folder:rewrite(name) end
  local transcript = source.read(folder.path .. "/transcript.jsonl")
  if transcript then
    folder:write("transcript.jsonl", (transcript:gsub("[^\n]*\n", function(text)
      local line = sealed.open(text)
      return line and state.keeps(line) and text or ""
    end)))
  end
  folder.checkpoint = { schema = "limax.checkpoint/1", repetition = at.repetition,
    generation = at.generation, bytes = source.copy(folder.bytes) }
  folder:write("checkpoint",
    sealed.add(host.json.encode(folder.checkpoint, { indent = 2 }) .. "\n"))
end

--- Verifies a locked run folder, then removes everything after the last complete generation, or
--- after the generation `from`. Nothing is changed before everything is verified.
---@param folder limax.run_folder
---@param from? integer the last generation to keep
return function(folder, from)
  local state = verify.folder(folder.path)
  if from then drop_after(folder, state, from) end
  if state.damage[1] then refuse_damage(folder, state) end
  local at = folder:index(state, from and state.keeps)
  if from then
    rewrite(folder, state, at)
  elseif state.checkpoint then
    folder.checkpoint, folder.bytes = state.checkpoint, source.copy(state.checkpoint.bytes)
  end
  for _, name in ipairs(GROWING) do
    folder:check(host.file.truncate(("%s/%s.jsonl"):format(folder.path, name), folder.bytes[name]))
  end
  folder:clean("", math.huge)
  for _, name in ipairs(host.file.list(folder.path) or {}) do
    if name:match "^scripts" then folder:clean("/" .. name, math.huge) end
    local repetition = tonumber(name:match "^r(%d+)$")
    for _, place in pairs(repetition and verify.FILES or {}) do
      folder:clean(("/%s/%s"):format(name, place[1]), folder.lines:last(repetition))
    end
  end
end
