--- api.lua: every public name has an entry, whose example runs; the reference page is complete.

local api = require "limax.tools.reference.api"
local choice = require "limax.base.choice"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local source = require "limax.base.source"

local suite = require("limax.test").suite "api"

-- The public names of a table that a group lacks.
local function missing(group, names)
  local listed, list = {}, {}
  for _, each in ipairs(group.list) do
    listed[each.name], listed[each.short or each.name] = true, true
  end
  for _, name in ipairs(names) do
    if not listed[name] then list[#list + 1] = group.prefix .. name end
  end
  return list
end

suite:test("every public name has an entry", function(t)
  local words = require "limax.tools.repl.words"
  local without = missing(api.groups()[1], choice.sorted_keys(words))
  local function add(names)
    for _, name in ipairs(names) do without[#without + 1] = name end
  end
  for _, group in ipairs(api.groups()) do
    local module = group.prefix:match "^limax%.(%w+)%.$"
    if module then
      -- `begun` and `collect` are for the runner
      local public = {}
      for key, value in pairs(limax[module]) do
        local hidden = module == "test" and (key == "begun" or key == "collect")
        public[key] = not hidden and value or nil
      end
      add(missing(group, choice.sorted_keys(public)))
    end
    if group.prefix == "limax." then add(missing(group, getmetatable(limax).__fields)) end
    if group.named then
      add(missing(group, choice.sorted_keys(limax[module].entries)))
    end
  end
  t:ok(#without == 0, table.concat(without, ", ")
    .. " without an example in scripts/lib/tools/reference/groups.lua")
end)

suite:test("every example runs at the prompt", function(t)
  local folder = t:folder()
  process.write(folder .. "/mine.lua", "return { answer = 42 }\n")
  -- what examples of supervisors read: a finished run
  process.write(folder .. "/walk.lua", [[
return require("limax").experiment { name = "walk", fitness = "walk", generations = 2,
  repetitions = 1, simulation = { duration = 0.1, settle = 0 }, supervisor = "random" }
]])
  process.completes(t, folder, { "run", "walk.lua", "-q" })
  for _, group in ipairs(api.groups()) do
    local lines = { group.stage or "" }
    for _, entry in ipairs(group.list) do
      -- an expression is muted; statements are as they stand
      lines[#lines + 1] = entry.example
    end
    process.write(folder .. "/input", table.concat(lines, "\n") .. "\n")
    local problems = process.output(("cd %s; TERM=dumb %s repl <input 2>&1 >output; echo status $?")
      :format(process.quote(folder), process.quote(host.executable)))
    t:equal({ group.title, problems }, { group.title, "status 0\n" })
  end
end)

-- Calls functions with each wrong value as the first argument, the first two, ...: prints the
-- first error of each that names a line of limax.
local WRONG = [[
local limax = require "limax"
-- the stages set globals
setfenv(1, setmetatable({}, { __index = _G }))
local cyclic = {}
cyclic[1], cyclic.fitness = cyclic, cyclic
local values = { 5, -1, 0.5, 1e300, 0 / 0, "", "x", {}, { 1 }, { "x" }, cyclic, true,
  function() end }
local function try(name, arguments, call)
  for k = 1, #values + 1 do
    local list = {}
    for count = 1, math.max(arguments, 1) do
      list[count] = values[k]
      local _, problem = pcall(call, unpack(list, 1, count))
      local text = tostring(problem)
      if text:find "%.lua:%d+: " and text:match "([%w_.]+):%d+: " ~= "script.lua" then
        io.write(("%s, %d times %s: %s\n"):format(name, count, tostring(values[k]), text))
        return
      end
    end
  end
end
]]
-- Functions without a check of their arguments.
local UNCHECKED = { ["limax.diversity.measure"] = true, ["limax.diversity.top_half"] = true,
  ["limax.rescore.options"] = true, ["limax.rescore.population"] = true,
  ["population:simulate"] = true }

suite:test("an error about an argument names no line of limax", function(t)
  local folder, lines = t:folder(), { WRONG }
  for _, group in ipairs(api.groups()) do
    -- words of the prompt and parts of tests do not run in a script
    local runs = group.prefix ~= "" and not group.files[1]:find("tools/test/", 1, true)
    if runs then lines[#lines + 1] = group.stage end
    for _, entry in ipairs(runs and group.list or {}) do
      if entry.kind == "function" and not UNCHECKED[entry.name] then
        lines[#lines + 1] = ("try(%q, %d, function(...) return %s(...) end)"):format(entry.name,
          #entry.doc.arguments, entry.name)
      end
    end
  end
  local status, output = process.script(folder, table.concat(lines, "\n"))
  t:equal({ output, status }, { "", 0 })
end)

suite:test("the generated pages are up to date", function(t)
  for _, name in ipairs { "page", "run_folder_page", "control_page" } do
    local page = require("limax.tools.reference." .. name)
    t:ok(source.read(host.home .. "/" .. page.path) == page.text(),
      page.path .. " is out of date: run limax scripts/dev/reference.lua")
  end
end)
