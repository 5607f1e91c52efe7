--- documentation.lua: compares the pages with the program: every field and unit of a run folder,
--- every Lua block, command line and file name.

local choice = require "limax.base.choice"
local conversion = require "support.conversion"
local evolution = require "support.evolution"
local faulty_server = require "support.faulty_server"
local field_page = require "support.field_page"
local host = require "limax.host"
local process = require "support.process"
local sealed = require "limax.base.sealed"
local source = require "limax.base.source"
local talker = require "support.talker"

local suite = require("limax.test").suite "documentation"

local PAGE = "scripts/RUN_FOLDER.md"
-- pages with Lua blocks, and with command lines
local WITH_LUA = { "README.md", "scripts/README.md", "scripts/WORLD.md", "scripts/EXTENDING.md",
  "scripts/EVOLUTION.md", "scripts/CONTROL.md" }
local READMES = { "scripts/GPU.md", unpack(WITH_LUA) }

local function text_of(path) return assert(source.read(host.home .. "/" .. path)) end

local write, completes = process.write, process.completes

-- ---- the page of the run folder -----------------------------------------------------------------

-- All traces, two trials, a fitness with cases and measures that fails for one robot, bodies
-- without a muscle, a supervisor with valid and invalid proposals for parameters and materials.
local RICH = [[
local limax = require "limax"
return limax.experiment {
  name = "rich", lattice = { 2, 2, 2 }, population = 24, generations = 4, repetitions = 2,
  genome = { sigma = 4, mutation = "self_adaptive" }, not_in_paper = { "everything" },
  simulation = { duration = 0.2, settle = 0.05, max_speed = SPEED },
  record = { center_of_mass = 20, position = 20, velocity = 20, contact = 20, energy = 20,
    strain = 20 },
  fitness = function(robot)
    if robot.id % 24 == 20 and robot.generation > 0 then return 0 / 0 end
    return robot:distance(), { robot:speed(), robot.body.mass, contact = robot:contact() }
  end,
  selection = function(population, random)
    return population.ranked[1], random:integer(#population)
  end,
  islands = { count = 3, every = 2 },
  archive = { "grid", descriptors = { "voxel_share", { "distance", range = { 0, 0.1 } } } },
  survival = { "plus", share = 0.3 }, state = function() return { sum = 0 } end,
  trials = { {}, { scene = limax.scenes.air { gravity = false }, materials = "paper",
    duration = 0.1, record = { contact = 0 } } },
  supervision = { materials = true, ranges = { mutation_rate = { 0.01, 0.2 } } },
  supervisor = function(history)
    return { mutation_rate = 0.09 + 0.01 * #history, population = 3,
      materials = { bone = { stiffness = 9000 } } }, "a try"
  end,
}
]]

-- Named choices, no trace, a fixed step, the other effects, and a seed above 2^53.
local PLAIN = [[
local limax = require "limax"
return limax.experiment {
  name = "plain", lattice = { 2, 2, 2 }, population = 6, generations = 2, repetitions = 2,
  simulation = { duration = 0.1, settle = 0, time_step = 1e-4 }, record = {},
  scene = { gravity = true, wind = true, anchors = true, planes = { {}, { offset = -1 } },
    spheres = true, boxes = true, terrain = true, self_collision = true },
  seed = "18446744073709551615",
  fitness = FITNESS, selection = "rank",
  supervisor = { "schedule", mutation_rate = { { 0, 0.1 }, { 1, 0.2 } } },
}
]]

-- A language model: a valid answer, a failure, an invalid answer.
local function answer(_, n)
  if n == 2 then
    return { class = "http", message = "HTTP 500", http_status = 500, attempts = 1 }
  end
  return { usage = { input_tokens = 800, output_tokens = 20 }, content = n == 1
    and '{"mutation_rate": 0.15, "reason": "why", "materials": {"bone": {"stiffness": 9000}}}'
    or '{"elites": 1}' }
end

local function run_script(t, base, name, text, words, status)
  write(("%s/%s.lua"):format(base, name), text)
  local done = process.ends(base, { "run", unpack(words) })
  t:ok(done.status == status, ("%s: status %d\n%s"):format(name, done.status, done.stderr))
end

-- Runs that together write every file and almost every optional field: their folders by name.
local function real_runs(t)
  local base = t:folder()
  run_script(t, base, "rich", RICH:gsub("SPEED", "1000"),
    { "rich.lua", "--out", "rich", "--set", "seed=2" }, 0)
  -- resumed with a speed limit that fast bodies exceed
  run_script(t, base, "rich", RICH:gsub("SPEED", "1"),
    { "--resume", "rich", "--changed", "--set", "generations=6" }, 0)
  -- a cut, and less than what is there
  completes(t, base, { "run", "--resume", "rich", "--from", "4", "-q" })
  run_script(t, base, "plain", PLAIN:gsub("FITNESS", '{ "distance", axis = "x" }'),
    { "plain.lua", "--out", "plain", "--repetition", "2" }, 0)
  run_script(t, base, "wrong", PLAIN:gsub("FITNESS", "function() return {} end"),
    { "wrong.lua", "--out", "wrong" }, 1)
  local talk = talker.run(t, { "llm", client = talker.new(answer), fallback = "fixed" },
    { supervision = { materials = true } })
  completes(t, base, { "report", "rich", "--no-robots" })
  return { rich = base .. "/rich", plain = base .. "/plain", wrong = base .. "/wrong",
    talk = talk.folder }
end

local function files_below(folder)
  return process.output(("cd '%s' && find . -type f -printf '%%P\n'"):format(folder))
end

-- The name of a file as in the page's table of files.
local function listed_as(name)
  return (name:gsub("^r%d%d/", "rNN/"):gsub("/g%d%d%d%d%.", "/gNNNN.")
    :gsub("^config%-%d", "config-N"):gsub("^scripts%-%d/.*", "scripts-N/FILE")
    :gsub("^scripts/.*", "scripts/FILE"):gsub("^prompts/%x+", "prompts/HASH"))
end

-- The headings of the objects that are compared.
local OBJECTS = { "config.json", "metrics.jsonl", "ledger.jsonl", "timing.jsonl", "Attempt",
  "Decision", "champions/gNNNN.json", "Journal: begin", "Journal: generation", "Journal: cut",
  "Journal: end" }

-- Files whose lines have kinds: how a line is read, and its section.
local KINDS = {
  ["journal.jsonl"] = function(row)
    local line = assert(sealed.open(row))
    local kind = line.kind
    -- whatever the script keeps
    line.kind, line.state = nil, line.state and true
    return line, "Journal: " .. kind
  end,
  ["transcript.jsonl"] = function(row)
    local line = assert(host.json.decode(row))
    return line, line.kind == "attempt" and "Attempt" or "Decision"
  end,
}

suite:test("a run folder has the files and fields of the page", function(t)
  local sections, trees = field_page.read(), {}
  for _, heading in ipairs(OBJECTS) do trees[heading] = field_page.tree(sections, heading) end
  -- file of the page -> run -> true
  local seen = {}
  for run, folder in pairs(real_runs(t)) do
    for name in files_below(folder):gmatch "[^\n]+" do
      local listed, text = listed_as(name), source.read(folder .. "/" .. name)
      seen[listed] = seen[listed] or {}
      seen[listed][run] = true
      local heading = listed:gsub("^rNN/", ""):gsub("^config%-N", "config")
      if trees[heading] or KINDS[listed] then
        for row in text:gmatch(listed:match "%.jsonl$" and "[^\n]+" or ".+") do
          local object, kind = (KINDS[listed] or host.json.decode)(row, name)
          field_page.compare(t, assert(object), trees[KINDS[listed] and kind or heading])
        end
      end
    end
  end

  local named = {}
  for _, row in ipairs(sections.Files) do
    for _, name in ipairs(row.names) do
      named[name] = true
      t:ok(seen[name], "no run has written " .. name)
      t:ok(seen[name].plain or row.optional, name .. " is missing in a plain run, but not optional")
    end
  end
  for _, name in ipairs(choice.sorted_keys(seen)) do
    t:ok(named[name], ("%s is not among the files of %s"):format(name, PAGE))
  end

  for _, heading in ipairs(OBJECTS) do
    field_page.each(trees[heading], function(field)
      -- `compare` checks the fields of an optional object that is present
      local inner = field.parent.optional and not field.parent.seen
      t:ok(field.seen or field_page.is_optional(field) or inner, field.path .. " is in no run")
    end)
  end
end)

-- ---- examples -----------------------------------------------------------------------------------

-- The fenced blocks of a page in one language, with their lines, text and place.
local function blocks(page, language)
  local list, block, number = {}, nil, 0
  for line in text_of(page):gmatch "(.-)\n" do
    number = number + 1
    local fence = line:match "^```(.*)$"
    if block and fence then
      block.text = table.concat(block.lines, "\n") .. "\n"
      if block.language == language then list[#list + 1] = block end
      block = nil
    elseif fence then
      block = { language = fence, place = ("%s:%d"):format(page, number), lines = {} }
    elseif block then
      table.insert(block.lines, line)
    end
  end
  return list
end

-- Words that make a documented experiment small, and choose its run folder, after its own.
local function small(words, name)
  -- a later command may read a folder that this one names
  local names_folder = choice.contains(words, "--out")
  for _, change in ipairs { "population=12", "generations=2", "repetitions=1", "lattice=[3,3,3]",
    "simulation.duration=0.4", "simulation.settle=0.1" } do
    words[#words + 1] = "--set=" .. change
  end
  if not names_folder then words[#words + 1] = "--out=runs/" .. name end
  return words
end

-- Runs the command lines in a page's blocks of a language, and returns their number.
local function run_lines(t, folder, page, language, program)
  local count = 0
  for _, block in ipairs(blocks(page, language)) do
    for _, line in ipairs(block.lines) do
      local words = {}
      for word in line:gsub("%s*#.*$", ""):gmatch "%S+" do
        -- the test runs in a folder of its own
        words[#words + 1] = word:find "^scripts/" and host.home .. "/" .. word or word
      end
      local named = table.remove(words, 1)
      -- quickstart.sh and test.sh install packages
      if named and not named:find "/scripts/dev/%l+%.sh$" then
        t:ok(named == program, ("%s: %s is not the built program"):format(page, line))
        count = count + 1
        if words[1] == "run" then words = small(words, page:gsub("%W", "_") .. count) end
        completes(t, folder, words, { what = block.place .. ": " .. line })
      end
    end
  end
  return count
end

for _, page in ipairs(WITH_LUA) do
  suite:test("every Lua block runs: " .. page, function(t)
    local folder, list = t:folder(), blocks(page, "lua")
    t:ok(#list > 0)
    for k, block in ipairs(list) do
      local text, file = block.text, ("block%d.lua"):format(k)
      write(folder .. "/" .. file, text)
      local words, expected = { file }, nil
      if text:find("limax.test", 1, true) then
        words, expected = { "test", file }, " passed, 0 failed, "
      elseif text:find "\nreturn limax%.experiment" then
        words, expected = small({ "run", file }, "block" .. k), "Run folder: "
      end
      local done = completes(t, folder, words, { what = block.place })
      t:ok(done.stdout:find(expected or "", 1, true), block.place .. ": " .. done.stdout)
    end
  end)
end

suite:test("every command line runs", function(t)
  local folder, count = t:folder(), 0
  for _, page in ipairs(READMES) do
    -- the experiments of the page
    for _, block in ipairs(blocks(page, "lua")) do
      local name = block.text:match 'name = "(.-)"'
      if name then write(("%s/%s.lua"):format(folder, name), block.text) end
    end
    count = count + run_lines(t, folder, page, "sh", "build/limax")
  end
  t:ok(count > 0)
end)

suite:test("the Python of the tutorial reads a run folder", function(t)
  local page, folder = "scripts/README.md", t:folder()
  for _, block in ipairs(blocks(page, "lua")) do
    if block.text:find 'name = "patient"' then write(folder .. "/patient.lua", block.text) end
  end
  completes(t, folder, small({ "run", "patient.lua", "--out", "runs/patient" }))
  conversion.python(t, folder, { "numpy", "pandas" }, blocks(page, "python")[1].text)
end)

suite:test("the client example of llm/README.md runs", function(t)
  local page = "scripts/lib/supervise/llm/README.md"
  local client, folder, server = blocks(page, "lua"), t:folder(), faulty_server.open(t)
  t:equal(#client, 1)
  write(folder .. "/block.lua", client[1].text)
  local done = completes(t, folder, { "block.lua" }, { what = client[1].place,
    before = "LIMAX_LLM_MODEL=played LIMAX_LLM_URL=" .. server:url "varied" })
  t:ok(done.stdout:find("\n1\thttp://127.0.0.1:", 1, true), done.stdout)
end)

suite:test("the commands of CONVERT.md run", function(t)
  local folder = t:folder()
  evolution.script(folder .. "/walk.lua")
  completes(t, folder, { "run", "walk.lua", "-q", "--out", "runs/walk-1" })
  completes(t, folder, { "convert", "runs/walk-1", "walker.vxa" })
  t:ok(run_lines(t, folder, "scripts/CONVERT.md", "text", "limax") >= 3)
end)

-- The anchors of a page's headings, as a reader's browser makes them.
local function anchors_of(page)
  local anchors = {}
  for heading in ("\n" .. source.read(page)):gmatch "\n#+ ([^\n]*)" do
    anchors[heading:lower():gsub("[^%w%-_ ]", ""):gsub(" ", "-")] = true
  end
  return anchors
end

suite:test("every file that a page names exists", function(t)
  for _, page in ipairs { "engine/README.md", "engine/PERFORMANCE.md", "engine/PHYSICS.md",
    "prompts/README.md", "scripts/lib/supervise/llm/README.md", "scripts/ACCURACY.md",
    "scripts/CONVERT.md", "scripts/RUN_FOLDER.md", "scripts/SUPERVISION.md",
    "scripts/CLUSTER.md", unpack(READMES) } do
    local base = host.home .. "/" .. (page:match "^(.*/)[^/]*$" or "")
    local text = text_of(page)
    local function check(path)
      t:ok(host.file.exists(base .. path) or host.file.exists(host.home .. "/" .. path),
        ("%s names %s, which does not exist"):format(page, path))
    end
    for path in text:gmatch "%]%(([^)#:]+)" do check(path) end
    for path, anchor in text:gmatch "%]%(([^)#:]*)#([^)]+)%)" do
      local other = path == "" and host.home .. "/" .. page or base .. path
      t:ok(anchors_of(other)[anchor], ("%s names %s#%s, which does not exist")
        :format(page, path, anchor))
    end
    for path in text:gmatch "`([%l_]+/[%w_/.]+)`" do
      local top = path:match "^[^/]+"
      if host.file.exists(base .. top) and top ~= "build" and top ~= "runs" then check(path) end
    end
  end
end)
