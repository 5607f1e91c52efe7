--- fourier.lua: the paper's encoding: a network reads the Gaussian positional encoding of a voxel's
--- centre and gives its material and weights. The genes are its weights and biases; `genome` holds
--- the options of the network. Tancik et al., "Fourier features let networks learn high frequency
--- functions in low dimensional domains", NeurIPS 2020.

return {
  fields = { features = true, sigma = true, hidden = true, initial_scale = true },
  make = function() return { network = "fourier" } end,
}
