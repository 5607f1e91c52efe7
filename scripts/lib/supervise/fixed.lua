--- fixed.lua: the supervisor that changes nothing: the control that every other one is measured
--- against, as in the paper (Zhang, 2024), whose runs without a model keep their parameters.

return {
  options = {},
  make = function()
    return function() return nil, "fixed parameters" end
  end,
}
