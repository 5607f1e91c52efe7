--- show.lua: the text of a value at the prompt: tables are truncated in depth and length, arrays
--- summarised, robots shown as layers of letters side by side.

local array_text = require "limax.tools.repl.array_text"
local body = require "limax.robot.body"
local body_picture = require "limax.draw.body_picture"
local choice = require "limax.base.choice"
local kind = require "limax.tools.repl.kind"
local terminal = require "limax.base.terminal"

local show = {}

local MAX_DEPTH = 4     -- of nested tables, less if the text exceeds MAX_LINES
local MAX_LINES = 40
local MAX_FIELDS = 24   -- of a table
local MAX_NUMBERS = 12  -- longer lists are summarised
local MAX_LETTERS = 400 -- of a string in a table

local function text_of(value, most)
  local cut = most and #value > most
  local shown = cut and value:sub(1, most) or value
  shown = ("%q"):format(shown):gsub("\\\n", "\\n"):gsub("\r", "\\r"):gsub("\27", "\\27")
  return shown .. (cut and (" .. (%d bytes)"):format(#value) or "")
end

local function key_text(key)
  if type(key) == "string" and key:match "^[%a_][%w_]*$" then return key .. " = " end
  if type(key) == "string" then return "[" .. text_of(key, 40) .. "] = " end
  return "[" .. tostring(key) .. "] = "
end

-- Does this table have `__tostring`?
local function own_text(value)
  local class = getmetatable(value)
  return type(class) == "table" and rawget(class, "__tostring") ~= nil
end

local short

-- The entries of a table as texts: the list, then the other keys, sorted.
local function entries_of(value, depth, seen)
  local texts, listed = {}, #value
  for i = 1, math.min(listed, MAX_FIELDS) do texts[i] = short(value[i], depth + 1, seen) end
  local rest = {}
  for _, key in ipairs(choice.sorted_keys(value)) do
    local in_list = type(key) == "number" and key >= 1 and key <= listed and key % 1 == 0
    if not in_list then rest[#rest + 1] = key end
  end
  for _, key in ipairs(rest) do
    if #texts >= MAX_FIELDS then break end
    texts[#texts + 1] = key_text(key) .. short(rawget(value, key), depth + 1, seen)
  end
  local left = listed + #rest - #texts
  if left > 0 then texts[#texts + 1] = ("... %d more"):format(left) end
  return texts
end

local function table_text(value, depth, seen)
  local class = getmetatable(value)
  -- a module that loads its parts at first use
  if type(class) == "table" and class.__fields then
    return "{ " .. table.concat(class.__fields, ", ") .. " }"
  end
  -- a robot's record, which is made when it is read
  if type(class) == "table" and class.__pairs then
    local read = {}
    for name, entry in pairs(value) do read[name] = entry end
    value = read
  end
  if seen[value] then return "{ an enclosing table }" end
  if next(value) == nil then return "{}" end
  local shape = array_text.shape(value)
  if shape and (#shape > 1 and shape[1] * shape[2] or shape[1]) > MAX_NUMBERS then
    return array_text.list(value, shape)
  end
  if depth >= seen.deepest then return "{ ... }" end
  seen[value] = true
  local texts = entries_of(value, depth, seen)
  seen[value] = nil
  local line = "{ " .. table.concat(texts, ", ") .. " }"
  if #line + 2 * depth <= seen.width and not line:find("\n", 1, true) then return line end
  local indent = ("  "):rep(depth + 1)
  return "{\n" .. indent .. table.concat(texts, ",\n" .. indent) .. "\n"
    .. ("  "):rep(depth) .. "}"
end

-- A value inside a table, in one line if possible.
function short(value, depth, seen)
  if type(value) == "string" then return text_of(value, MAX_LETTERS) end
  if type(value) ~= "table" then return tostring(value) end
  -- of a robot only the first line
  if kind.of(value) then return show.value(value, seen.style):match "^[^\n]*" end
  if own_text(value) then return (tostring(value):gsub("\n+", " ")) end
  return table_text(value, depth, seen)
end

-- The layers of a body as letters, side by side.
local function slices(value, materials, title, style)
  local plain = materials:table().materials
  local picture = body_picture.side_by_side(
    { { title = title, layers = body.layers(value.body.letters), materials = plain } }, style)
  return picture:gsub("[ ]+\n", "\n"):gsub("[ ]+$", "") .. "\n"
    .. body_picture.legend(plain, style)
end

local function robot_text(value, style)
  return slices(value, value.materials, "robot: " .. tostring(value):match "[^\n]*$", style)
end

local function scored_text(value, style)
  return slices(value, value.context.materials, tostring(value), style)
end

-- A run and the fitness of its last generation.
local function run_text(value)
  local config, last = value.config, value.history[#value.history]
  return ("run of %s, repetition %d: %d of %d generations%s"):format(config.name,
    value.repetition, #value.history, config.generations,
    last and ("; best %.4g, mean %.4g"):format(last.best, last.mean) or "")
end

local function population_text(value)
  local ranked = value.ranked
  local head = ("generation %d: %d robots"):format(value.generation, #value.records)
  if not ranked then return head .. ", not scored" end
  if #ranked == 0 then return head .. ", none with a score" end
  local best = value[ranked[1]]
  return ("%s, %d with a score, best %.4g (robot %d)"):format(head, #ranked, best.fitness, best.id)
end

local function experiment_text(value)
  local config = value.config
  return ("experiment %s: %s voxels, %d robots, %d generations"):format(config.name,
    table.concat(config.lattice, "x"), config.population, config.generations)
end

local text_of_class = {
  ["limax.view"] = array_text.view,
  ["limax.scored_robot"] = scored_text,
  ["limax.robot"] = robot_text,
  ["limax.run"] = run_text,
  ["limax.experiment"] = experiment_text,
  ["limax.population.scored"] = population_text,
}

--- The text of a value, of one or more lines.
function show.value(value, style)
  style = style or terminal.style()
  if type(value) == "string" then return text_of(value) end
  if type(value) ~= "table" then return tostring(value) end
  local text = text_of_class[kind.of(value)]
  if text then return text(value, style) end
  if own_text(value) then return tostring(value) end
  for deepest = MAX_DEPTH, 1, -1 do
    text = table_text(value, 0, { width = style.width, style = style, deepest = deepest })
    if select(2, text:gsub("\n", "")) < MAX_LINES then break end
  end
  return text
end

--- The text of a value in one line, without the content of larger tables.
function show.line(value)
  local style = terminal.style()
  return short(value, 0, { width = math.huge, style = style, deepest = 0 })
end

--- The text of several values: in one line, separated by tabs, or one per line.
function show.values(count, ...)
  local texts, style, separator = {}, terminal.style(), "\t"
  for i = 1, count do
    texts[i] = show.value((select(i, ...)), style)
    if texts[i]:find("\n", 1, true) then separator = "\n" end
  end
  return table.concat(texts, separator)
end

return show
