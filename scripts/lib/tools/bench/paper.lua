--- paper.lua: what the paper's own scheme reaches, to hold ours against.

local paper = {}

--- Springs per second that the paper gives for its kernel (arXiv 2405.00698), and on what.
paper.SPRINGS_PER_SECOND, paper.GPU = 7.89e9, "RTX 3090"

--- A line that sets a rate beside the paper's figure. Another GPU, another year: the ratio is no
--- measure of the scheme alone.
---@param springs_per_second number
---@return string
function paper.beside(springs_per_second)
  return ("the paper's own figure is %.3g springs/s, on an %s; the fastest row above is %.1f times "
    .. "that"):format(paper.SPRINGS_PER_SECOND, paper.GPU,
    springs_per_second / paper.SPRINGS_PER_SECOND)
end

return paper
