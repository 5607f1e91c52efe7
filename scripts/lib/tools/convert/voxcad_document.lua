--- voxcad_document.lua: the elements of a .vxa. Elements that are looked up are marked as read;
--- the others are listed as lost.

local choice = require "limax.base.choice"
local host = require "limax.host"
local input = require "limax.tools.convert.input"

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

--- The root of a .vxa.
---@return limax.host.element VXA
function document.open(path)
  local root, message = host.xml(input.read(path), path)
  if not root then input.refuse(path, "%s", message:sub(#path + 3)) end
  if root.name ~= "VXA" then
    input.refuse(path, "its root is <%s>; expected <VXA>", root.name:sub(1, 40))
  end
  return root
end

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
