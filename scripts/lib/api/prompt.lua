--- prompt.lua: names that only the prompt of `limax repl` has.

return {
  title = "At the prompt",
  text = "Words of `limax repl`. `_` is the last value, `_1` to `_9` those before; a trailing `;` "
    .. "mutes; `?name` is help.",
  file = "scripts/lib/repl/words.lua",
  prefix = "", holder = "list.",
  entries = {
    { "who", false, "who()" },
    { "time", "s, printed", "time(limax.robot { voxels = 'ecs' })" },
    { "reload", false, 'reload "limax.scenes"' },
    { "follow", false, 'follow "mine.lua"' },
  },
}
