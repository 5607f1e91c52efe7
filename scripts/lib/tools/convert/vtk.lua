--- vtk.lua: a body as VTK's unstructured grid (.vtu), a hexahedron for each voxel with its
--- material, weights and strain; and a walk as a series of them under a .pvd. SI units. ASCII:
--- every reader takes it.

local body = require "limax.robot.body"
local robot_file = require "limax.robot.robot_file"
local source = require "limax.base.source"
local xml = require "limax.tools.convert.xml"

local vtk = {}

-- VTK's number of a hexahedron, and its corners in VTK's order.
local HEXAHEDRON = 12
local CORNERS = { { 0, 0, 0 }, { 1, 0, 0 }, { 1, 1, 0 }, { 0, 1, 0 },
  { 0, 0, 1 }, { 1, 0, 1 }, { 1, 1, 1 }, { 0, 1, 1 } }
-- The twelve edges between those corners.
local EDGES = { { 1, 2 }, { 2, 3 }, { 3, 4 }, { 4, 1 }, { 5, 6 }, { 6, 7 }, { 7, 8 }, { 8, 5 },
  { 1, 5 }, { 2, 6 }, { 3, 7 }, { 4, 8 } }

---@class limax.convert.cells
---@field corners integer[][] sites of each voxel's corners, in VTK's order
---@field data table[] { name, type, numbers }

--- The voxels of a description that are not empty, and what each carries.
---@param description limax.robot.description
---@return limax.convert.cells
function vtk.cells(description)
  local nx, ny, nz = unpack(description.lattice)
  local voxel = body.lattice(description.voxels, description.lattice)
  local index = {}
  for i, material in ipairs(description.materials.materials) do index[material.letter] = i - 1 end
  local cells = { corners = {}, data = { { "material", "UInt8", {} } } }
  for k, name in ipairs(robot_file.weights) do
    cells.data[k + 1] = { name .. "_weight", "Float32", {} }
  end
  for z = 1, nz do
    for y = 1, ny do
      for x = 1, nx do
        if voxel[x][y][z] ~= "." then
          local corners = {}
          for c, at in ipairs(CORNERS) do
            corners[c] = x - 1 + at[1] + (nx + 1) * (y - 1 + at[2] + (ny + 1) * (z - 1 + at[3]))
          end
          table.insert(cells.corners, corners)
          table.insert(cells.data[1][3], index[voxel[x][y][z]])
          for k, name in ipairs(robot_file.weights) do
            local weight = description.weights[name]
            if type(weight) == "table" then weight = weight[z][y][x] end
            table.insert(cells.data[k + 1][3], weight)
          end
        end
      end
    end
  end
  return cells
end

local function array(name, kind, numbers, components)
  local texts = {}
  for i, value in ipairs(numbers) do texts[i] = ("%.9g"):format(value) end
  local attributes = ('type="%s" Name="%s" format="ascii"'):format(kind, name)
  if components then attributes = attributes .. (' NumberOfComponents="%d"'):format(components) end
  return ("<DataArray %s>\n%s\n</DataArray>"):format(attributes, table.concat(texts, " "))
end

-- Mean of |length - edge| / edge over the edges of each cell.
local function strains_of(cells, position, edge)
  local list = {}
  for i, corners in ipairs(cells.corners) do
    local sum = 0
    for _, ends in ipairs(EDGES) do
      local a, b = position[corners[ends[1]]], position[corners[ends[2]]]
      local length = math.sqrt((a[1] - b[1]) ^ 2 + (a[2] - b[2]) ^ 2 + (a[3] - b[3]) ^ 2)
      sum = sum + math.abs(length - edge) / edge / #EDGES
    end
    list[i] = sum
  end
  return list
end

--- One grid.
---@param cells limax.convert.cells
---@param sites integer[] in the order of the points
---@param position table<integer, number[]> m, by site
---@param edge number m, of a voxel at rest
---@return string
function vtk.grid(cells, sites, position, edge)
  local points, index = {}, {}
  for i, site in ipairs(sites) do
    index[site] = i - 1
    for k = 1, 3 do points[3 * (i - 1) + k] = position[site][k] end
  end
  local connectivity, offsets, types = {}, {}, {}
  for i, corners in ipairs(cells.corners) do
    for _, site in ipairs(corners) do connectivity[#connectivity + 1] = index[site] end
    offsets[i], types[i] = 8 * i, HEXAHEDRON
  end
  local data = {}
  for k, each in ipairs(cells.data) do data[k] = array(each[1], each[2], each[3]) end
  data[#data + 1] = array("strain", "Float64", strains_of(cells, position, edge))
  return table.concat({
    '<?xml version="1.0"?>',
    '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian">',
    "<UnstructuredGrid>",
    ('<Piece NumberOfPoints="%d" NumberOfCells="%d">'):format(#sites, #cells.corners),
    "<Points>", array("Points", "Float64", points, 3), "</Points>",
    "<Cells>", array("connectivity", "Int32", connectivity), array("offsets", "Int32", offsets),
    array("types", "UInt8", types), "</Cells>",
    '<CellData Scalars="material">', table.concat(data, "\n"), "</CellData>",
    "</Piece>", "</UnstructuredGrid>", "</VTKFile>",
  }, "\n") .. "\n"
end

--- A body at rest.
---@param description limax.robot.description
---@param edge number m
---@return string
function vtk.at_rest(description, edge)
  local cells = vtk.cells(description)
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
  return vtk.grid(cells, sites, position, edge)
end

--- A walk: the .pvd, and a .vtu for each sample of the trace of positions.
---@param walked limax.scored_robot
---@param edge number m
---@param path string of the .pvd
---@return { [1]: string, [2]: string }[] path and text of each file
function vtk.series(walked, edge, path)
  local cells, trace = vtk.cells(walked:table()), walked:trace "position"
  local sites = walked.context.simulation:sites(walked.context.index):table()
  local stem = path:gsub("%.[^.]*$", "")
  local files, entries = {}, {}
  for sample = 1, trace:size() do
    local position = {}
    for mass, point in ipairs(trace[sample]:table()) do position[sites[mass]] = point end
    local name = ("%s_%04d.vtu"):format(stem, sample - 1)
    files[sample] = { name, vtk.grid(cells, sites, position, edge) }
    entries[sample] = ('<DataSet timestep="%.9g" part="0" file="%s"/>'):format(
      (sample - 1) / trace.rate, xml.escaped(source.name_of(name)))
  end
  -- last: a series that is there is whole
  files[#files + 1] = { path, table.concat({ '<?xml version="1.0"?>',
    '<VTKFile type="Collection" version="0.1" byte_order="LittleEndian">', "<Collection>",
    table.concat(entries, "\n"), "</Collection>", "</VTKFile>" }, "\n") .. "\n" }
  return files
end

return vtk
