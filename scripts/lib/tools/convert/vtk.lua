--- vtk.lua: a body as VTK's unstructured grid (.vtu): a hexahedron for each voxel with its
--- material, weights and strain. A simulated robot becomes a .pvd, a series of grids. SI units.

local body = require "limax.robot.body"
local robot_file = require "limax.robot.robot_file"
local source = require "limax.base.source"
local xml = require "limax.tools.convert.xml"

local vtk = {}

-- VTK's number of a hexahedron, its corners in VTK's order, and the twelve edges between them.
local HEXAHEDRON = 12
local CORNERS = { { 0, 0, 0 }, { 1, 0, 0 }, { 1, 1, 0 }, { 0, 1, 0 },
  { 0, 0, 1 }, { 1, 0, 1 }, { 1, 1, 1 }, { 0, 1, 1 } }
local EDGES = { { 1, 2 }, { 2, 3 }, { 3, 4 }, { 4, 1 }, { 5, 6 }, { 6, 7 }, { 7, 8 }, { 8, 5 },
  { 1, 5 }, { 2, 6 }, { 3, 7 }, { 4, 8 } }

local function file_of(kind, content)
  local tag = ('VTKFile type="%s" version="0.1" byte_order="LittleEndian"'):format(kind)
  return '<?xml version="1.0"?>\n' .. xml.element(tag, xml.element(kind, content)) .. "\n"
end

-- The voxels that are not empty: the sites of their corners, in VTK's order, and lists of numbers
-- { name, type, numbers } for each voxel.
local function cells_of(description)
  local nx, ny, nz = unpack(description.lattice)
  local voxel = body.lattice(description.voxels, description.lattice)
  local index, materials = {}, {}
  for i, material in ipairs(description.materials.materials) do index[material.letter] = i - 1 end
  local cells = { corners = {}, data = { { "material", "UInt8", materials } } }
  for k, name in ipairs(robot_file.weights) do
    cells.data[k + 1] = { name .. "_weight", "Float32", {} }
  end
  local function add(x, y, z)
    local corners = {}
    for c, at in ipairs(CORNERS) do
      corners[c] = x - 1 + at[1] + (nx + 1) * (y - 1 + at[2] + (ny + 1) * (z - 1 + at[3]))
    end
    table.insert(cells.corners, corners)
    table.insert(materials, index[voxel[x][y][z]])
    for k, name in ipairs(robot_file.weights) do
      local weight = description.weights[name]
      table.insert(cells.data[k + 1][3], type(weight) == "table" and weight[z][y][x] or weight)
    end
  end
  for z = 1, nz do
    for y = 1, ny do
      for x = 1, nx do
        if voxel[x][y][z] ~= "." then add(x, y, z) end
      end
    end
  end
  return cells
end

local function array(name, kind, numbers, attributes)
  local texts = {}
  for i, value in ipairs(numbers) do texts[i] = ("%.9g"):format(value) end
  local tag = ('DataArray type="%s" Name="%s" format="ascii"%s'):format(kind, name,
    attributes or "")
  return xml.element(tag, table.concat(texts, " "))
end

-- The mean of |length - edge| / edge over the edges of each voxel.
local function strains_of(cells, position, edge)
  local strains = {}
  for i, corners in ipairs(cells.corners) do
    local sum = 0
    for _, ends in ipairs(EDGES) do
      local a, b = position[corners[ends[1]]], position[corners[ends[2]]]
      local length = math.sqrt((a[1] - b[1]) ^ 2 + (a[2] - b[2]) ^ 2 + (a[3] - b[3]) ^ 2)
      sum = sum + math.abs(length - edge) / edge / #EDGES
    end
    strains[i] = sum
  end
  return strains
end

-- The text of a grid: `sites` in the order of the points, `position` (m) by site, `edge` (m) of a
-- voxel at rest.
local function grid(cells, sites, position, edge)
  local points, index = {}, {}
  for i, site in ipairs(sites) do
    index[site] = i - 1
    for k = 1, 3 do points[3 * (i - 1) + k] = position[site][k] end
  end
  local connectivity, offsets, types, data = {}, {}, {}, {}
  for i, corners in ipairs(cells.corners) do
    for _, site in ipairs(corners) do connectivity[#connectivity + 1] = index[site] end
    offsets[i], types[i] = 8 * i, HEXAHEDRON
  end
  for k, each in ipairs(cells.data) do data[k] = array(unpack(each)) end
  data[#data + 1] = array("strain", "Float64", strains_of(cells, position, edge))
  local piece = ('Piece NumberOfPoints="%d" NumberOfCells="%d"'):format(#sites, #cells.corners)
  return file_of("UnstructuredGrid", xml.element(piece,
    xml.element("Points", array("Points", "Float64", points, ' NumberOfComponents="3"')),
    xml.element("Cells", array("connectivity", "Int32", connectivity),
      array("offsets", "Int32", offsets), array("types", "UInt8", types)),
    xml.element('CellData Scalars="material"', table.concat(data, "\n"))))
end

--- A body at rest.
function vtk.at_rest(description, edge)
  local cells = cells_of(description)
  local nx, ny = description.lattice[1], description.lattice[2]
  local sites, position = {}, {}
  for _, corners in ipairs(cells.corners) do
    for _, site in ipairs(corners) do
      if not position[site] then
        sites[#sites + 1] = site
        local row = math.floor(site / (nx + 1))
        position[site] = { site % (nx + 1) * edge, row % (ny + 1) * edge,
          math.floor(row / (ny + 1)) * edge }
      end
    end
  end
  table.sort(sites)
  return grid(cells, sites, position, edge)
end

--- A simulated robot: a .vtu for each sample of its trace `position`, and the .pvd, written last.
---@param path string of the .pvd
---@return { [1]: string, [2]: string }[] path and text of each file
function vtk.series(simulated, edge, path)
  local cells, trace = cells_of(simulated:table()), simulated:trace "position"
  local sites = simulated.context.simulation:sites(simulated.context.index):table()
  local stem = path:gsub("%.[^.]*$", "")
  local files, entries = {}, {}
  for sample = 1, trace:size() do
    local position = {}
    for mass, point in ipairs(trace[sample]:table()) do position[sites[mass]] = point end
    local name = ("%s_%04d.vtu"):format(stem, sample - 1)
    files[sample] = { name, grid(cells, sites, position, edge) }
    entries[sample] = ('<DataSet timestep="%.9g" part="0" file="%s"/>'):format(
      (sample - 1) / trace.rate, xml.escaped(source.name_of(name)))
  end
  files[#files + 1] = { path, file_of("Collection", table.concat(entries, "\n")) }
  return files
end

return vtk
