--- llm_loopback.lua: whole runs under the real client, against the misbehaving server on this
--- machine: they end, they replay without it, and the key is nowhere in what they leave.

local faulty_server = require "support.faulty_server"
local field_page = require "support.field_page"
local host = require "limax.host"
local process = require "support.process"
local source = require "limax.base.source"
local talker = require "support.talker"

local suite = require("limax.test").suite "llm loopback"

local KEY = "sk-sentinel-4f1d0c7ab93e52"

local EXPERIMENT = [[
local limax = require "limax"
return limax.experiment { name = "talk", lattice = { 2, 2, 2 }, population = 4, generations = 8,
  repetitions = 1, simulation = { duration = 0.06, settle = 0, accuracy = "preview" },
  fitness = "distance", supervisor = SUPERVISOR }
]]

-- Runs the experiment under this supervisor with the key in the environment.
local function run(t, folder, name, supervisor, environment)
  local text = EXPERIMENT:gsub("SUPERVISOR", (supervisor:gsub("%%", "%%%%")))
  assert(host.file.write_atomic(("%s/%s.lua"):format(folder, name), text))
  return process.completes(t, folder, { "run", name .. ".lua", "--out", name, "-q", "--set",
    "name=talk", "--device", "cpu" }, { before = "unset OPENAI_API_KEY LIMAX_LLM_MODEL"
    .. " LIMAX_LLM_KEY_FILE LIMAX_LLM_URL; export " .. (environment or "NOTHING=") .. ";" })
end

local function configured(server, scenario)
  return ("LIMAX_LLM_URL=%s LIMAX_LLM_MODEL=played LIMAX_LLM_KEY=%s"):format(server:url(scenario),
    KEY)
end

-- The key as it stands, in base64 and percent-encoded.
local function forms_of(key)
  local letters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/"
  local base64 = key:gsub("..?.?", function(three)
    local bits = 0
    for k = 1, 3 do bits = bits * 256 + (three:byte(k) or 0) end
    local four = ""
    for k = 3, 0, -1 do
      local at = math.floor(bits / 64 ^ k) % 64
      four = four .. letters:sub(at + 1, at + 1)
    end
    return #three == 3 and four or ""
  end)
  return { key, base64:sub(1, 24), (key:gsub("[^%w]", function(letter)
    return ("%%%02X"):format(letter:byte())
  end)), key:sub(4) }
end

local function search(t, folder, forms)
  local files = 0
  for _, name in ipairs(host.file.list(folder)) do
    local path = folder .. "/" .. name
    if host.file.exists(path) == "folder" then
      files = files + search(t, path, forms)
    else
      files = files + 1
      local text = source.read(path)
      for _, form in ipairs(forms) do
        t:ok(not text:find(form, 1, true), ("%s holds the key as %s"):format(path, form))
      end
    end
  end
  return files
end

suite:test("a run over loopback replays without the server, to the byte", { limit = 60 },
  function(t)
    local server, folder = faulty_server.open(t), t:folder()
    run(t, folder, "live", '{ "llm", fallback = "rules" }', configured(server, "varied"))
    server:close()
    local done = talker.read(folder .. "/live")
    t:equal(#talker.of_kind(done, "attempt"), 7)
    for generation = 1, 7 do t:equal(done.ledger[generation + 1].source, "model") end
    for _, line in ipairs(talker.of_kind(done, "attempt")) do
      t:equal({ line["gen_ai.request.model"], line["gen_ai.response.model"] },
        { "played", "played-1" })
      t:equal(line.http_status, 200)
    end
    local sections = field_page.read "scripts/RUN_FOLDER.md"
    field_page.compare_transcript(t, source.read(folder .. "/live/transcript.jsonl"),
      { Attempt = field_page.tree(sections, "Attempt"),
        Decision = field_page.tree(sections, "Decision") })
    for _, match in ipairs { "request", "generation" } do
      run(t, folder, match, ('{ "replay", run = "live", match = %q }'):format(match))
      for _, name in ipairs { "metrics.jsonl", "ledger.jsonl", "r01/population/g0007.jsonl",
        "r01/population/g0007.npy" } do
        t:ok(source.read(("%s/%s/%s"):format(folder, match, name))
          == source.read(("%s/live/%s"):format(folder, name)), name .. " differs")
      end
    end
  end)

suite:test("the key is in nothing that a run leaves or says", { limit = 120 }, function(t)
  local server, folder, forms = faulty_server.open(t), t:folder(), forms_of(KEY)
  for _, scenario in ipairs { "good", "f49_echo", "f49_echo_reset" } do
    local done = run(t, folder, scenario, '{ "llm", budget = 4 }', configured(server, scenario))
    for _, form in ipairs(forms) do
      t:ok(not (done.stdout .. done.stderr):find(form, 1, true), scenario)
    end
  end
  t:ok(server:counts().f49_echo.keys > 0, "the server should see the key")
  server:close()
  t:ok(search(t, folder, forms) > 60)
end)

suite:test("the shipped experiment runs, and replays as its file says", { limit = 60 }, function(t)
  local server, folder = faulty_server.open(t), t:folder()
  local script = host.home .. "/scripts/experiments/supervised.lua"
  local small = { "-q", "--device", "cpu", "--set", "population=6", "--set", "generations=4",
    "--set", "lattice=[3,3,3]", "--set", "simulation.duration=0.4" }
  process.completes(t, folder, { "run", script, "--out", "live", unpack(small) },
    { before = "export " .. configured(server, "varied") .. ";" })
  server:close()
  process.completes(t, folder, { "run", script, "--out", "again", "--set",
    'supervisor=["replay"]', "--set", "supervisor.run=live", unpack(small) })
  for _, name in ipairs { "metrics.jsonl", "ledger.jsonl" } do
    t:ok(source.read(folder .. "/again/" .. name) == source.read(folder .. "/live/" .. name), name)
  end
end)

suite:test("without an endpoint nothing begins", { limit = 30 }, function(t)
  local folder = t:folder()
  assert(host.file.write_atomic(folder .. "/none.lua", (EXPERIMENT:gsub("SUPERVISOR", '"llm"'))))
  local done = process.ends(folder, { "run", "none.lua", "--out", "r" },
    { before = "unset LIMAX_LLM_URL;" })
  t:equal(done.status, 2)
  t:ok(done.stderr:find('supervisor "llm": no endpoint of a language model is configured', 1, true),
    done.stderr)
  t:equal(host.file.exists(folder .. "/r"), nil)
  done = process.ends(folder, { "run", "none.lua", "--live-prompts", "--set", "supervisor=rules" })
  t:equal(done.status, 2)
  t:ok(done.stderr:find('the supervisor "rules" reads no prompts', 1, true), done.stderr)
end)
