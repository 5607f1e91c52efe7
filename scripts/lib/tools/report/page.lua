--- page.lua: `report.html`, one file that needs nothing else: opened from disk it makes no request,
--- without scripts it is whole but for the robots that move.

local body_picture = require "limax.draw.body_picture"
local choice = require "limax.base.choice"
local curves = require "limax.tools.report.curves"
local facts = require "limax.tools.report.facts"
local host = require "limax.host"
local html = require "limax.tools.report.html"
local inline = require "limax.draw.chart.inline"
local lineage = require "limax.tools.report.lineage"
local parameters = require "limax.tools.report.parameters"
local robots = require "limax.tools.report.robots"
local runs = require "limax.tools.report.runs"
local source = require "limax.base.source"
local summary = require "limax.tools.console.summary"

local page = {}

-- Arms whose populations and parameters are drawn; the rest is in the tables.
local MOST_ARMS = 6

local function read(name)
  local text, message = source.read(("%s/scripts/lib/tools/report/%s"):format(host.home, name))
  return assert(text, message)
end

local function figure(panel, caption)
  return html.figure(inline.draw(panel, caption), caption)
end

local function charts(list) return '<div class="charts">' .. table.concat(list) .. "</div>\n" end

local function section(id, title, ...)
  return ('<section id="%s" aria-labelledby="%s-title"><h2 id="%s-title">%s</h2>\n%s</section>\n')
    :format(id, id, id, html.escaped(title), table.concat { ... })
end

local function note(text) return '<p class="note">' .. html.escaped(text) .. "</p>\n" end

local function first_arms(list) return { unpack(list, 1, MOST_ARMS) } end

local function left_out(list)
  if #list <= MOST_ARMS then return "" end
  return note(("The first %d of %d arms are drawn."):format(MOST_ARMS, #list))
end

-- ---- sections -----------------------------------------------------------------------------------

local function learning(list, label)
  local parts = { figure(curves.learning(list, label), "Learning curves. "
    .. curves.meaning(list)) }
  if #list > 1 then
    parts[2] = figure(curves.by_evaluations(list, "best, by evaluations", label,
      runs.score), "Learning curves over what was spent. "
      .. curves.meaning(list))
  end
  for _, arm in ipairs(first_arms(list)) do
    parts[#parts + 1] = figure(curves.population(arm, label), ("Population of %s. n = %d %s")
      :format(arm.name, #arm.runs, #arm.runs == 1 and "run" or "runs, the centre of each curve"))
  end
  return section("learning", "Learning", charts(parts), left_out(list))
end

local function measures(list)
  local parts = {}
  for k, panel in ipairs(curves.measures(list)) do
    parts[k] = figure(panel, ("Measured: %s. %s"):format(panel.title, curves.meaning(list)))
  end
  if #parts == 0 then return "" end
  return section("measures", "Beside the fitness", charts(parts))
end

local function diversity(list)
  local parts = {}
  for k, panel in ipairs(curves.diversity(list)) do
    parts[k] = figure(panel, ("Diversity: %s. %s"):format(panel.title, curves.meaning(list)))
  end
  return section("diversity", "Diversity", charts(parts))
end

local function supervision(list)
  local moved, still = parameters.fields(list)
  local parts = {}
  for _, arm in ipairs(#moved > 0 and first_arms(list) or {}) do
    local figures = {}
    for _, path in ipairs((parameters.fields { arm })) do
      local panel, seen = parameters.panel(arm, path)
      local names = {}
      for _, setter in ipairs(parameters.SETTERS) do
        if seen[setter.name] then names[#names + 1] = setter.text or setter.name end
      end
      figures[#figures + 1] = figure(panel, ("%s of %s. n = %d; set by: %s"):format(path, arm.name,
        #arm.runs, #names > 0 and table.concat(names, "; ") or "nobody"))
    end
    if #list > 1 and #figures > 0 then
      parts[#parts + 1] = ("<h3>%s</h3>\n"):format(html.escaped(arm.name))
    end
    parts[#parts + 1] = charts(figures)
  end
  local columns, rows, out = facts.said(list)
  local said = #rows > 0 and html.details(("what supervisors said and changed: %d entries%s")
    :format(#rows, out > 0 and (", %d older ones are left out"):format(out) or ""),
    html.table(columns, rows, "What supervisors said and changed")) or ""
  return section("parameters", "Parameters, and who set them",
    note "A marker says who set a value; without one it was kept.", '<figure class="chart key">',
    inline.key(parameters.SETTERS, "Markers of who set a value"), "</figure>\n",
    table.concat(parts), left_out(list),
    #still > 0 and note("Never changed: " .. table.concat(still, ", ") .. ".") or "", said)
end

local function failures(list)
  local any = 0
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      for _, line in ipairs(run.lines) do any = any + curves.failed(line) end
    end
  end
  local text = any == 0 and note "Every robot of every generation came to a score."
    or charts { figure(curves.failures(list), ("Robots without a score: %d in all. %s"):format(any,
      curves.meaning(list))) }
  return section("failures", "Failures", text)
end

local function cost(list)
  local parts = {}
  for k, panel in ipairs(curves.time(list)) do
    parts[k] = figure(panel, ("Clock: %s. %s"):format(panel.title, curves.meaning(list)))
  end
  local columns, rows = facts.cost(list)
  return section("cost", "Time and cost", charts(parts),
    html.table(columns, rows, "Seconds by part of a generation, all repetitions together"))
end

local function accuracy(folders)
  local columns, rows = facts.accuracy(folders)
  return section("accuracy", "What its accuracy costs",
    html.table(columns, rows, "Accuracy of each run"),
    note("Elite regret: what is lost by breeding from scores of this accuracy. limax bench accuracy"
      .. " measures it; where it was not measured with this processor and build, nothing is said."))
end

local function ancestry(run, label)
  local ancestors, line = lineage.of(run)
  if #ancestors == 0 then
    return section("lineage", "Lineage of the champion",
      note "The population files do not name the champion's ancestors.")
  end
  local rows = {}
  for k, robot in ipairs(line) do
    rows[k] = { robot.generation, robot.id, robot.fitness or "-",
      table.concat(robot.parents, " and "), robot.voxels, robot.hash }
  end
  local caption = ("Ancestors of the champion of %s, repetition %d: %d robots; line: better"
    .. " parents"):format(run.path, run.repetition, #ancestors)
  return section("lineage", "Lineage of the champion",
    charts { figure(lineage.panel(ancestors, line, label), caption) },
    html.details(("the line of better parents: %d robots"):format(#line), html.table(
      { "generation", "robot", "fitness", "parents", "voxels", "body" }, rows, "Better parents")))
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
  local columns, rows = facts.machines(folders)
  parts[#parts + 1] = html.details("machines", html.table(columns, rows, "Processes and machines"))
  return section("configuration", "Configuration", table.concat(parts))
end

-- What the scripts say is not from the paper.
local function not_in_paper(folders)
  local parts, shown = {}, {}
  for _, folder in ipairs(folders) do
    local list = folder.config.not_in_paper
    local key = list and host.json.encode(list)
    if key and not shown[key] then
      shown[key] = true
      local items = {}
      for k, text in ipairs(list) do
        items[k] = "<li>" .. html.escaped(text) .. "</li>"
      end
      parts[#parts + 1] = ("<p>%s:</p><ul>%s</ul>\n"):format(
        html.escaped(folder.config.name or folder.path), table.concat(items, "\n"))
    end
  end
  if #parts == 0 then return "" end
  return section("paper", "Not in the paper", table.concat(parts))
end

-- The champion's layers as letters.
local function letters(run)
  local description = runs.description(run, run.lines[#run.lines])
  if not description then return "" end
  local lattice = description.lattice
  -- more letters than this are no picture any more
  if lattice[1] * lattice[2] * lattice[3] > 1000 then return "" end
  local style = { color = false, ascii = true, width = 100 }
  local materials = description.materials.materials
  local picture = body_picture.side_by_side({ { title = "champion, lowest layer first",
    layers = description.voxels, materials = materials } }, style)
  return ('<pre tabindex="0" role="region" aria-label="the champion in letters">%s\n\n%s</pre>\n')
    :format(html.escaped(picture),
    html.escaped(body_picture.legend(materials, style)))
end

-- ---- the page -----------------------------------------------------------------------------------

-- More folders than these are counted, not listed; the table of results has all.
local MOST_LISTED = 6

local function state_text(folders)
  local texts, by_state = {}, {}
  for k, folder in ipairs(folders) do
    local state = tostring(folder.status.state)
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

--- What the axis of a fitness is called, and the fitness in words; of runs with several, that they
--- differ.
---@param folders limax.report.folder[]
---@return string label
---@return string words
function page.fitness_label(folders)
  local units, all, seen, count = {}, {}, {}, 0
  for _, folder in ipairs(folders) do
    local unit, words = summary.fitness_words(folder.config.fitness)
    unit = unit or "unit of the script"
    if #folder.runs > 0 and not seen[unit .. words] then
      seen[unit .. words], all[#all + 1] = true, words
      count = count + (units[unit] and 0 or 1)
      units[unit], units[1] = true, units[1] or unit
    end
  end
  if #all == 1 then return ("fitness (%s)"):format(units[1]), all[1] end
  return ("fitness (%s; of several kinds)"):format(count == 1 and units[1] or "each its own unit"),
    ("of several kinds, which cannot be compared: %s"):format(table.concat(all, "; "))
end

---@class limax.report.options
---@field device? string|limax.device that simulates the robots for their replays
---@field robots? boolean false leaves robots out
---@field say? fun(text: string)

--- The text of a report.
---@param folders limax.report.folder[] with a generation in one of them at least
---@param options? limax.report.options
---@return string
function page.text(folders, options)
  options = options or {}
  local list, why = runs.arms(folders)
  local all, names, seen = {}, {}, {}
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      all[#all + 1] = run
      if not seen[run.name] then
        seen[run.name] = true
        names[#names + 1] = run.name
      end
    end
  end
  local label, words = page.fitness_label(folders)
  local leading = runs.leading(all)
  local columns, rows = facts.final(list)
  local title = table.concat(names, ", ", 1, math.min(#names, MOST_LISTED))
  if #names > MOST_LISTED then
    title = ("%s and %d more"):format(title, #names - MOST_LISTED)
  end
  local shown = options.robots == false and { body = "", scripts = {} }
    or robots.section(list, options)
  local sections = {
    section("results", "Results", html.table(columns, rows, "Every repetition of every run"),
      note("Fitness: " .. words .. ". Best: under the run's first materials where that is known."),
      why and note("Each run stands for itself, since " .. why) or "", letters(leading)),
    learning(list, label), measures(list),
    shown.body == "" and "" or section("robots", "Robots", shown.body),
    diversity(list), supervision(list), failures(list), cost(list), accuracy(folders),
    ancestry(leading, label),
    configuration(folders), not_in_paper(folders),
  }
  local links = {}
  for _, text in ipairs(sections) do
    local id, heading = text:match '^<section id="(%l+)".-<h2[^>]*>(.-)</h2>'
    if id then links[#links + 1] = ('<li><a href="#%s">%s</a></li>'):format(id, heading) end
  end
  local body = table.concat {
    '<a class="skip" href="#results">skip to the results</a>\n',
    "<header><h1>", html.escaped(title), '</h1><p class="about">',
    html.escaped(state_text(folders)),
    ("; limax %s, %s"):format(html.escaped(host.version), host.time()), "</p></header>\n",
    '<nav aria-label="sections"><ul>', table.concat(links), "</ul></nav>\n<main>\n",
    table.concat(sections), "</main>\n",
  }
  local scripts = { read "charts.js" }
  for _, text in ipairs(shown.scripts) do scripts[#scripts + 1] = text end
  return html.page { title = title .. " - limax report", style = read "style.css",
    scripts = scripts, body = body }
end

return page
