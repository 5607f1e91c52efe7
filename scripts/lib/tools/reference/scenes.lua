--- scenes.lua: ready scenes.

return {
  title = "limax.scenes",
  text = "Ready scenes; effects handed over replace a scene's own, false removes them.",
  file = "scripts/lib/settings/scenes.lua", prefix = "limax.scenes.", holder = "scenes.",
  entries = {
    { "land", false, "limax.scenes.land { friction = false }" },
    { "air", false, "limax.scenes.air { gravity = false }" },
    { "water", "buoyancy 1", "limax.scenes.water { buoyancy = 0.9 }" },
    { "slope", "rad, m/s^2", "limax.scenes.slope { angle = math.rad(10) }" },
    { "stairs", "m", "limax.scenes.stairs { step = 0.05, depth = 0.3, count = 5 }" },
    { "corner", "m", "limax.scenes.corner { distance = 1 }" },
    { "rough", "m", "limax.scenes.rough({ roughness = 0.05, seed = 1 }).terrain.spacing" },
  },
}
