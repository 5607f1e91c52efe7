--- engine_simulation.lua: the engine's simulations.

return {
  title = "A simulation",
  text = "What `limax.engine.simulation` gives: many robots in one scene over time.",
  file = "bindings/engine/simulation.lua", class = "limax.simulation", prefix = "simulation:",
  holder = "methods:",
  stage = 'materials = limax.engine.materials "paper"\n'
    .. "robots = limax.engine.population { lattice = { 2, 1, 1 }, count = 1 }\n"
    .. 'robots:set_body(1, { "e", "c" }, nil, materials)\nrobots:check(materials)\n'
    .. "scene = limax.engine.scene { gravity = true, ground = true, block = true }\n"
    .. "simulation = limax.engine.simulation(robots, materials, scene, { duration = 0.1, "
    .. "record = { center_of_mass = 50 } })",
  entries = {
    { "place", "m, m/s", "simulation:place(1, simulation:state(1))" },
    { "advance", "s", "simulation:advance(0.01, 5)" },
    { "run", false, "simulation:run()" },
    { "outcome", "s, m, kg, J", "simulation:outcome(1).status" },
    { "trace", "by kind; rate in Hz", 'simulation:trace(1, "center_of_mass")' },
    { "sites", false, "simulation:sites(1)" },
    { "state", "m, m/s", "simulation:state(1)" },
    { "block", "m", "simulation:block(1)" },
    { "describe", false, "simulation:describe().device" },
    { "count", "robots", "simulation.count" },
    { "record", "Hz", "simulation.record" },
    { "masses", "masses", "simulation.masses" },
  },
}
