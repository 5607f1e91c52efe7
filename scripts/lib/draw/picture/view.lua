--- view.lua: how a picture looks at { along, away, up }, m: where a point falls on the page (right
--- and up, m), and which points fall on each other.

local skin = require "limax.draw.skin"

local view = {}

---@class limax.picture.view
---@field project fun(p: number[]): number, number right and up, m
---@field sight number[] points on such a line fall on each other; away from the eye
---@field shadow boolean is the ground seen from beside, so that a shadow shows?
---@field short number what a metre along the way takes on the page, m

local HALF, THIRD, SIXTH = math.sqrt(1 / 2), math.sqrt(2 / 3), math.sqrt(1 / 6)

view.names = { "side", "top", "iso" }

---@type table<string, limax.picture.view>
view.of = {
  -- oblique: what is along and up is true to scale
  side = { sight = { -skin.recede_x, 1, -skin.recede_y }, shadow = true, short = 1,
    project = function(p)
      return p[1] + skin.recede_x * p[2], p[3] + skin.recede_y * p[2]
    end },
  top = { sight = { 0, 0, -1 }, shadow = false, short = 1,
    project = function(p) return p[1], p[2] end },
  -- isometric: the three axes equally short
  iso = { sight = { 1, 1, -1 }, shadow = true, short = THIRD,
    project = function(p)
      return (p[1] - p[2]) * HALF, p[3] * THIRD + (p[1] + p[2]) * SIXTH
    end },
}

return view
