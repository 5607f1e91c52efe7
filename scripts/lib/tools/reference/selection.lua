--- selection.lua: the library's selection schemes.

local function scheme(name, options)
  local text = ('{ "%s"%s }'):format(name, options and ", " .. options or "")
  return { name, false, "limax.selection.get " .. text, at = "selection.entries." .. name,
    signature = "selection = " .. text }
end

return {
  title = "limax.selection",
  text = 'Selection schemes: `selection = "rank"`, or `{ "tournament", size = 3 }`.',
  file = "scripts/lib/experiment/selection.lua", prefix = "limax.selection.", holder = "selection.",
  keys = "entries",
  entries = {
    scheme("truncation", "share = 0.5"),
    scheme("tournament", "size = 3"),
    scheme("rank", "pressure = 1.8"),
    scheme("roulette"),
    scheme("lexicase", 'epsilon = "mad"'),
    { "get", false, 'limax.selection.get "rank"' },
    { "entries", false, "limax.selection.entries.rank", signature = "limax.selection.entries",
      what = "Options of each scheme, by its name." },
  },
}
