--- parallel.lua: runs a plan's files in processes of their own, several at a time. Each child is
--- `limax test FILE --json`; its lines are told to the reporter when it has ended, so that files
--- are never mixed. A child that dies costs its own file, and so does one whose test does not
--- return: the limit within a process ends simulations, but no loop of Lua.

local host = require "limax.host"
local process = require "limax.test.process"
local source = require "limax.source"

local parallel = {}

-- seconds between two looks at the children: short against any file of tests
local LOOK = 0.02
-- looks between two at what the children run
local LOOKS = 25
-- seconds beyond its limit after which a test is ended from outside: it had its chance to say so
local GRACE = 5

local function words_of(entry, options)
  local words = { process.quoted(host.executable), "test", process.quoted(entry.file.path),
    "--json" }
  local function add(name, value)
    if value then words[#words + 1] = ("--%s=%s"):format(name, process.quoted(value)) end
  end
  local choice = options.choice
  add("filter", choice.filter)
  if choice.tags[1] then add("tags", table.concat(choice.tags, ",")) end
  for _, title in ipairs(choice.only) do add("only", title) end
  if options.seed then add("shuffle", tostring(options.seed)) end
  return table.concat(words, " ")
end

---@class limax.test_child
---@field entry table of the plan
---@field pipe file*
---@field base string its files: .pid, .out, .err, .rc

local function start(entry, folder, number, options)
  local base = ("%s/%d"):format(folder, number)
  -- the pid is that of limax: the shell that writes it becomes limax
  local script = ("echo $$ >%s.pid\nexec %s >%s.out 2>%s.err </dev/null\n"):format(
    process.quoted(base), words_of(entry, options), process.quoted(base), process.quoted(base))
  assert(host.file.write_atomic(base .. ".sh", script))
  local line = ("sh %s.sh; echo $? >%s.rc"):format(process.quoted(base), process.quoted(base))
  return { entry = entry, base = base, pipe = assert(io.popen(line, "r")) }
end

local function key_of(event) return event.suite .. "\0" .. event.test end

-- Ends a child whose test is far beyond its limit.
local function watch(child)
  local last = (source.read(child.base .. ".out") or ""):match "([^\n]*)\n[^\n]*$"
  local event = last and host.json.decode(last, child.base)
  if type(event) ~= "table" or event.event ~= "start" or not event.limit then
    child.now = nil
    return
  end
  local key = key_of(event)
  if child.now ~= key then child.now, child.since = key, host.clock() end
  if host.clock() - child.since > event.limit + GRACE and not child.hung then
    child.hung = { key = key, limit = event.limit }
    local pid = source.read(child.base .. ".pid")
    os.execute(("kill -KILL %d 2>/dev/null"):format(tonumber(pid)))
  end
end

local function read(path) return source.read(path) or "" end

-- What a child printed, told to the reporter; tests of which it said nothing have failed.
local function tell(child, reporter, counts)
  local file, open, ended = child.entry.file, {}, false
  for i, instance in ipairs(child.entry.instances) do
    open[instance.suite .. "\0" .. instance.label] = i
  end
  local results, failed_to_load = {}, nil
  for line in read(child.base .. ".out"):gmatch "[^\n]+" do
    local event = host.json.decode(line, child.base)
    -- what a test itself prints stands between the lines
    if type(event) ~= "table" then
      io.stderr:write(line, "\n")
    elseif event.event == "test" then
      local key = key_of(event)
      results[#results + 1] = { child.entry.instances[open[key]], event }
      open[key] = nil
    elseif event.event == "file" then
      failed_to_load = event.failure
    elseif event.event == "end" then
      ended = true
    end
  end
  io.stderr:write(read(child.base .. ".err"))

  reporter:file { path = file.path, failure = failed_to_load }
  if failed_to_load then counts.failed = counts.failed + 1 end
  local function result(instance, outcome)
    counts[outcome.status] = counts[outcome.status] + 1
    reporter:result(instance, outcome)
  end
  for _, pair in ipairs(results) do result(pair[1], pair[2]) end
  if ended then return end
  local status = read(child.base .. ".rc"):match "%d+" or "?"
  for _, instance in ipairs(child.entry.instances) do
    local key = instance.suite .. "\0" .. instance.label
    if open[key] then
      local text = ("its process ended with status %s before this test did"):format(status)
      if child.hung and child.hung.key == key then
        text = ("it did not return within %g s of its limit of %g s"):format(GRACE,
          child.hung.limit)
      end
      result(instance, { status = "failed", seconds = 0, notes = {}, text = text })
    end
  end
end

---@class limax.test_parallel_options
---@field jobs integer processes at a time
---@field choice limax.test_choice
---@field seed integer|nil of a drawn order

--- Runs a plan.
---@param plan limax.test_plan
---@param options limax.test_parallel_options
---@param reporter table see report.lua
---@return limax.test_counts
function parallel.run_all(plan, options, reporter)
  local folder = os.tmpname()
  os.remove(folder)
  assert(host.file.mkdir(folder))
  local counts = { passed = 0, failed = 0, skipped = 0 }
  reporter:begin(plan.total)
  local running, next_file, looks = {}, 1, 0
  local function whole()
    while next_file <= #plan.files or #running > 0 do
      while #running < options.jobs and next_file <= #plan.files do
        table.insert(running, start(plan.files[next_file], folder, next_file, options))
        next_file = next_file + 1
      end
      host.wait(LOOK)
      looks = looks + 1
      for i = #running, 1, -1 do
        local child = running[i]
        if looks % LOOKS == 0 then watch(child) end
        if read(child.base .. ".rc") ~= "" then
          table.remove(running, i)
          child.pipe:close()
          tell(child, reporter, counts)
        end
      end
    end
  end
  local fine, message, trace = host.protect(whole)
  for _, child in ipairs(running) do
    local pid = read(child.base .. ".pid"):match "%d+"
    if pid then os.execute(("kill -INT %s 2>/dev/null"):format(pid)) end
    child.pipe:close()
  end
  for _, name in ipairs(host.file.list(folder) or {}) do host.file.remove(folder .. "/" .. name) end
  host.file.remove(folder)
  if not fine then error(message == host.interrupt and message or trace or message, 0) end
  reporter:finish(counts)
  return counts
end

return parallel
