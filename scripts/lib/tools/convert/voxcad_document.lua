--- voxcad_document.lua: the elements of a .vxa, or of a .vxd merged into its base. Elements that
--- are looked up are marked as read; the others are listed as lost.

local choice = require "limax.base.choice"
local host = require "limax.host"
local input = require "limax.tools.convert.input"
local source = require "limax.base.source"

local document = {}

-- The first child with a name.
local function child(node, name)
  for _, each in ipairs(node) do
    if each.name == name then return each end
  end
end

--- The element at a path "A.B.C" below a node.
function document.at(node, path)
  for name in path:gmatch "[^.]+" do
    node = node and child(node, name)
    if node then node.read = true end
  end
  return node
end

--- The children of a node with a name.
function document.children(node, name)
  local list = {}
  for _, each in ipairs(node or {}) do
    if each.name == name then
      each.read = true
      list[#list + 1] = each
    end
  end
  return list
end

local function trimmed(text) return text:match "^%s*(.-)%s*$" end

--- A finite number, or nil.
function document.number_of(text)
  local value = tonumber(text)
  return value and math.abs(value) < math.huge and value or nil
end

--- A finite number at a path; `default` where the element is missing.
---@param default number|nil nil: a missing element is an error
function document.number_at(file, node, path, default)
  local found = document.at(node, path)
  if not found then
    if default == nil then input.refuse(file, "%s.%s is missing", node.name, path) end
    return default
  end
  return document.number_of(trimmed(found.text)) or input.refuse(file,
    "%s.%s is %q; expected a number", node.name, path, trimmed(found.text):sub(1, 40))
end

--- The text at a path, empty where the element is missing.
function document.text_at(node, path)
  local found = document.at(node, path)
  return found and trimmed(found.text) or ""
end

-- ---- files --------------------------------------------------------------------------------------

local function parse(path, ...)
  local root, message = host.xml(input.read(path), path)
  if not root then input.refuse(path, "%s", message:sub(#path + 3)) end
  for _, name in ipairs { ... } do
    if root.name == name then return root end
  end
  input.refuse(path, "its root is <%s>; expected <%s>", root.name:sub(1, 40),
    table.concat({ ... }, "> or <"))
end

-- Puts an element of a .vxd into the place that its attribute `replace` names.
local function replace(file, root, element)
  local path, name = element.attributes.replace:match "^VXA%.(.-)%.?([^.]+)$"
  if not path then
    input.refuse(file, "VXD.%s: replace is %q; expected a path such as \"VXA.VXC.Structure\"",
      element.name, element.attributes.replace:sub(1, 60))
  end
  local node = root
  for each in path:gmatch "[^.]+" do
    local below = child(node, each)
    if not below then
      below = { name = each, text = "", attributes = {} }
      node[#node + 1] = below
    end
    node = below
  end
  element.name = name
  local place = #node + 1
  for i, each in ipairs(node) do
    if each.name == name then place = math.min(place, i) end
  end
  node[place] = element
end

--- The root of a .vxa, or of the base of a .vxd with the elements that it replaces.
---@param base string|nil the .vxa of a .vxd; base.vxa beside it if left out
---@return limax.host.element VXA
function document.open(path, base)
  local root = parse(path, "VXA", "VXD")
  if root.name == "VXA" then return root end
  base = base or source.folder_of(path) .. "/base.vxa"
  if host.file.exists(base) ~= "file" then
    input.refuse(path, "a .vxd has no materials: name its .vxa with --base FILE, or put it beside"
      .. " it as base.vxa")
  end
  local merged = parse(base, "VXA")
  for _, element in ipairs(root) do
    if element.attributes.replace then replace(path, merged, element) end
  end
  return merged
end

-- ---- losses -------------------------------------------------------------------------------------

-- Elements without a meaning in limax; Poisson's ratio is that of its lattice of springs.
local IGNORED = { ["Simulator"] = true, ["VXC.Voxel"] = true,
  ["VXC.Palette.Material.Display"] = true,
  ["VXC.Palette.Material.Mechanical.Poissons_Ratio"] = true }

-- Does an element hold a word, or a number that has an effect? 0 has none, nor 1 in a lattice.
local function has_content(element, path)
  local number = tonumber(element.text)
  if number and number ~= 0 and not (number == 1 and path:find "^VXC%.Lattice") then return true end
  if not number and element.text:find "%w" then return true end
  for _, each in ipairs(element) do
    if has_content(each, path) then return true end
  end
  return false
end

local function collect(element, path, found)
  for _, each in ipairs(element) do
    local below = path .. each.name
    if each.read then
      collect(each, below .. ".", found)
    elseif not IGNORED[below] and has_content(each, below) then
      found[below:gsub("%c", ""):gsub("^VXC%.Structure", "Structure"):sub(1, 80)] = true
    end
  end
end

--- Names of the elements that hold something and have not been read, sorted.
function document.unread(root)
  local found = {}
  collect(root, "", found)
  return choice.sorted_keys(found)
end

return document
