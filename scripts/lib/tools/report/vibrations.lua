--- vibrations.lua: natural modes of the robots of a report, beside the frequency of their muscles.

local failure = require "limax.base.failure"
local html = require "limax.tools.report.html"
local modes = require "limax.robot.modes"
local vibration = require "limax.draw.vibration"
local view = require "limax.draw.picture.view"

local vibrations = {}

-- Modes that are shown, px of their picture and of a capital, and masses of a body at most: 2 s.
local COUNT, WIDTH, TEXT, MOST_MASSES = 6, 1000, 8, 2000

-- One robot: a line that is always seen, table and picture; nil where it has no modes.
local function of_robot(each, k)
  local fine, all, body = failure.attempt(modes.in_scene, each.robot, COUNT,
    { trial = each.trial })
  if not fine or #all == 0 then return nil end
  local columns, rows = modes.table(all)
  local drawn = vibration.sheet(all, body, { view = view.of.iso, width = WIDTH, text = TEXT })
  local title = "natural modes of " .. each.name
  return modes.verdict(all), ('<figure class="figure-row" tabindex="0" aria-label="%s">%s</figure>'
    .. "%s\n"):format(html.escaped(title), drawn:render("svg", { title = title,
    prefix = ("modes%d-"):format(k) }), html.table(columns, rows,
    ("%s: %s"):format(each.name, modes.words(all))))
end

--- What a report shows of the modes of its robots.
---@param shown limax.report.shown[]
---@return string
function vibrations.section(shown)
  local lines, parts = {}, {}
  for k, each in ipairs(shown) do
    if each.robot.body.masses <= MOST_MASSES then
      local verdict, text = of_robot(each, k)
      parts[#parts + 1] = text
      if verdict then lines[#lines + 1] = ("%s: %s"):format(each.name, verdict) end
    end
  end
  if #parts == 0 then return "" end
  local notes = {}
  for k, line in ipairs(lines) do
    notes[k] = '<p class="note">' .. html.escaped(line) .. "</p>\n"
  end
  return table.concat(notes) .. html.details("natural modes", table.concat(parts))
end

return vibrations
