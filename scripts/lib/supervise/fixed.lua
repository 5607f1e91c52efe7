--- fixed.lua: changes nothing: the control for all other supervisors, as in the paper (Zhang,
--- 2024), whose runs without a model keep their parameters.

return {
  options = {},
  by_generation = true,
  changes = function() return {} end,
  make = function()
    return function() return nil, "fixed parameters" end
  end,
}
