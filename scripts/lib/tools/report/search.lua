--- search.lua: how a run searches, as texts: encoding, variation, selection, survival, archive,
--- islands and trials of its configuration, with the defaults where it names none.

local choice = require "limax.base.choice"
local defaults = require "limax.settings.defaults"
local schema = require "limax.engine.schema"
local source = require "limax.base.source"

local search = {}

---@class limax.report.search_part
---@field name string
---@field path string in config.json
---@field absent string what a configuration without it has

--- The parts, in the order in which they name an arm.
---@type limax.report.search_part[]
search.parts = {
  { name = "encoding", path = "genome.encoding", absent = defaults.encoding },
  { name = "mutation", path = "genome.mutation", absent = "the encoding's mutation" },
  { name = "crossover", path = "genome.crossover", absent = "the encoding's crossover" },
  { name = "survival", path = "survival", absent = defaults.survival },
  { name = "archive", path = "archive", absent = "no archive" },
  { name = "islands", path = "islands", absent = "one population" },
  { name = "trials", path = "trials", absent = "one trial" },
  { name = "selection", path = "selection", absent = defaults.selection[1] },
}

local function at(config, path)
  for key in path:gmatch "[^.]+" do config = type(config) == "table" and config[key] or nil end
  return config
end

--- The name of a part's value: "plus", "4 islands", "own.lua:12" of a function.
---@param part limax.report.search_part
function search.name(config, part)
  local value = at(config, part.path)
  if value == nil then return part.absent end
  if type(value) ~= "table" then return tostring(value) end
  if part.name == "islands" then return ("%d islands"):format(value.count) end
  if part.name == "trials" and #value > 0 then return ("%d trials"):format(#value) end
  return value.name or value[1] or source.place(value) or "functions"
end

-- A value in one line: a function as its place, a choice as its name and options.
local function text_of(value)
  if type(value) ~= "table" then
    return type(value) == "string" and value or schema.show(value)
  end
  local parts = { source.place(value) }
  for _, key in ipairs(choice.sorted_keys(value)) do
    local text = key ~= "function" and text_of(value[key])
    if key == "name" then
      table.insert(parts, 1, text)
    elseif text then
      parts[#parts + 1] = type(key) == "number" and text or ("%s = %s"):format(key,
        type(value[key]) == "table" and "{ " .. text .. " }" or text)
    end
  end
  return table.concat(parts, ", ")
end

--- A part's value with its options: "grid, cells = 12, descriptors = { contact, mass }".
---@param part limax.report.search_part
function search.text(config, part)
  local value = at(config, part.path)
  return value == nil and part.absent or text_of(value)
end

--- Does a path of a flat configuration belong to one of the parts? Other fields of a genome do
--- where the encodings differ, which may use other ones.
---@param path string "archive.cells"
---@param one table a configuration
---@param other table
function search.has(path, one, other)
  for _, part in ipairs(search.parts) do
    if path == part.path or path:find(part.path .. ".", 1, true) == 1 then return true end
  end
  local encoding = search.parts[1]
  return path:find "^genome%." ~= nil and search.name(one, encoding) ~= search.name(other, encoding)
end

-- Names by the first `count` parts; nil where two would have the same.
local function names_by(configs, count)
  local names, seen = {}, {}
  for k in ipairs(configs) do names[k] = {} end
  for p = 1, count do
    local part, differs = search.parts[p], false
    for _, config in ipairs(configs) do
      differs = differs or search.name(config, part) ~= search.name(configs[1], part)
    end
    for k, config in ipairs(differs and configs or {}) do
      table.insert(names[k], search.name(config, part))
    end
  end
  for k, parts in ipairs(names) do
    names[k] = table.concat(parts, ", ")
    if names[k] == "" or seen[names[k]] then return nil end
    seen[names[k]] = true
  end
  return names
end

--- Names of configurations that differ only in how they search, by what differs: "cppn, plus".
--- nil where two would have the same name. A survival may bring its own selection, which is named
--- only where the rest is equal.
---@param configs table[]
---@return string[]|nil
function search.names(configs)
  return names_by(configs, #search.parts - 1) or names_by(configs, #search.parts)
end

return search
