--- fixed.lua: the supervisor that changes nothing: the control that every other one is measured
--- against.

return {
  options = {},
  make = function()
    return function() return nil, "fixed parameters" end
  end,
}
