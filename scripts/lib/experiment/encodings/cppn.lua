--- cppn.lua: a compositional pattern-producing network of fixed topology: it reads a voxel's centre
--- (x, y, z and the distance from the middle), and its hidden units have periodic, Gaussian and
--- other activations, which repeat and mirror patterns. Stanley, "Compositional pattern producing
--- networks: a novel abstraction of development", 2007.

return {
  fields = { hidden = true, initial_scale = true },
  make = function() return { network = "cppn" } end,
}
