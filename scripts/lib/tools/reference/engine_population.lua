--- engine_population.lua: the engine's populations: genomes and bodies.

local bodies = "bindings/engine/bodies.lua"

return {
  title = "Genomes and bodies",
  text = "What `limax.engine.population` gives.",
  file = "bindings/engine/population.lua", class = "limax.population", prefix = "robots:",
  holder = "methods:", also = { bodies },
  stage = 'materials = limax.engine.materials "paper"\n'
    .. "coder = limax.engine.encoding { lattice = { 2, 2, 2 } }\n"
    .. "robots = limax.engine.population { count = 4, encoding = coder }\n"
    .. "robots:initialize()\nrobots:express(materials)",
  entries = {
    { "initialize", false, "robots:initialize()" },
    { "express", false, "robots:express(materials)" },
    { "check", false, "robots:check(materials)" },
    { "breed", "per gene", "limax.engine.population({ count = 4, encoding = coder }):breed(robots, "
      .. "{ { 1, 2 }, { 2, 3 }, { 3, 4 }, { 4, 1 } }, { mutation_rate = 0.1, mutation_scale = 0.1, "
      .. "crossover_rate = 0.4, seed = 1, repetition = 1, generation = 1 })" },
    { "genome", false, "robots:genome(1)" },
    { "genomes_array", false, "robots:genomes_array()" },
    { "genomes_bytes", "bytes", "#robots:genomes_bytes()" },
    { "set_genomes", false, "robots:set_genomes(robots:genomes_bytes())" },
    { "voxels", false, "robots:voxels(1)", file = bodies, at = "methods:voxels" },
    { "text", false, 'robots:text(1, ".ecsb")', file = bodies, at = "methods:text" },
    { "weights", "1", "robots:weights(1)", file = bodies, at = "methods:weights" },
    { "body", "voxels", "robots:body(1)", file = bodies, at = "methods:body" },
    { "set_body", false, 'robots:set_body(1, { "e", "c", "s", "b", "e", "c", "s", "b" }, nil, '
      .. "materials)", file = bodies, at = "methods:set_body" },
    { "diversity", "shares, 0 to 1", "robots:diversity { 1, 2, 3 }", file = bodies,
      at = "methods:diversity" },
    { "count", "robots", "robots.count" },
    { "genes", "numbers", "robots.genes" },
    { "lattice", "voxels", "robots.lattice" },
    { "free", false, "robots:free()" },
  },
}
