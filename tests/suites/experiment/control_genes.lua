--- control_genes.lua: genes of control in runs, robot files and functions of a script. The suite
--- sets how many a scene has: no controller is needed.

local bytes = require "limax.base.bytes"
local control_genes = require "limax.settings.control_genes"
local evolution = require "support.evolution"
local limax = require "limax"
local process = require "support.process"
local reader = require "limax.run.reader"

local suite = require("limax.test").suite "genes of control"

-- Calls `work` while every scene has this many genes of control.
local function with_genes(count, work)
  local before = control_genes.of_scene
  control_genes.of_scene = function() return count end
  local ok, problem = pcall(work)
  control_genes.of_scene = before
  if not ok then error(problem, 0) end
end

local BODY = { voxels = "ec\nce\n\ns.\ns.", weights = { phase = 0.25 }, control = { 1, -0.5, 0.1 } }

suite:test("a run has them in genomes, metrics, champions and ledger, and resumes", function(t)
  with_genes(5, function()
    evolution.resumes(t, { genome = { control_spread = 0.5 }, supervisor = "random" })
    local folder = evolution.run(t:folder() .. "/run", { genome = { control_spread = 0.5 },
      supervisor = "random" })
    local first, last = evolution.metrics(folder)[1], evolution.metrics(folder)[3]
    t:ok(first.diversity.all.control > 0.2 and first.diversity.all.control < 1)
    t:equal(first.parameters.control_mutation_rate, 0.1)
    t:ok(last.parameters.control_mutation_scale ~= 0.1)
    local run = reader.read(folder)
    local champion = limax.robot(folder .. "/r01/champions/g0002.json")
    t:equal(#champion.description.control, 5)
    local index = last.champion.index
    local genome = bytes.unpack("float", run:genomes_of(1, 2, { [index] = true })[index])
    t:same_bits(champion.population:control(1), { unpack(genome, #genome - 4) })
    t:equal(champion:replay().fitness, champion.description.score)
    t:equal(run.config.genome.control_spread, 0.5)
  end)
  t:equal(evolution.small().config.breeding.control_mutation_rate, nil)
end)

suite:test("the engine, a function and the library's mutations change them by their own rates",
  function(t)
    local function own(robots)
      for _, i in ipairs(robots) do
        local genes, control = robots:genes(i), robots:control(i)
        for k = 1, #control do
          control[k] = 1
          t:equal(genes[#genes - #control + k], 1)
        end
      end
    end
    with_genes(4, function()
      for _, mutation in ipairs { "gaussian", "block", "self_adaptive", own } do
        local history = evolution.finished { genome = { mutation = mutation, crossover = "none" },
          breeding = { mutation_rate = 0, control_mutation_rate = 1 } }
        local population = history[2].population
        for i = 1, #population do
          local robot, parent = population[i], nil
          for _, each in ipairs(history[1].population) do
            if each.id == robot.parents[1] then parent = each.genome:table() end
          end
          local genome = robot.genome:table()
          for g = 1, robot.origin == "bred" and #genome or 0 do
            t:equal(genome[g] == parent[g], g <= #genome - 4)
          end
        end
      end
    end)
  end)

suite:test("a file of one robot gives its body to all, and only genes of control vary", function(t)
  local path = t:folder() .. "/body.json"
  limax.robot(BODY):save(path)
  with_genes(3, function()
    local history = evolution.finished { genome = { body = path, control_spread = 1 } }
    for _, entry in ipairs(history) do
      t:equal(entry.diversity.all.distinct, 1)
      t:equal(entry.diversity.all.genotype, nil)
      t:ok(entry.diversity.all.control > 0)
    end
    local robot = history[3].population[1]
    t:equal(robot.body.hash, limax.robot(path).body.hash)
    t:equal(robot:table().weights, limax.robot(path):table().weights)
    t:equal(#robot.genome, 3)
    for _, case in ipairs {
      { { genome = { body = path, encoding = "direct" } }, "remove genome.encoding" },
      { { genome = { body = path }, lattice = { 3, 2, 2 } }, "lattice: expected that of genome.body"
        .. ", { 2, 2, 2 }" },
      { { genome = { body = path .. "x" } }, "genome.body: there is no file" },
      { { genome = { body = path, initial_scale = 1 } }, 'the encoding "body" does not use it' },
    } do
      t:raises(case[2], function() evolution.small(case[1]) end)
    end
  end)
  for _, name in ipairs { "body", "control_spread" } do
    local genome = { body = name == "body" and path or nil, control_spread = name ~= "body" and 1
      or nil }
    t:raises(("genome.%s: it varies genes of control, and no scene"):format(name),
      function() evolution.small { genome = genome } end)
  end
  local notes = evolution.small({ breeding = { control_mutation_rate = 0.2 } }).notes
  t:ok(table.concat(notes):find("control_mutation_rate: a scene without genes of control does not"
    .. " use it", 1, true))
end)

suite:test("a robot by hand has them, and its file keeps every bit", function(t)
  local robot = limax.robot(BODY)
  local path = t:folder() .. "/robot.json"
  robot:save(path)
  local again = limax.robot(path)
  t:same_bits(again.population:control(1), robot.population:control(1))
  t:same_bits(again:edit(1, 1, 1, "b"):simulate({ duration = 0.1 }):table().control,
    robot.description.control and robot:table().control)
  again:save(path .. ".2")
  t:equal(process.read(path .. ".2"), process.read(path))
  local many = {}
  for k = 1, 4097 do many[k] = 0 end
  t:raises("control: expected a list of at most 4096 numbers, got 4097",
    function() limax.robot { voxels = "e", control = many } end)
  t:raises("control[2]: expected a number", function()
    limax.robot { voxels = "e", control = { 0, 1 / 0 } }
  end)
end)
