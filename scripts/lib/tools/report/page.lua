--- page.lua: `report.html`, one file that needs nothing else. Opened from disk it makes no request;
--- without scripts everything is shown except the robots that move.

local charts = require "limax.tools.report.charts"
local choice = require "limax.base.choice"
local engine = require "limax.engine"
local facts = require "limax.tools.report.facts"
local failure = require "limax.base.failure"
local host = require "limax.host"
local html = require "limax.tools.report.html"
local inline = require "limax.draw.chart.inline"
local lineage = require "limax.tools.report.lineage"
local outcome = require "limax.tools.compare.outcome"
local robots = require "limax.tools.report.robots"
local runs = require "limax.tools.report.runs"
local tables = require "limax.tools.compare.tables"
local verdict = require "limax.tools.compare.verdict"

local page = {}

-- More folders than these are counted, not listed; the table of results has all.
local MOST_LISTED = 6

local function section(id, title, ...)
  return ('<section id="%s" aria-labelledby="%s-title"><h2 id="%s-title">%s</h2>\n%s</section>\n')
    :format(id, id, id, html.escaped(title), table.concat { ... })
end

local function note(text) return '<p class="note">' .. html.escaped(text) .. "</p>\n" end

local function learning(list)
  if #list <= charts.MOST_ARMS then return "" end
  return note(("The populations and parameters of the first %d of %d arms are drawn."):format(
    charts.MOST_ARMS, #list))
end

local function supervision(list)
  local columns, rows, out = facts.proposals(list)
  local older = out > 0 and (", %d older ones are left out"):format(out) or ""
  return #rows > 0 and html.details(("proposals of supervisors: %d entries%s"):format(#rows, older),
    html.table(columns, rows, "Proposals of supervisors, and their reasons")) or ""
end

local function cost(list)
  local columns, rows = facts.cost(list)
  return html.table(columns, rows, "Seconds by part of a generation, all repetitions together")
end

-- The text or table below the charts of a section.
local BELOW = { learning = learning, parameters = supervision, cost = cost,
  failures = function() return "" end }

-- A section of charts; nothing where there is nothing to show.
local function charted(each, list)
  local figures, below = {}, BELOW[each.name]
  if #each.panels == 0 and not below then return "" end
  for k, panel in ipairs(each.panels) do
    figures[k] = html.figure(inline.draw(panel, panel.title), panel.title, panel.caption)
  end
  return section(each.name, each.title, note(each.foot), '<div class="charts">',
    table.concat(figures), "</div>\n", below and below(list) or "")
end

-- The better parents of the best run's champion of an arm.
local function ancestors_of(arm)
  local run = runs.leading(arm.runs)
  local title, rows = "better parents of the champion of " .. runs.title(arm, run), {}
  for k, robot in ipairs(lineage.of(run)) do
    rows[k] = { robot.generation, robot.id, robot.fitness or "-",
      table.concat(robot.parents, " and "), robot.body.voxels, robot.body.hash }
  end
  if #rows == 0 then return note(title .. ": its robots are not kept.") end
  return html.details(("%s: %d robots"):format(title, #rows),
    html.table({ "generation", "robot", "fitness", "parents", "voxels", "body" }, rows, title))
end

local function ancestry(list, say)
  local parts = {}
  for k = 1, math.min(#list, charts.MOST_ARMS) do
    say("lineage of " .. list[k].name)
    parts[k] = ancestors_of(list[k])
  end
  return section("lineage", #list == 1 and "Lineage of the champion" or "Lineage of champions",
    table.concat(parts))
end

local function configuration(folders)
  local parts = {}
  if #folders > 1 then
    local columns, rows = facts.differences(folders)
    parts[1] = #rows == 0 and note "The configurations are equal."
      or html.table(columns, rows, "Fields in which the configurations differ")
  end
  for _, folder in ipairs(folders) do
    parts[#parts + 1] = html.details("configuration of " .. folder.path,
      html.table({ "field", "value" }, facts.configuration(folder.config),
        "Configuration of " .. folder.path))
  end
  return section("configuration", "Configuration", table.concat(parts))
end

-- What `limax compare` prints for these arms, or its error; empty for a single arm.
local function comparison(folders, list, options)
  if #list < 2 or options.robots == false then return "" end
  local fine, text = failure.attempt(function()
    local outcomes = outcome.measure(runs.finished(folders), engine.device(options.device or "cpu"),
      { progress = function(at)
        options.progress(("comparing: champions at publish, %d %%"):format(
          100 * at.steps / math.max(1, at.steps_total)))
      end })
    return tables.html(verdict.compare(list, outcomes))
  end)
  return section("comparison", "Comparison",
    fine and text or note("limax compare: " .. failure.bare(text)))
end

-- Notes on the generations in which the supervisor of each arm failed.
local function supervisor_failures(list)
  local notes = {}
  for _, arm in ipairs(list) do
    local text = runs.supervisor_failures(arm.runs)
    notes[#notes + 1] = text and note(("%s: %s."):format(arm.name, text))
  end
  return table.concat(notes)
end

local function state_text(folders)
  local texts, by_state = {}, {}
  for k, folder in ipairs(folders) do
    local state = folder.state
    texts[k] = ("%s (%s)"):format(folder.path, state)
    by_state[state] = (by_state[state] or 0) + 1
  end
  if #folders <= MOST_LISTED then return table.concat(texts, ", ") end
  texts = {}
  for _, state in ipairs(choice.sorted_keys(by_state)) do
    texts[#texts + 1] = ("%d %s"):format(by_state[state], state)
  end
  return ("%d runs: %s"):format(#folders, table.concat(texts, ", "))
end

-- The names of the experiments.
local function title_of(list)
  local names = {}
  for k, run in ipairs(list) do names[k] = run.name end
  names = runs.distinct(names)
  local title = table.concat(names, ", ", 1, math.min(#names, MOST_LISTED))
  return #names > MOST_LISTED and ("%s and %d more"):format(title, #names - MOST_LISTED) or title
end

--- The label of a fitness axis, and the fitness in words; runs with different ones are named so.
function page.fitness_label(folders)
  local units, all = {}, {}
  for _, folder in ipairs(folders) do
    if #folder.runs > 0 then
      local unit, words = runs.fitness_words(folder.config.fitness)
      units[#units + 1], all[#all + 1] = unit or "unit of the script", words
    end
  end
  units, all = runs.distinct(units), runs.distinct(all)
  if #all == 1 then return ("fitness (%s)"):format(units[1]), all[1] end
  return ("fitness (%s; of several kinds)"):format(#units == 1 and units[1] or "each its own unit"),
    ("of several kinds, which cannot be compared: %s"):format(table.concat(all, "; "))
end

---@class limax.report.options
---@field device? string|limax.device that simulates the robots for their replays
---@field robots? boolean false leaves robots out
---@field say? fun(text: string)
---@field progress? fun(text: string) what is done now

--- The text of a report.
---@param folders limax.report.folder[] with a generation in one of them at least
function page.text(folders, options)
  options = options or {}
  options.progress = options.progress or function() end
  local list, why = runs.arms(folders)
  local label, words = page.fitness_label(folders)
  local title = title_of(runs.of(list))
  local columns, rows = facts.final(list)
  local shown = options.robots == false and { body = "", scripts = {} }
    or robots.section(list, options)
  local sections = {
    why and "" or comparison(folders, list, options),
    section("results", "Results", html.table(columns, rows, "Every repetition of every run"),
      note("Fitness: " .. words .. ". Best: under the run's first materials where that is known."),
      supervisor_failures(list),
      why and note("Each run is an arm of its own, since " .. why) or ""),
    shown.body == "" and "" or section("robots", "Robots", shown.body) }
  options.progress "drawing charts"
  for _, each in ipairs(charts.of(list, label)) do
    options.progress("drawing " .. each.title)
    sections[#sections + 1] = charted(each, list)
  end
  sections[#sections + 1] = ancestry(list, options.progress)
  sections[#sections + 1] = configuration(folders)
  sections = table.concat(sections)
  local links = {}
  for id, heading in sections:gmatch '<section id="([%l_]+)".-<h2[^>]*>(.-)</h2>' do
    links[#links + 1] = ('<li><a href="#%s">%s</a></li>'):format(id, heading)
  end
  local body = table.concat {
    '<a class="skip" href="#results">skip to the results</a>\n',
    "<header><h1>", html.escaped(title), '</h1><p class="about">',
    html.escaped(state_text(folders)),
    ("; limax %s, %s"):format(html.escaped(host.version), host.time()), "</p></header>\n",
    '<nav aria-label="sections"><ul>', table.concat(links), "</ul></nav>\n<main>\n",
    sections, "</main>\n",
  }
  return html.page { title = title .. " - limax report", style = html.read "style.css",
    scripts = { html.read "charts.js", html.read "robots.js", unpack(shown.scripts) }, body = body }
end

return page
