--- body.lua: a body as letters, as a lattice of voxels, and as facts for scripts. Letters come in
--- layers, the lowest first, separated by an empty line; the first line of a layer is y = 1, and
--- letters run along x from x = 1.

local strict = require "limax.engine.strict"

local body = {}

local function trimmed(line) return (line:gsub("^%s+", ""):gsub("%s+$", "")) end

--- Splits a text into layers of lines, without the spaces around lines.
---@return string[][] layers [z][y], lowest layer first
function body.layers(text)
  local layers, layer = {}, nil
  for line in (text .. "\n"):gmatch "([^\n]*)\n" do
    line = trimmed(line)
    if line == "" then
      layer = nil
    else
      if not layer then
        layer = {}
        layers[#layers + 1] = layer
      end
      layer[#layer + 1] = line
    end
  end
  return layers
end

--- The letters of a table of materials, as an error shows them.
function body.letters_of(materials)
  local texts = {}
  for i = 1, materials.count do
    local material = materials:get(i)
    texts[i] = ("%s (%s)"):format(material.letter, material.name)
  end
  return table.concat(texts, ", ")
end

--- Checks layers of letters: lines of equal length, layers of equal height, letters of materials.
---@param layers string[][]
---@return integer[]|nil size voxels along x, y, z
---@return string|nil message what is wrong, and where
function body.measure_layers(layers, materials)
  if #layers == 0 then return nil, "there is no voxel: expected at least one layer of letters" end
  local nx, ny = #layers[1][1], #layers[1]
  for z, layer in ipairs(layers) do
    if #layer ~= ny then
      return nil, ("layer %d has %d lines where layer 1 has %d; fill up with lines of .")
        :format(z, #layer, ny)
    end
    for y, line in ipairs(layer) do
      if #line ~= nx then
        return nil, ("layer %d, line %d has %d letters where the first line has %d; fill up with .")
          :format(z, y, #line, nx)
      end
      for x = 1, nx do
        local letter = line:sub(x, x)
        if not materials:index(letter) then
          return nil, ("layer %d, line %d: unknown letter %q; the letters are %s")
            :format(z, y, letter, body.letters_of(materials))
        end
      end
    end
  end
  return { nx, ny, #layers }
end

--- A nested list [i][j][k] of the values that a function gives.
---@param size integer[] largest i, j and k
---@param value fun(i: integer, j: integer, k: integer): any
function body.grid(size, value)
  local grid = {}
  for i = 1, size[1] do
    grid[i] = {}
    for j = 1, size[2] do
      grid[i][j] = {}
      for k = 1, size[3] do grid[i][j][k] = value(i, j, k) end
    end
  end
  return grid
end

--- The letters of layers as a lattice, padded with empty voxels.
---@param layers string[][]
---@param lattice integer[] voxels along x, y, z
---@return string[][][] letters [x][y][z]
function body.lattice(layers, lattice)
  return body.grid(lattice, function(x, y, z)
    local line = layers[z] and layers[z][y]
    return line and x <= #line and line:sub(x, x) or "."
  end)
end

--- The number of groups of voxels that share no corner, so that nothing joins them.
---@param voxels integer[][][] [x][y][z], 0 where it is empty
---@return integer
function body.groups(voxels)
  local seen, waiting, count = body.grid({ #voxels, #voxels[1], #voxels[1][1] },
    function(x, y, z) return voxels[x][y][z] == 0 end), {}, 0
  local function visit(x, y, z)
    local row = seen[x] and seen[x][y]
    if not row or row[z] ~= false then return false end
    row[z] = true
    waiting[#waiting + 1] = { x, y, z }
    return true
  end
  local function visit_neighbours(x, y, z)
    for near = 0, 26 do
      visit(x - 1 + near % 3, y - 1 + math.floor(near / 3) % 3, z - 1 + math.floor(near / 9))
    end
  end
  for x = 1, #seen do
    for y = 1, #seen[1] do
      for z = 1, #seen[1][1] do
        if visit(x, y, z) then count = count + 1 end
        while waiting[1] do visit_neighbours(unpack(table.remove(waiting))) end
      end
    end
  end
  return count
end

--- The facts of materials that the records of a population need: `letters` and `names` in their
--- order, `per_site` masses (kg) by voxel value, and `same`, that mass if it is equal for all.
function body.facts(materials)
  local facts, letters = { names = {}, per_site = {}, same = nil }, {}
  for m = 1, materials.count do
    local material = materials:get(m)
    letters[m], facts.names[m] = material.letter, material.name
    if material.kind ~= "empty" then
      facts.per_site[m - 1] = material.mass_per_site
      if facts.same == nil then facts.same = material.mass_per_site end
      if facts.same ~= material.mass_per_site then facts.same = false end
    end
  end
  facts.letters = table.concat(letters)
  return facts
end

--- The whole lattice of one robot as letters.
function body.letters(population, i, materials)
  return population:text(i, body.facts(materials).letters)
end

--- Mass of body i, kg: each used site has the mean of its voxels' mass_per_site.
---@param masses integer of the body
---@param facts table
function body.mass(population, i, masses, facts)
  if facts.same then return masses * facts.same end
  local voxels, total = population:voxels(i):table(), 0
  for x = 1, #voxels + 1 do
    for y = 1, #voxels[1] + 1 do
      for z = 1, #voxels[1][1] + 1 do
        local sum, owners = 0, 0
        for corner = 0, 7 do
          local column = voxels[x - corner % 2]
          local row = column and column[y - math.floor(corner / 2) % 2]
          local mass = row and facts.per_site[row[z - math.floor(corner / 4)]]
          if mass then sum, owners = sum + mass, owners + 1 end
        end
        if owners > 0 then total = total + sum / owners end
      end
    end
  end
  return total
end

---@class limax.body.record
---@field letters string the whole lattice
---@field hash string 16 hexadecimal digits; equal bodies have equal ones
---@field voxels integer that are not empty
---@field masses integer
---@field springs integer
---@field size integer[] extent in voxels along x, y, z
---@field counts table<string, integer> voxels of each material, empty ones included
---@field mass number kg

--- The record of a robot's body.
---@return limax.body.record
function body.record(population, i, materials)
  local facts = body.facts(materials)
  local shape, counts = population:body(i), {}
  for m, name in ipairs(facts.names) do counts[name] = shape.counts[m] end
  return { letters = population:text(i, facts.letters), hash = shape.hash,
    voxels = shape.voxels, masses = shape.masses, springs = shape.springs, size = shape.size,
    counts = counts, mass = body.mass(population, i, shape.masses, facts) }
end

---@class limax.robot.body
---@field size integer[] extent in voxels along x, y, z
---@field mass number its mass, kg
---@field count table<string, integer> voxels by name of material
---@field voxels integer that are not empty
---@field masses integer mass points
---@field springs integer springs
---@field hash string equal for equal bodies
---@field letters string layers separated by an empty line, the lowest first
---@field voxel string[][][] letters, [x][y][z]

-- The fields are in a table of their own, so that every assignment is seen.
local View, FIELDS = {}, {}

-- The lattice is made from the letters when it is first read: few robots need it.
function View:__index(key)
  local fields = rawget(self, FIELDS)
  if fields[key] ~= nil then return fields[key] end
  if key ~= "voxel" then strict.unknown("a body", key, fields, { voxel = true }) end
  local layers = body.layers(fields.letters)
  fields.voxel = body.lattice(layers, { #layers[1][1], #layers[1], #layers })
  return fields.voxel
end

View.__newindex = strict.read_only("a robot's body", "another body is another robot: limax.robot")

-- The voxels by name of material: a copy, in which an unknown name is an error.
local function counts_of(record)
  local counts = {}
  for name, count in pairs(record.counts) do counts[name] = count end
  return setmetatable(counts, { __index = function(_, name)
    strict.unknown("a body's count", name, record.counts)
  end })
end

--- A body as fitness, selection and supervisors read it. It shares no table with the record.
---@param record limax.body.record
---@return limax.robot.body
function body.view(record)
  return setmetatable({ [FIELDS] = { size = { unpack(record.size) }, mass = record.mass,
    count = counts_of(record), voxels = record.voxels, masses = record.masses,
    springs = record.springs, hash = record.hash, letters = record.letters } }, View)
end

return body
