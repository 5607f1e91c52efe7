--- robots.lua: the section of robots: generation 0 and the last, up to four side by side, as film
--- strips and, if Debian's three.js was found when limax was configured, in 3D.

local base64 = require "limax.base.base64"
local failure = require "limax.base.failure"
local sheet = require "limax.draw.sheet"
local host = require "limax.host"
local html = require "limax.tools.report.html"
local replay = require "limax.tools.report.replay"
local motion = require "limax.draw.motion"
local robot = require "limax.robot.robot"
local runs = require "limax.tools.report.runs"
local source = require "limax.base.source"
local world = require "limax.draw.picture.world"

local robots = {}

-- More than these do not fit side by side.
local MOST = 4
-- Trials that are shown of each robot.
local MOST_TRIALS = 4

-- Faces of a body from which on film strips are pixels: the lines of 50x50x50 voxels are 6 MB.
local MOST_FACES = 2000

-- The files of three.js, in the order in which they run.
local FILES = { "three.min.js", "OrbitControls.js" }

--- The folder into which three.js was copied when limax was configured; nil if it was not there.
function robots.javascript()
  local beside = source.folder_of(host.executable)
  for _, folder in ipairs { host.home .. "/javascript", beside .. "/share/limax/javascript" } do
    if host.file.exists(folder .. "/" .. FILES[2]) == "file" then return folder end
  end
end

-- Which champions to show: { arm, run, line }.
local function chosen(list)
  local picks, all = {}, #list <= MOST / 2
  for k = 1, math.min(#list, MOST - 1) do
    local run = runs.leading(list[k].runs)
    -- arms of the same seed begin alike: of many, one of generation 0 is enough
    if (all or k == 1) and #run.lines > 1 then
      picks[#picks + 1] = { arm = list[k], run = run, line = run.lines[1] }
    end
    picks[#picks + 1] = { arm = list[k], run = run, line = runs.result(run) }
  end
  return picks
end

-- Simulates a champion again, once for each of its trials, and adds { name, score, walked }; score
-- is its fitness and what else the fitness returned. `say` gets the reason where it cannot.
local function add(shown, pick, options)
  local run, line = pick.run, pick.line
  local fine, walker = failure.attempt(robot, runs.champion(run, line))
  local trials = fine and walker.description.trials
  for k = 1, trials and math.min(#trials, MOST_TRIALS) or 1 do
    local walked, why = nil, not fine and failure.bare(walker)
    local name = ("%s, generation %d%s"):format(runs.title(pick.arm, run), line.generation,
      trials and (", trial %d"):format(k) or "")
    if fine then
      fine, walked, why = failure.attempt(motion.simulate, walker,
        { device = options.device, trial = trials and k,
          progress = function() options.progress("simulating " .. name) end })
      if not fine then walked, why = nil, failure.bare(walked) end
    end
    if walked then
      shown[#shown + 1] = { name = name, score = runs.score_text(run, line), walked = walked }
    elseif options.say then
      options.say(("%s is not shown: %s"):format(name, why))
    end
  end
end

local CONTROLS = [[
<div class="controls" role="group" aria-label="playback of all robots">
<button type="button" id="play" aria-pressed="false">play</button>
<label for="time">time</label>
<input id="time" type="range" min="0" max="1" step="0.01" value="0">
<span id="clock">0.00 s</span>
<label>speed <select id="speed"><option value="0.25">1/4</option><option value="0.5">1/2</option>
<option value="1" selected>1</option><option value="2">2</option></select></label>
<label><input id="follow" type="checkbox" checked> follow</label>
<button type="button" id="reset">reset view</button>
</div>
<p class="note">Drag a robot to turn it. Turn the wheel, or spread two fingers, to zoom.</p>
<p class="note" id="key"></p>
]]

local function viewer(shown)
  local parts = { '<div class="robots">\n', CONTROLS, '<div class="views">\n' }
  for _, each in ipairs(shown) do
    local walked = each.walked
    local about = ("%s; moved %.3f m in %.4g s, %.3f m/s"):format(each.score, walked:distance(),
      walked:duration(), walked:speed())
    local words = world.words(world.of(walked.context.scene))
    if words ~= "" then about = about .. "; " .. words end
    parts[#parts + 1] = ('<div class="view"><h3>%s</h3><canvas role="img" aria-label="%s: %s">'
      .. "</canvas>"
      .. '<p class="note">%s</p><script type="text/plain">%s</script></div>\n'):format(
      html.escaped(each.name), html.escaped(each.name), html.escaped(about), html.escaped(about),
      replay.packed(walked))
  end
  parts[#parts + 1] = "</div></div>\n"
  return table.concat(parts)
end

-- The film strip of a robot, as pixels where it would have very many lines.
local function strip_of(each, name, k)
  local many = #motion.body(each.walked).faces > MOST_FACES
  local drawn = sheet.film_strip(each.walked, { title = each.name, facts = each.score,
    prefix = ("strip%d-"):format(k), kind = many and "png" or "svg" })
  return many and ('<img alt="film strip of %s" src="data:image/png;base64,%s">'):format(name,
    base64.encode(drawn)) or drawn
end

--- The section's body and the scripts that it needs.
function robots.section(list, options)
  local shown = {}
  for _, pick in ipairs(chosen(list)) do add(shown, pick, options) end
  return robots.side_by_side(shown)
end

--- The same of simulated robots.
---@param shown { name: string, score: string, walked: limax.scored_robot }[]
function robots.side_by_side(shown)
  if #shown == 0 then return { body = "", scripts = {} } end
  local strips = {}
  for k, each in ipairs(shown) do
    local name = html.escaped(each.name)
    strips[k] = ('<figure class="figure-row" tabindex="0" aria-label="film strip of %s">'
      .. "<h3>%s</h3>%s</figure>\n"):format(name, name, strip_of(each, name, k))
  end
  local folder, parts, scripts = robots.javascript(), {}, {}
  if folder then
    for k, name in ipairs(FILES) do scripts[k] = assert(source.read(folder .. "/" .. name)) end
    scripts[#scripts + 1] = html.read "viewer.js"
    parts[1] = viewer(shown)
  else
    parts[1] = '<p class="note">three.js was not found when limax was configured (on Debian: '
      .. "libjs-three), so robots are shown as film strips only.</p>\n"
  end
  parts[#parts + 1] = html.details("film strips", table.concat(strips), "strips")
  if folder then
    local licence = source.read(folder .. "/three.copyright") or ""
    parts[#parts + 1] = html.details("three.js draws the robots: its licence",
      "<pre>" .. html.escaped(licence) .. "</pre>")
  end
  return { body = table.concat(parts), scripts = scripts }
end

return robots
