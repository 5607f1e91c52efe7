--- direct.lua: every voxel has genes of its own: one for each material, of which the largest wins,
--- and one for each weight, which passes through a logistic function. Nothing is regular unless it
--- evolves.

return {
  fields = { initial_scale = true },
  make = function() return { network = "direct" } end,
}
