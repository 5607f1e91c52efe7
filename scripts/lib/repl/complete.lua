--- complete.lua: what Tab puts behind the cursor.

local complete = {}

--- What Tab does with a line.
---@return integer erase
---@return string|nil insert
---@return string|nil show
function complete.edit(_, _)
  return 0, nil, nil
end

return complete
