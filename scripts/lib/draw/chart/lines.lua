--- lines.lua: how the lines of a chart are told apart: colours and dashes, the same wherever arms
--- of a comparison or of a report are drawn.

local lines = {}

-- Okabe and Ito's colours, but for yellow, in an order whose greys differ; then the same with other
-- dashes.
local COLORS = { "#0072b2", "#d55e00", "#009e73", "#26282b", "#cc79a7", "#e69f00", "#56b4e9" }
local DASHES = { false, "6 3", "2 3" }

--- Colour and dash of the k-th of several lines.
---@param k integer
---@return string color
---@return string|nil dash
function lines.look(k)
  return COLORS[(k - 1) % #COLORS + 1],
    DASHES[(math.floor((k - 1) / #COLORS) + k - 1) % #DASHES + 1] or nil
end

return lines
