--- view.lua: arrays of the engine.

return {
  title = "An array",
  text = "Traces, genomes, positions: `view[i][j]` reads, indices count from 1.",
  file = "bindings/engine/view.lua", class = "limax.view", prefix = "view:", holder = "methods:",
  stage = 'walked = limax.robot { voxels = "ecs" }:simulate { duration = 0.2, '
    .. "record = { center_of_mass = 50 } }\nview = walked:trace 'center_of_mass'",
  entries = {
    { "size", "elements", "view:size()" },
    { "copy", "the array's", "view:copy()" },
    { "table", "the array's", "view:table()[1]" },
    { "pointer", "elements", "view:pointer()" },
    { "shape", "elements", "view.shape" },
    { "unit", false, "view.unit" },
    { "rate", "Hz", "view.rate" },
    { "samples", "samples", "view.samples" },
  },
}
