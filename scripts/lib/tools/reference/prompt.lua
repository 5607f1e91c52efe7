--- prompt.lua: names that only the prompt of `limax repl` has.

return {
  title = "At the prompt",
  text = "Words of `limax repl`. `_` is the last value, `_1` to `_9` those before; a trailing `;` "
    .. "mutes; `?name` is help.",
  file = "scripts/lib/tools/repl/words.lua", prefix = "", holder = "list.",
  stage = 'robot = limax.robot { voxels = "ecs\\nece\\n\\nsbs\\ncec" }\n'
    .. 'run = evolve({ fitness = "walk", lattice = { 2, 2, 2 }, population = 6, repetitions = 1, '
    .. "genome = { sigma = 4 }, simulation = { duration = 0.1 } }, 1)",
  entries = {
    { "who", false, "who()" },
    { "time", "s, printed", "time(robot:simulate { duration = 0.1 })" },
    { "plot", "the trace's own; time in s", "plot { 1, 4, 9, 16 }" },
    { "compare", "m, s", 'compare(robot, "cpu", { device = "cpu", precision = "double" })' },
    { "evolve", "best and mean in the fitness's unit, time in s", "evolve(run, 2)" },
    { "champion", "the fitness's", "champion(run)" },
    { "picture", "duration in s", 'picture(robot, "robot.svg", { duration = 0.2 })' },
    { "reload", false, 'reload "limax.scenes"' },
    { "follow", false, 'follow "mine.lua"' },
  },
}
