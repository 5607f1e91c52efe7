--- passes.lua: says when a device simulates with slower loops than this processor could run, and
--- what that costs.

local passes = {}

--- The best set of passes that this processor runs; nil for a device that has none.
---@param description table what `device:describe()` says
---@return string|nil
function passes.best(description)
  return description.isa_available and description.isa_available:match "^[^,]+"
end

--- What a user should know before hours of computing; nil when all is well.
---@param description table what `device:describe()` says
---@return string|nil
function passes.warning(description)
  local isa, best = description.isa, passes.best(description)
  if not isa then return nil end
  if isa ~= best then return ("%s, though this processor has %s"):format(isa, best) end
  if isa ~= "baseline" then return nil end
  return isa .. ": this processor has no AVX2 and FMA; simulations are more than ten times slower "
    .. "than with them"
end

return passes
