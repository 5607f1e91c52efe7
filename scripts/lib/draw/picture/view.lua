--- view.lua: projections of { along, away, up }, m, to the page: right and up, m.

local view = {}

---@class limax.picture.view
---@field project fun(p: number[]): number, number right and up, m
---@field sight number[] direction away from the viewer: points along it coincide on the page
---@field shadow boolean is the ground seen, so that a shadow shows?
---@field short number what a metre along the path takes on the page, m

local HALF, THIRD, SIXTH = math.sqrt(1 / 2), math.sqrt(2 / 3), math.sqrt(1 / 6)
-- oblique: how far a metre away from the viewer moves a point to the right and up
local RECEDE_X, RECEDE_Y = 0.36, 0.22
-- the profile looks down a little, so that floors are not edge-on
local TILT = 0.08

--- Views to choose from.
view.names = { "side", "top", "iso" }

---@type table<string, limax.picture.view>
view.of = {
  -- oblique: along and up are true to scale
  side = { sight = { -RECEDE_X, 1, -RECEDE_Y }, shadow = true, short = 1,
    project = function(p) return p[1] + RECEDE_X * p[2], p[3] + RECEDE_Y * p[2] end },
  top = { sight = { 0, 0, -1 }, shadow = false, short = 1,
    project = function(p) return p[1], p[2] end },
  -- isometric: the three axes equally short
  iso = { sight = { 1, 1, -1 }, shadow = true, short = THIRD,
    project = function(p)
      return (p[1] - p[2]) * HALF, p[3] * THIRD + (p[1] + p[2]) * SIXTH
    end },
  profile = { sight = { 0, 1, -TILT }, shadow = false, short = 1,
    project = function(p) return p[1], p[3] + TILT * p[2] end },
}

return view
