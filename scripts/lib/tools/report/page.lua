--- page.lua: `report.html`, one file that needs nothing else. Opened from disk it makes no request;
--- without scripts everything is shown except the robots that move.

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

local page = {}

-- Arms whose populations and parameters are drawn; the rest is in the tables.
local MOST_ARMS = 6
-- Letters of a body that is shown in letters.
local MOST_LETTERS = 1000
-- More folders than these are counted, not listed; the table of results has all.
local MOST_LISTED = 6

local function figure(panel, caption)
  return html.figure(inline.draw(panel, caption), caption)
end

local function charts(list) return '<div class="charts">' .. table.concat(list) .. "</div>\n" end

-- Charts of panels that have a line for each arm.
local function charts_of(list, panels, prefix)
  local parts = {}
  for k, panel in ipairs(panels) do
    parts[k] = figure(panel, ("%s: %s. %s"):format(prefix, panel.title, curves.meaning(list)))
  end
  return charts(parts)
end

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
    parts[2] = figure(curves.by_evaluations(list, "best, by evaluations", label, runs.score),
      "Learning curves by evaluations. " .. curves.meaning(list))
  end
  for _, arm in ipairs(first_arms(list)) do
    parts[#parts + 1] = figure(curves.population(arm, label), ("Population of %s. n = %d %s")
      :format(arm.name, #arm.runs, #arm.runs == 1 and "run" or "runs, the centre of each curve"))
  end
  return section("learning", "Learning", charts(parts), left_out(list))
end

local function measures(list)
  local panels = curves.measures(list)
  if #panels == 0 then return "" end
  return section("measures", "Other measures of the fitness", charts_of(list, panels, "Measured"))
end

local function diversity(list)
  return section("diversity", "Diversity", charts_of(list, curves.diversity(list), "Diversity"))
end

-- The parameters of one arm as charts.
local function parameters_of(arm)
  local figures = {}
  for k, path in ipairs((parameters.fields { arm })) do
    local panel, seen = parameters.panel(arm, path)
    local names = {}
    for _, setter in ipairs(parameters.SETTERS) do
      if seen[setter.name] then names[#names + 1] = setter.text or setter.name end
    end
    figures[k] = figure(panel, ("%s of %s. n = %d; set by: %s"):format(path, arm.name,
      #arm.runs, #names > 0 and table.concat(names, "; ") or "no one"))
  end
  return figures
end

local function supervision(list)
  local moved, still = parameters.fields(list)
  local parts = {}
  for _, arm in ipairs(#moved > 0 and first_arms(list) or {}) do
    local figures = parameters_of(arm)
    if #list > 1 and #figures > 0 then
      parts[#parts + 1] = ("<h3>%s</h3>\n"):format(html.escaped(arm.name))
    end
    parts[#parts + 1] = charts(figures)
  end
  local columns, rows, out = facts.proposals(list)
  local proposals = #rows > 0 and html.details(("proposals of supervisors: %d entries%s")
    :format(#rows, out > 0 and (", %d older ones are left out"):format(out) or ""),
    html.table(columns, rows, "Proposals of supervisors, and their reasons")) or ""
  return section("parameters", "Parameters, and who set them",
    note "A marker shows who set a value; without one it was kept.", '<figure class="chart key">',
    inline.key(parameters.SETTERS, "Markers of who set a value"), "</figure>\n",
    table.concat(parts), left_out(list),
    #still > 0 and note("Never changed: " .. table.concat(still, ", ") .. ".") or "", proposals)
end

local function failures(list)
  local count = 0
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do
      for _, line in ipairs(run.lines) do count = count + curves.failed(line) end
    end
  end
  local text = count == 0 and note "Every robot of every generation has a score."
    or charts { figure(curves.failures(list), ("Robots without a score: %d in all. %s"):format(
      count, curves.meaning(list))) }
  return section("failures", "Failures", text)
end

local function cost(list)
  local columns, rows = facts.cost(list)
  return section("cost", "Time and cost", charts_of(list, curves.time(list), "Wall time"),
    html.table(columns, rows, "Seconds by part of a generation, all repetitions together"))
end

local function accuracy(folders)
  local columns, rows = facts.accuracy(folders)
  return section("accuracy", "Accuracy",
    html.table(columns, rows, "Accuracy of each run"),
    note("Elite regret: the fitness that is lost by breeding from scores of this accuracy. It is"
      .. " known after limax bench accuracy has run with this processor and build."))
end

local function ancestry(run, label)
  local ancestors, line = lineage.of(run)
  if #ancestors == 0 then
    return section("lineage", "Lineage of the champion",
      note "The population files do not contain the champion's ancestors.")
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

-- The settings that scripts mark as not from the paper.
local function not_in_paper(folders)
  local parts, shown = {}, {}
  for _, folder in ipairs(folders) do
    local list = folder.config.not_in_paper
    local key = list and host.json.encode(list)
    if key and not shown[key] then
      shown[key] = true
      local items = {}
      for k, text in ipairs(list) do items[k] = "<li>" .. html.escaped(text) .. "</li>" end
      parts[#parts + 1] = ("<p>%s:</p><ul>%s</ul>\n"):format(
        html.escaped(folder.config.name or folder.path), table.concat(items, "\n"))
    end
  end
  if #parts == 0 then return "" end
  return section("paper", "Not in the paper", table.concat(parts))
end

--- The last champion's layers as letters; nil where its file is missing or it has too many voxels.
---@return string|nil layers
---@return string|nil legend
function page.letters(run, title, style)
  local description = runs.description(run, run.lines[#run.lines])
  local lattice = description and description.lattice
  if not lattice or lattice[1] * lattice[2] * lattice[3] > MOST_LETTERS then return nil end
  local materials = description.materials.materials
  return body_picture.side_by_side({ { title = title, layers = description.voxels,
    materials = materials } }, style), body_picture.legend(materials, style)
end

local function letters(run)
  local layers, legend = page.letters(run, "champion, lowest layer first",
    { color = false, ascii = true, width = 100 })
  if not layers then return "" end
  return ('<pre tabindex="0" role="region" aria-label="the champion in letters">%s\n\n%s</pre>\n')
    :format(html.escaped(layers), html.escaped(legend))
end

-- ---- the page -----------------------------------------------------------------------------------

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

-- The names of the experiments.
local function title_of(list)
  local names, seen = {}, {}
  for _, run in ipairs(list) do
    if not seen[run.name] then
      seen[run.name] = true
      names[#names + 1] = run.name
    end
  end
  local title = table.concat(names, ", ", 1, math.min(#names, MOST_LISTED))
  return #names > MOST_LISTED and ("%s and %d more"):format(title, #names - MOST_LISTED) or title
end

--- The label of a fitness axis, and the fitness in words; runs with different ones are named so.
---@return string label
---@return string words
function page.fitness_label(folders)
  local units, all, seen, count = {}, {}, {}, 0
  for _, folder in ipairs(folders) do
    local unit, words = runs.fitness_words(folder.config.fitness)
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
function page.text(folders, options)
  options = options or {}
  local list, why = runs.arms(folders)
  local all = {}
  for _, arm in ipairs(list) do
    for _, run in ipairs(arm.runs) do all[#all + 1] = run end
  end
  local label, words = page.fitness_label(folders)
  local leading, title = runs.leading(all), title_of(all)
  local columns, rows = facts.final(list)
  local shown = options.robots == false and { body = "", scripts = {} }
    or robots.section(list, options)
  local sections = table.concat {
    section("results", "Results", html.table(columns, rows, "Every repetition of every run"),
      note("Fitness: " .. words .. ". Best: under the run's first materials where that is known."),
      why and note("Each run is an arm of its own, since " .. why) or "", letters(leading)),
    learning(list, label), measures(list),
    shown.body == "" and "" or section("robots", "Robots", shown.body),
    diversity(list), supervision(list), failures(list), cost(list), accuracy(folders),
    ancestry(leading, label), configuration(folders), not_in_paper(folders),
  }
  local links = {}
  for id, heading in sections:gmatch '<section id="(%l+)".-<h2[^>]*>(.-)</h2>' do
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
    scripts = { html.read "charts.js", unpack(shown.scripts) }, body = body }
end

return page
