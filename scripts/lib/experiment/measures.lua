--- measures.lua: numbers that describe a simulated robot: the descriptors of an archive and the
--- objectives of a survival. Each is a name, a function (robot, state) -> number, or a table that
--- begins with one of these: { "contact", cells = 20 }, { f, name = "legs", range = { 0, 4 } }.

local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local record_rules = require "limax.settings.record_rules"
local schema = require "limax.engine.schema"
local suggest = require "limax.engine.suggest"

local measures = {}

-- The names of a material table's muscles.
local muscles_of = setmetatable({}, { __mode = "k" })

local function muscles(robot)
  local materials = robot.context.materials
  if not muscles_of[materials] then
    local names = {}
    for m = 1, materials.count do
      local material = materials:get(m)
      local kind = material.kind
      if kind == "expanding" or kind == "contracting" then names[#names + 1] = material.name end
    end
    muscles_of[materials] = names
  end
  local sum = 0
  local counts = robot.body.count
  for _, name in ipairs(muscles_of[materials]) do sum = sum + (rawget(counts, name) or 0) end
  return sum
end

local function lattice_size(robot)
  local sum = 0
  for _, count in pairs(robot.body.count) do sum = sum + count end
  return sum
end

---@class limax.measures.entry
---@field unit string
---@field text string
---@field of fun(robot: limax.scored_robot): number
---@field range? number[] least and most of every robot
---@field record? table<string, number> traces that it reads, samples per second

local SHARE = { 0, 1 }

--- The measures that have a name.
---@type table<string, limax.measures.entry>
measures.entries = {
  fitness = { unit = "that of the fitness", text = "the robot's score",
    of = function(robot) return robot.fitness end },
  voxels = { unit = "voxels", text = "of the body",
    of = function(robot) return robot.body.voxels end },
  voxel_share = { unit = "1", text = "voxels over those of the lattice", range = SHARE,
    of = function(robot) return robot.body.voxels / lattice_size(robot) end },
  muscle_share = { unit = "1", text = "muscles over voxels", range = SHARE,
    of = function(robot) return muscles(robot) / robot.body.voxels end },
  energy = { unit = "J", text = "positive work of the muscles", record = { energy = 200 },
    of = function(robot) return robot:energy().muscle_work end },
  -- the first result of the robot's method of that name
  mass = { unit = "kg", text = "of the body" },
  length = { unit = "m", text = "longer horizontal side of the body at rest" },
  distance = { unit = "m", text = "horizontal, from t = 0 to the end" },
  speed = { unit = "m/s", text = "distance over duration" },
  path_length = { unit = "m", text = "of the centre of mass, horizontal",
    record = { center_of_mass = 50 } },
  height = { unit = "m", text = "highest rise of the centre of mass",
    record = { center_of_mass = 50 } },
  contact = { unit = "1", text = "mean share of the masses in contact", range = SHARE,
    record = { contact = 50 } },
  strain = { unit = "1", text = "mean strain of the springs", record = { strain = 50 } },
}

local names = choice.sorted_keys(measures.entries)
for _, name in ipairs(names) do
  local entry = measures.entries[name]
  entry.of = entry.of or function(robot) return (robot[name](robot)) end
end

---@class limax.measure
---@field name string
---@field title string in messages: "descriptor 2 (contact)"
---@field call fun(robot: limax.scored_robot, state: table|nil): number
---@field unit? string
---@field record table<string, number> traces that it reads
---@field range? number[] least and most
---@field cells? integer of a grid along it
---@field sign 1|-1 of an objective; -1 where less is better
---@field of_fitness? boolean a measure that the fitness returns by this name

-- The mean of a measure over the trials of a robot, as of a fitness by name.
local function over_trials(robot, of)
  if not robot.context.trials then return of(robot) end
  local read, sum = rawget(robot, "trials"), 0
  for _, trial in ipairs(robot.trials) do sum = sum + of(trial) end
  local count = #robot.trials
  -- reading `robot.trials` notes that the fitness read them
  rawset(robot, "trials", read)
  return sum / count
end

-- The measure that the fitness returns by this name, or else that of the library.
local function named(name)
  local entry = measures.entries[name]
  if entry then
    local function call(robot)
      local returned = (robot.measures or {})[name]
      return returned or over_trials(robot, entry.of)
    end
    if name == "fitness" then call = entry.of end
    return { name = name, call = call, unit = entry.unit, range = entry.range,
      record = entry.record or {} }
  end
  return { name = name, record = {}, of_fitness = true, call = function(robot)
    local value = (robot.measures or {})[name]
    if value == nil then
      local known = { unpack(names) }
      for returned in pairs(robot.measures or {}) do known[#known + 1] = returned end
      table.sort(known)
      failure.raise(1, ("%s is neither a measure of limax nor one that the fitness returned%s")
        :format(schema.show(name), suggest.ending(name, known)))
    end
    return value
  end }
end

local option_rules = { name = schema.text("[%a_][%w_]*", "a name of letters, digits and _"),
  range = schema.numbers(2), cells = schema.whole(1, 1e6) }

-- One measure as an experiment names it; nil and a message for a wrong one.
local function read(spec, path, objective)
  local what, own = spec, {}
  if type(spec) == "table" then
    what = spec[1]
    for key, value in pairs(spec) do
      if key ~= 1 then own[key] = value end
    end
    if what == nil then what, own.name = own.name, nil end
  end
  local options, message = schema.fields(objective and { name = option_rules.name }
    or option_rules)(own, path)
  if not options then return nil, message end
  local measure
  if type(what) == "string" and options.name then
    return nil, path .. ".name: only a function has a name of its own"
  elseif type(what) == "function" then
    measure = { name = options.name or "function", call = what, record = {}, own = true }
  elseif type(what) == "string" then
    local minus, name = what:match "^(%-?)(.*)$"
    if minus == "-" and not objective then
      return nil, ("%s: %s has a minus, which only an objective may have"):format(path,
        schema.show(what))
    end
    measure = named(name)
    measure.sign = minus == "-" and -1 or 1
  else
    return nil, ("%s: expected a name (%s), a function (robot, state) or a table that begins with"
      .. " one, got %s"):format(path, table.concat(names, ", "), schema.show(spec))
  end
  measure.sign = measure.sign or 1
  measure.range, measure.cells = options.range or measure.range, options.cells
  if measure.range and not (measure.range[1] < measure.range[2]) then
    return nil, ("%s.range: expected { least, most } with least < most, got { %.6g, %.6g }")
      :format(path, measure.range[1], measure.range[2])
  end
  return measure
end

--- The rule of a list of measures in an experiment.
---@param options { least?: integer, most: integer, objective?: boolean, range?: boolean }
function measures.rule(options)
  return function(value, path)
    if value == nil then
      return nil, ("%s: is missing; name one or more measures: %s"):format(path,
        table.concat(names, ", "))
    end
    local size, list, seen = schema.list_size(value), {}, {}
    if not size or size < (options.least or 1) or size > options.most then
      return nil, ("%s: expected a list of %d to %d measures, got %s"):format(path,
        options.least or 1, options.most, size and size .. " entries" or schema.show(value))
    end
    for k = 1, size do
      local place = ("%s[%d]"):format(path, k)
      local measure, message = read(value[k], place, options.objective)
      if measure and options.range and not measure.range then
        message = ("%s: %s%s a range%s: { %s, range = { least, most } }"):format(place,
          schema.show(measure.name), measure.of_fitness and (" is no measure of limax%s; one that"
          .. " the fitness returns needs"):format(suggest.ending(measure.name, names)) or " needs",
          measure.unit and " in " .. measure.unit or "",
          measure.own and "f" or schema.show(measure.name))
      end
      if measure and not message and seen[measure.name] then
        message = ("%s: %s is in the list already%s"):format(place, schema.show(measure.name),
          measure.own and '; give each function a name: { f, name = "legs" }' or "")
      end
      if message then return nil, message end
      seen[measure.name] = true
      measure.title = ("%s %d (%s)"):format(options.objective and "objective" or "descriptor", k,
        measure.name)
      list[k] = measure
    end
    return list
  end
end

---@class limax.measured what is measured of each robot besides its score
---@field descriptors? limax.measure[]
---@field objectives? limax.measure[]
---@field reference? number[] of the objectives

local KINDS = { "descriptors", "objectives" }

-- Do two lists name the same objectives?
local function equal(one, other)
  local same = #one.objectives == #other.objectives
  for k, measure in ipairs(one.objectives) do
    local second = other.objectives[k] or {}
    same = same and measure.name == second.name and measure.sign == second.sign
      and (not measure.own or measure.call == second.call)
  end
  return same
end

--- The measures that the archive and the survival of an experiment need.
---@param parts { fitness: limax.fitness, survival: limax.survival.scheme, archive:
--- limax.archive.definition|nil }
---@return limax.measured|nil
---@return string|nil message
function measures.of(parts)
  local archive, survival = parts.archive or {}, parts.survival
  if archive.objectives and survival.objectives and not equal(archive, survival) then
    return nil, ("archive.objectives: the survival %q has others; both must be the same")
      :format(survival.name)
  elseif survival.needs and not choice.contains(survival.needs, archive.name) then
    return nil, ('survival: %q needs %s: archive = { %q, descriptors = { "muscle_share",'
      .. ' "voxel_share" } }'):format(survival.name, #survival.needs == 1 and "a novelty archive"
      or "an archive", survival.needs[1])
  end
  local measured = { descriptors = archive.descriptors,
    objectives = archive.objectives or survival.objectives,
    reference = archive.reference or survival.reference }
  for _, kind in ipairs(KINDS) do
    for _, measure in ipairs(measured[kind] or {}) do
      if measure.of_fitness and parts.fitness.name ~= "function" then
        return nil, ("%s.%s: unknown measure %s%s"):format(
          archive[kind] and "archive" or "survival", kind, schema.show(measure.name),
          suggest.ending(measure.name, names))
      end
    end
  end
  return measured
end

-- Describes the problem of a value; nil if it has none. A value that is not finite comes from the
-- robot.
local function complaint(value)
  if type(value) ~= "number" then
    return schema.show(value) .. ", expected a number"
      .. (value == nil and "; does every path of the function end in `return`?" or ""), false
  elseif value ~= value or math.abs(value) > record_rules.LARGEST_SCORE then
    return tostring(value) .. ", expected a finite number up to 1e150", true
  end
end

-- The values of a list of measures of one robot; or nil, a message, true if the robot and not the
-- script is at fault, and a traceback.
local function values_of(list, robot, state)
  local values = {}
  for k, measure in ipairs(list) do
    local title = measure.title
    local ok, value, trace = failure.attempt_watched(title, measure.call, robot, state)
    if not ok then
      if failure.of_machine(value) then error(value, 0) end
      local begin = title .. " failed: "
      return nil, begin .. failure.bare(value), false, begin .. tostring(trace)
    end
    local message, excusable = complaint(value)
    if message then
      local info = measure.own and debug.getinfo(measure.call, "S")
      local place = info and (" (%s:%d)"):format(info.short_src, info.linedefined) or ""
      return nil, ("%s is %s%s"):format(title, message, place), excusable
    end
    values[k] = value
  end
  return values
end

--- Warnings about descriptors that more than half of the robots have beyond their range.
function measures.beyond(list, rows)
  local texts = {}
  for k, measure in ipairs(list) do
    local range, count, scored, least, most = measure.range, 0, 0, math.huge, -math.huge
    for _, row in ipairs(range and rows or {}) do
      local value = row.fitness and row.descriptors[k]
      if value then
        scored, least, most = scored + 1, math.min(least, value), math.max(most, value)
        if value < range[1] or value > range[2] then count = count + 1 end
      end
    end
    if 2 * count > scored then
      texts[#texts + 1] = ("%d of %d robots of generation 0 have the %s beyond its range { %.4g,"
        .. " %.4g }, and count as its ends: they have %.4g to %.4g"):format(count, scored,
        measure.title, range[1], range[2], least, most)
    end
  end
  return texts
end

--- Adds the measures of a robot to its row.
---@return string|nil message
---@return boolean|nil excusable
---@return string|nil trace
function measures.add(measured, robot, row, state)
  for _, kind in ipairs(KINDS) do
    if measured[kind] then
      local values, message, excusable, trace = values_of(measured[kind], robot, state)
      if message then return message, excusable, trace end
      row[kind] = values
    end
  end
end

return measures
