--- field_page.lua: reads a page of tables "field, unit, meaning" as a tree of fields, and compares
--- decoded objects with it. On such a page `a[]` is a list of objects, words in capitals are
--- placeholders, a meaning that begins with *optional* allows absence, and "see [Part](#part)"
--- includes the fields of another section, "see [REFERENCE.md]" those of an experiment. Every
--- object may have a `schema`.

local choice = require "limax.base.choice"
local host = require "limax.host"
local source = require "limax.base.source"

local field_page = {}

-- Adds the tables of a page to `sections`.
local function read(page, sections)
  local text, section = assert(source.read(host.home .. "/" .. page)), nil
  for line in text:gmatch "[^\n]+" do
    local heading = line:match "^## `?([^`]*)"
    if heading then
      section = {}
      sections[heading] = section
    elseif line:match "^| `" then
      local cells, names = {}, {}
      for cell in line:gsub("\\|", "/"):sub(2):gmatch "%s*(.-)%s*|" do cells[#cells + 1] = cell end
      for name in cells[1]:gmatch "`(.-)`" do names[#names + 1] = name end
      section[#section + 1] = { names = names, unit = cells[2],
        optional = cells[3]:match "^%*optional%*" ~= nil, part = cells[3]:match "see %[(.-)%]" }
    end
  end
end

-- Fields of an experiment that a resolved one may lack, apart from the effects of a scene.
local ABSENT = { ["simulation.bound"] = true, ["simulation.bound_fraction"] = true,
  ["simulation.time_step_most"] = true, ["supervision.ranges"] = true,
  ["genome.encoding"] = true, ["genome.mutation"] = true,
  ["genome.crossover"] = true, ["genome.body"] = true, ["genome.control_spread"] = true,
  ["breeding.control_mutation_rate"] = true, ["breeding.control_mutation_scale"] = true }

--- Tables of the run folder's page by the heading above them: rows with `names` (first cell),
--- `unit` (second), `optional`, and `part`, another section with the fields below this one. The
--- groups of an experiment's fields, such as "scene", are sections too.
---@return table<string, table[]>
function field_page.read()
  local sections, reference = {}, {}
  read("scripts/RUN_FOLDER.md", sections)
  read("scripts/REFERENCE.md", reference)
  for _, row in ipairs(reference["Fields of an experiment"]) do
    local group, name = row.names[1]:match "^(%l+)%.(.*)$"
    -- only config.json has the tier
    if group and name ~= "accuracy" then
      sections[group] = sections[group] or {}
      row.optional = ABSENT[group .. "." .. name:match "^[^.]+"]
        or group == "scene" and not name:find("%.")
      row.names = { name }
      table.insert(sections[group], row)
    end
  end
  return sections
end

---@class field_page.field
---@field path string
---@field unit string|nil
---@field optional boolean|nil
---@field seen boolean|nil was it in an object?
---@field list boolean|nil of objects
---@field children table<string, field_page.field>
---@field parent field_page.field|nil
---@field any field_page.field|nil child of any name, in capitals on the page

--- The field at a dotted path below another one, created if it is missing.
---@return field_page.field
function field_page.at(field, path)
  for step in path:gmatch "[^.]+" do
    local name = step:gsub("%[%]$", "")
    local child = field.children[name] or name:match "^%u+$" and field.any
    if not child then
      child = { path = field.path .. "." .. name, parent = field, children = {} }
      if name:match "^%u+$" then
        field.any, child.optional = child, true
      else
        field.children[name] = child
      end
    end
    child.list = child.list or name ~= step
    field = child
  end
  return field
end

--- The fields of a section as a tree, including those of its parts.
---@param sections table<string, table[]>
---@param root? field_page.field
---@return field_page.field
function field_page.tree(sections, heading, root)
  root = root or { path = heading, children = {} }
  for _, row in ipairs(assert(sections[heading], heading)) do
    for _, name in ipairs(row.names) do
      local field = field_page.at(root, name)
      field.unit, field.optional = row.unit, row.optional
      local part = row.part == "REFERENCE.md" and name:match "%l+$" or row.part
      if part then field_page.tree(sections, part, field) end
      -- config.json has the robots that are kept as record_population, not in the simulation
      if part == "record" then field.children.population = nil end
    end
  end
  return root
end

--- May it be absent? A field without a row of its own may if all fields below it may.
---@return boolean|nil
function field_page.is_optional(field)
  if field.optional or field.unit then return field.optional end
  for _, child in pairs(field.children) do
    if not field_page.is_optional(child) then return false end
  end
  return true
end

--- Compares a decoded object with the fields of the page, in both directions.
function field_page.compare(t, value, field)
  for _, name in ipairs(choice.sorted_keys(value)) do
    local entry = value[name]
    local child = field.children[name] or field.any or name == "schema" and { children = {} }
    t:ok(child, ("%s.%s is not on the page"):format(field.path, name))
    child.seen = true
    local objects = {}
    if type(entry) == "table" and not host.json.is_array(entry) then
      t:ok(not child.list, child.path .. " is no list, as the page has it")
      objects = { entry }
    elseif type(entry) == "table" and type(entry[1]) == "table"
      and not host.json.is_array(entry[1]) then
      t:ok(child.list, child.path .. " is a list of objects; the page should write [] after it")
      objects = entry
    end
    for _, object in ipairs(objects) do field_page.compare(t, object, child) end
  end
  for _, name in ipairs(choice.sorted_keys(field.children)) do
    local child = field.children[name]
    t:ok(value[name] ~= nil or field_page.is_optional(child),
      child.path .. " is absent and not optional on the page")
  end
end

--- Calls `visit` for each field of a tree, in order of names.
---@param visit fun(field: field_page.field)
function field_page.each(field, visit)
  for _, name in ipairs(choice.sorted_keys(field.children)) do
    visit(field.children[name])
    field_page.each(field.children[name], visit)
  end
  if field.any then
    visit(field.any)
    field_page.each(field.any, visit)
  end
end

return field_page
