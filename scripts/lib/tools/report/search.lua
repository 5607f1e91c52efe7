--- search.lua: describes a run's method of search in words: encoding, variation, selection,
--- survival, archive, islands and trials of its configuration, with defaults for those it lacks.

local defaults = require "limax.settings.defaults"
local source = require "limax.base.source"

local search = {}

-- The parts in the order in which they name an arm: name, path in config.json, and what a
-- configuration without it has.
local PARTS = {
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

-- The name of a part's value: "plus", "4 islands", "own.lua:12" of a function.
local function name_of(config, part)
  local value = at(config, part.path)
  if value == nil then return part.absent end
  if type(value) ~= "table" then return tostring(value) end
  if part.name == "islands" then return ("%d islands"):format(value.count) end
  if part.name == "trials" and #value > 0 then return ("%d trials"):format(#value) end
  return value.name or value[1] or source.place(value) or "functions"
end

--- Does a path of a flat configuration belong to one of the parts? Other fields of a genome do
--- where the encodings differ, which may use other ones.
---@param path string "archive.cells"
---@param one table a configuration
function search.has(path, one, other)
  for _, part in ipairs(PARTS) do
    if path == part.path or path:find(part.path .. ".", 1, true) == 1 then return true end
  end
  return path:find "^genome%." ~= nil and name_of(one, PARTS[1]) ~= name_of(other, PARTS[1])
end

-- Names by the first `count` parts; nil where two would have the same.
local function names_by(configs, count)
  local names, seen = {}, {}
  for k in ipairs(configs) do names[k] = {} end
  for p = 1, count do
    local part, differs = PARTS[p], false
    for _, config in ipairs(configs) do
      differs = differs or name_of(config, part) ~= name_of(configs[1], part)
    end
    for k, config in ipairs(differs and configs or {}) do
      table.insert(names[k], name_of(config, part))
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
function search.names(configs)
  return names_by(configs, #PARTS - 1) or names_by(configs, #PARTS)
end

return search
