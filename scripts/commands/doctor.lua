--- doctor.lua: `limax doctor`: lists what this machine has and what is missing, and checks the
--- simulation.

local ffi = require "ffi"
local engine = require "limax.engine"
local failure = require "limax.base.failure"
local host = require "limax.host"
local llm_client = require "limax.supervise.llm.client"
local output = require "limax.base.output"
local passes = require "limax.tools.console.passes"
local script = require "limax.base.script"
local settings = require "limax.settings.settings"
local terminal = require "limax.base.terminal"
local tiers = require "limax.settings.tiers"

-- programs that limax or its developers use if they are installed
local TOOLS = {
  { "ffmpeg", "animations as MP4" },
  { "mpirun", "one run on several machines" },
  { "valgrind", "the tests that count instructions" },
  { "clang-format", "the C++ linter", "clang-format-14" },
  { "luacheck", "the Lua linter" },
}

-- the library of the NVIDIA driver
local DRIVER = "libcuda.so.1"

-- of the 256 colours of terminals
local GREEN, RED, YELLOW = 34, 160, 136

local command = {
  summary = "show what this machine offers and what is missing",
  usage = "limax doctor [--json] [--llm]",
  text = "Exits with 1 if a self check fails; a missing tool or GPU is not a failure.\n"
    .. "--llm asks the language model at LIMAX_LLM_URL one short question, and fails without an\n"
    .. "answer. Nothing is sent without it.",
  options = {
    { name = "json", text = "print one JSON object" },
    { name = "llm", text = "ask the language model one short question" },
  },
}

-- Where the data folder was found, in the order in which the host looks.
local function home_origin()
  local variable = os.getenv "LIMAX_HOME"
  if variable and variable ~= "" then return "from LIMAX_HOME" end
  local above = host.executable:match "^(.*)/[^/]*/[^/]*$" or ""
  if host.home == above .. "/share/limax" then return "beside the executable" end
  if host.home == above then return "above the executable" end
  return "the source tree of the build"
end

-- The path of the first of these programs that is in PATH.
local function program(...)
  for _, name in ipairs { ... } do
    for folder in (os.getenv "PATH" or ""):gmatch "[^:]+" do
      local path = ("%s/%s"):format(folder, name)
      if host.file.exists(path) == "file" then return path end
    end
  end
  return nil
end

local function tools()
  local list = {}
  for i, tool in ipairs(TOOLS) do
    list[i] = { name = tool[1], purpose = tool[2], path = program(tool[1], tool[3]) }
  end
  return list
end

-- A simulation of one body of all materials that fills a lattice.
local function simulation_of(config, scene, device, options)
  local materials = engine.materials(config.materials)
  local population = engine.population { lattice = config.lattice, count = 1 }
  local voxels = {}
  for i = 1, population.voxels_each do voxels[i] = 1 + i % (materials.count - 1) end
  population:set_body(1, voxels)
  population:check(materials)
  return engine.simulation(population, materials, engine.scene(scene), options, device)
end

-- Drops a full 5x5x5 body for a second: its centre of mass must fall g t^2 / 2.
local function self_check(device)
  local gravity, seconds = 9.81, 1 -- m/s^2, s
  local simulation = simulation_of({ lattice = { 5, 5, 5 }, materials = "paper" },
    { gravity = { acceleration = { 0, 0, -gravity } } }, device,
    { duration = seconds, settle = 0, position = { 0, 0, 10 } })
  local started = host.clock()
  local progress = simulation:run()
  local took = host.clock() - started
  local outcome = simulation:outcome(1)
  local fallen = outcome.center_start[3] - outcome.center_end[3]
  local expected = gravity * seconds ^ 2 / 2
  -- compensated single precision over some thousand steps
  local passed = outcome.status == "done" and math.abs(fallen - expected) < 1e-4 * expected
  return { passed = passed, fallen = fallen, expected = expected, status = outcome.status,
    springs_per_second = progress.spring_steps / took }
end

-- Why this folder cannot be written; nil if it can.
local function unwritable(folder)
  if folder == "" then return "neither XDG_CACHE_HOME nor HOME names a folder" end
  local written, message = host.file.mkdir(folder)
  local probe = folder .. "/.doctor"
  if written then written, message = host.file.write_atomic(probe, "") end
  if written then written, message = host.file.remove(probe) end
  return not written and message or nil
end

-- The kernel of the scene of walk.lua.
local function walk_kernel(device)
  local config = script.run(host.home .. "/scripts/experiments/walk.lua").config
  return simulation_of(config, config.scene, device,
    settings.engine_options(config.simulation, config.record)):describe()
end

-- The CUDA device and its kernels, or why there is none.
local function gather_cuda()
  local fine, device = failure.attempt(engine.device, "cuda")
  if not fine then
    local reason = failure.bare(device):gsub("^device 'cuda': ", ""):gsub("; use 'cpu' or .-$", "")
    return { cuda_missing = reason }
  end
  local about = device:describe()
  local facts = { cuda = about.cuda, gpus = about.gpus, gpus_too_old = about.gpus_too_old,
    nvrtc = about.nvrtc, kernel_cache = about.kernel_cache,
    kernel_cache_unwritable = unwritable(about.kernel_cache),
    kernels_allowed = os.getenv "LIMAX_KERNELS" }
  local kernel
  fine, kernel = failure.attempt(walk_kernel, device)
  facts.walk_kernel = fine and kernel or nil
  facts.walk_kernel_missing = not fine and failure.bare(kernel) or nil
  fine, facts.self_check_cuda = failure.attempt(self_check, device)
  if not fine then
    facts.self_check_cuda = { passed = false, failed = failure.bare(facts.self_check_cuda) }
  end
  return facts
end

-- The accuracy tiers with their measurements, on the device that `auto` chooses.
local function gather_tiers(cpu)
  local fine, gpu = failure.attempt(engine.device, "cuda")
  local measured, list = tiers.measured(fine and gpu or cpu), {}
  for i, name in ipairs(tiers.NAMES) do
    list[i] = { name = name, what = tiers.describe(name), measured = measured and measured[name] }
  end
  return list
end

-- The language model that the environment names. Only with `ask` is anything sent: one short
-- question, for which a local server may have to load its model first.
local function gather_model(ask)
  local made, missing = llm_client.new { budget = 120 }
  if not made then return { configured = false, missing = missing } end
  local facts = made:describe()
  facts.configured = true
  if not ask then return facts end
  local answer, problem = made:ask({ { role = "user",
    content = 'Answer with this JSON object and nothing else: {"mutation_rate": 0.1}' } },
    { name = "proposal", schema = { type = "object", additionalProperties = false,
      required = { "mutation_rate" }, properties = { mutation_rate = { type = "number" } } } })
  facts.answered, facts.seconds = answer ~= nil, (answer or problem).seconds
  if problem then
    facts.failure = ("%s: %s"):format(problem.class, problem.message)
  else
    facts.form, facts.usage = answer.format, answer.usage
  end
  return facts
end

local function gather(ask)
  local environment = host.environment()
  local device = engine.device "cpu"
  local description = device:describe()
  local compiled, flags = jit.status(), {}
  for i = 2, select("#", jit.status()) do flags[i - 1] = (select(i, jit.status())) end
  local driver_opens, driver_missing = pcall(ffi.load, DRIVER)
  local facts = {
    version = host.version, commit = host.commit, build = environment.build,
    compiler = environment.compiler,
    executable = host.executable, home = host.home, home_found = home_origin(),
    system = environment.system, cpu = description.cpu, cores = environment.cores,
    threads = device.threads, threads_set = os.getenv "LIMAX_THREADS",
    isa = description.isa, isa_best = passes.best(description),
    isa_warning = passes.warning(description),
    cuda_compiler = environment.cuda_compiler, cuda_driver = driver_opens or false,
    cuda_driver_version = environment.cuda,
    cuda_driver_missing = not driver_opens and driver_missing or nil,
    luajit = jit.version, jit = compiled, jit_flags = table.concat(flags, " "),
    tools = tools(), self_check = self_check(device),
  }
  for name, fact in pairs(gather_cuda()) do facts[name] = fact end
  facts.tiers = gather_tiers(device)
  facts.llm = gather_model(ask)
  return facts
end

-- Prints the line about the language model.
local function model_line(facts, line)
  if not facts.configured then return line("", "LLM", "none: %s", facts.missing) end
  local text = ("%s, model %s, %s"):format(facts.endpoint, facts.model,
    facts.key and "key from " .. facts.key or "no key")
  if facts.answered == nil then
    line("ok", "LLM", "%s; not asked (--llm asks it)", text)
  elseif facts.answered then
    local used = facts.usage
    line("ok", "LLM", "%s; answered in %.1f s, form %s, %s", text, facts.seconds, facts.form,
      used and ("%d + %d tokens"):format(used.input_tokens, used.output_tokens)
      or "tokens not reported")
  else
    line("bad", "LLM", "%s; no answer after %.1f s: %s", text, facts.seconds, facts.failure)
  end
end

-- Prints the lines about GPUs.
local function cuda_lines(facts, line)
  if not facts.cuda then
    line("", "CUDA", "none: %s", facts.cuda_missing)
    return
  end
  line("ok", "CUDA", "%s, %d GPU%s; --device auto uses %s", facts.cuda, #facts.gpus,
    #facts.gpus == 1 and "" or "s", #facts.gpus == 1 and "it" or "them all")
  for _, gpu in ipairs(facts.gpus) do
    line("", ("GPU %d"):format(gpu.ordinal),
      "%s, compute capability %s, %d multiprocessors, %.1f GiB", gpu.name, gpu.capability,
      gpu.multiprocessors, gpu.memory / 2 ^ 30)
  end
  for _, gpu in ipairs(facts.gpus_too_old or {}) do
    line("", "GPU not used", "%s, compute capability %s is too old", gpu.name, gpu.capability)
  end
  local compiles = facts.nvrtc:match "^%d"
  line(compiles and "ok" or "warn", "NVRTC", "%s", compiles and facts.nvrtc
    or facts.nvrtc .. "; only scenes of the kernels that were built with limax run")
  if facts.kernels_allowed then line("", "LIMAX_KERNELS", "%s", facts.kernels_allowed) end
  local wrong = facts.kernel_cache_unwritable
  line(wrong and "warn" or "ok", "kernel cache", "%s", wrong
    and wrong .. "; kernels are compiled again in each run" or facts.kernel_cache)
  local kernel = facts.walk_kernel
  if kernel then
    line(kernel.spilled > 64 and "warn" or "ok", "walk kernel", "%s path, %s (%s), %d registers, "
      .. "%d bytes spilled, %d instructions, %d blocks per multiprocessor", kernel.path,
      kernel.origin, kernel.architecture, kernel.registers, kernel.spilled, kernel.instructions,
      kernel.blocks_of_multiprocessor)
  else
    line("bad", "walk kernel", "%s", facts.walk_kernel_missing)
  end
end

local function check_line(check, where, line)
  if check.failed then
    line("bad", "self check", "%s: %s", where, check.failed)
    return
  end
  line(check.passed and "ok" or "bad", "self check",
    "%s: a body of 125 voxels fell %.5f m in 1 s (%.5f expected); %.2g springs/s", where,
    check.fallen, check.expected, check.springs_per_second)
end

local function show(facts)
  local style = terminal.style()
  local marks = {
    ok = terminal.paint("ok  ", GREEN, style), warn = terminal.paint("warn", YELLOW, style),
    bad = terminal.paint("FAIL", RED, style), [""] = "    ",
  }
  local function line(mark, label, value, ...)
    output.write(("%s  %-13s %s\n"):format(marks[mark], label, value:format(...)))
  end
  local release = facts.build == "Release" or facts.build == "RelWithDebInfo"
  line(release and "ok" or "warn", "limax", "%s%s, %s build by %s%s", facts.version,
    facts.commit and ", commit " .. facts.commit or "", facts.build, facts.compiler,
    release and "" or ": several times slower than a Release build")
  line("", "executable", "%s", facts.executable)
  line("", "data folder", "%s (%s)", facts.home, facts.home_found)
  line("", "system", "%s", facts.system)
  line("", "processor", "%s, %d cores", facts.cpu, facts.cores)
  line(facts.isa_warning and "warn" or "ok", "CPU passes", "%s",
    facts.isa_warning or facts.isa .. ", the best for this processor")
  line("", "threads", "%d%s", facts.threads,
    facts.threads_set and facts.threads_set ~= "" and " (from LIMAX_THREADS)" or "")
  cuda_lines(facts, line)
  line(facts.cuda_compiler and "ok" or "", "CUDA compiler", "%s", facts.cuda_compiler
    and facts.cuda_compiler .. " at build time" or "no nvcc at build time")
  line(facts.cuda_driver and "ok" or "", "CUDA driver", "%s", facts.cuda_driver
    and DRIVER .. " can be opened" .. (facts.cuda_driver_version
      and ("; %s"):format(facts.cuda_driver_version) or "")
    or "none: " .. facts.cuda_driver_missing)
  line(facts.jit and "ok" or "warn", "Lua", "%s, compiler %s%s", facts.luajit,
    facts.jit and "on" or "off: scripts are about ten times slower",
    facts.jit and (" (%s)"):format(facts.jit_flags) or "")
  for _, tier in ipairs(facts.tiers) do
    line(tier.measured and "ok" or "", tier.name, "%s: %s", tier.what, tiers.price(tier.measured))
  end
  model_line(facts.llm, line)
  for _, tool in ipairs(facts.tools) do
    line(tool.path and "ok" or "", tool.name, "%s", tool.path or "not found; for " .. tool.purpose)
  end
  check_line(facts.self_check, "one CPU thread", line)
  if facts.self_check_cuda then check_line(facts.self_check_cuda, "one robot on CUDA", line) end
end

--- Runs the command.
function command.run(arguments)
  local facts = gather(arguments.llm)
  if arguments.json then
    output.write(host.json.encode(facts, { indent = 2 }), "\n")
  else
    show(facts)
  end
  local on_cuda = facts.self_check_cuda
  local fine = facts.self_check.passed and (not on_cuda or on_cuda.passed)
    and (not arguments.llm or facts.llm.answered)
  return fine and 0 or 1
end

return command
