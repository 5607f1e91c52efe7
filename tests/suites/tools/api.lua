--- api.lua: every public name has an entry, whose example runs; the reference page is complete.

local annotations = require "limax.tools.reference.annotations"
local api = require "limax.tools.reference.api"
local choice = require "limax.base.choice"
local defaults = require "limax.settings.defaults"
local experiment_fields = require "limax.tools.reference.experiment_fields"
local host = require "limax.host"
local limax = require "limax"
local process = require "support.process"
local source = require "limax.base.source"

local suite = require("limax.test").suite "api"

local function listed(list, name)
  for _, each in ipairs(list) do
    if each == name or each.short == name then return true end
  end
  return false
end

-- The public names of a table that a group lacks.
local function missing(group, names)
  local list = {}
  for _, name in ipairs(names) do
    if not listed(group.list, name) then list[#list + 1] = group.prefix .. name end
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

suite:test("the options of a simulation list every field that one takes", function(t)
  local fields = {}
  for _, field in ipairs(api.tables()["limax.robot.simulate_options"].fields) do
    fields[field.name] = true
  end
  for _, name in ipairs(require("limax.settings.settings").names) do
    t:ok(fields[name], name .. " is not listed in lib/robot/prepared.lua")
  end
end)

suite:test("tables that public names mention have their fields listed", function(t)
  local by_name = api.tables()
  for _, name in ipairs { "limax.generation", "limax.limit", "limax.robot.energy_balance",
    "limax.robot.block", "limax.run.options" } do
    t:ok(by_name[name], name .. " is not among them")
  end
  t:equal(by_name["limax.scored_robot"], nil) -- has entries of its own

  -- a real generation has the fields that are listed, and no others
  local entry, fields = {}, {}
  for _, memory in ipairs {
    { survival = "age_fitness", archive = { "novelty", descriptors = { "voxel_share" } } },
    { survival = { "nsga2", objectives = { "fitness", "-mass" } },
      genome = { mutation = "self_adaptive" } },
  } do
    local run = limax.start(limax.experiment { fitness = function() return 1, { one = 1 } end,
      lattice = { 2, 2, 2 }, population = 4, generations = 2, repetitions = 1,
      islands = { count = 2, migrants = 1 }, supervisor = function() error "no idea" end,
      survival = memory.survival, archive = memory.archive, genome = memory.genome,
      simulation = { duration = 0.1, settle = 0, accuracy = "preview" } },
      { device = "cpu", say = function() end })
    for name, value in pairs(run:finish()[2]) do entry[name] = value end
  end
  entry.population = true -- of a generation that is read
  for _, field in ipairs(by_name["limax.generation"].fields) do
    fields[field.name] = true
    t:ok(entry[field.name] ~= nil, "a generation has no " .. field.name)
  end
  for _, key in ipairs(choice.sorted_keys(entry)) do
    t:ok(fields[key], ("history[n].%s is not described: add it to scripts/lib/settings/records.lua")
      :format(key))
  end
end)

suite:test("every entry has a text, and its comment describes its arguments", function(t)
  for _, entry in ipairs(api.entries()) do
    t:ok(#entry.what >= 4, entry.name .. " has no text")
    local described = {}
    for i, param in ipairs(entry.doc and entry.doc.params or {}) do described[i] = param.name end
    for _, argument in ipairs(entry.doc and entry.doc.arguments or {}) do
      t:ok(listed(described, argument), ("%s: %s is not described"):format(entry.name, argument))
    end
    for _, name in ipairs(described) do
      t:ok(name == "..." or listed(entry.doc.arguments, name),
        ("%s has no argument %s"):format(entry.name, name))
    end
  end
end)

suite:test("every example runs at the prompt", { limit = 300 }, function(t)
  local folder = t:folder()
  process.write(folder .. "/mine.lua", "return { answer = 42 }\n")
  -- what examples of supervisors read: a finished run
  process.write(folder .. "/walk.lua", [[
return require("limax").experiment { name = "walk", fitness = "walk", generations = 2,
  repetitions = 1, simulation = { duration = 0.1, settle = 0 }, supervisor = "random" }
]])
  os.execute(("cd %s; %s run walk.lua -q >/dev/null 2>&1"):format(process.quote(folder),
    process.quote(host.executable)))
  for _, group in ipairs(api.groups()) do
    local lines = { group.stage or "" }
    for _, entry in ipairs(group.list) do
      -- an expression is muted; statements are as they stand
      lines[#lines + 1] = entry.example
    end
    process.write(folder .. "/input", table.concat(lines, "\n") .. "\n")
    local pipe = io.popen(("cd %s; TERM=dumb %s repl <input 2>&1 >output; echo status $?"):format(
      process.quote(folder), process.quote(host.executable)))
    t:equal(("%s: %s"):format(group.title, pipe:read "*a"), group.title .. ": status 0\n")
    pipe:close()
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

suite:test("an error about an argument names no line of limax", { limit = 300 }, function(t)
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

suite:test("fields of an experiment are those that it takes", function(t)
  -- the fields of a group of the experiment, or of its own, from the message about an unknown one
  local function accepted(group)
    local wrong = { qqqqqqqqqqqqqqqq = 1 }
    if group then wrong = { [group] = wrong } end
    wrong.fitness = "walk"
    local _, message = pcall(limax.experiment, wrong)
    return message:match "known are: (.*)$"
  end
  local function names_of(list)
    local names = {}
    for i, option in ipairs(list) do names[i] = option.name end
    return table.concat(names, ", ")
  end
  t:equal(names_of(experiment_fields.list()), accepted())
  for _, option in ipairs(experiment_fields.list()) do
    if option.fields and option.name ~= "scene" and option.name ~= "record" then
      t:equal(option.name .. ": " .. names_of(option.fields),
        option.name .. ": " .. accepted(option.name))
    end
  end
end)

suite:test("words that a comment lists are those that the code takes", function(t)
  local class = annotations.of("scripts/lib/robot/prepared.lua")
    .classes["limax.robot.simulate_options"]
  local types = {}
  for _, field in ipairs(class.fields) do types[field.name] = field.type end
  for name, list in pairs { integrator = defaults.integrators, precision = defaults.precisions } do
    t:equal(types[name], '"' .. table.concat(list, '"|"') .. '"')
  end
  for word in types.accuracy:gmatch '"(%w+)"' do t:ok(defaults.tiers[word], word) end
end)

suite:test("the generated pages are up to date", function(t)
  for _, name in ipairs { "page", "run_folder_page" } do
    local page = require("limax.tools.reference." .. name)
    t:ok(source.read(host.home .. "/" .. page.path) == page.text(),
      page.path .. " is out of date: run limax scripts/dev/reference.lua")
  end
end)
