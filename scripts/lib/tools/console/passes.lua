--- passes.lua: warns when a device simulates with slower loops than this processor can run.

local passes = {}

--- The best instruction set of this processor; nil for other devices.
---@param description table of `device:describe()`
function passes.best(description)
  return description.isa_available and description.isa_available:match "^[^,]+"
end

--- The warning; nil if the best loops run.
function passes.warning(description)
  local isa, best = description.isa, passes.best(description)
  if not isa then return nil end
  if isa ~= best then return ("%s, though this processor has %s"):format(isa, best) end
  if isa ~= "baseline" then return nil end
  return isa .. ": this processor has no AVX2 and FMA; simulations are more than ten times slower "
    .. "than with them"
end

return passes
