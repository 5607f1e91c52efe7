--- voxcad_document.lua: the elements of a .vxa, or of a .vxd over its base, before anything is made
--- of them.

local host = require "limax.host"
local input = require "limax.tools.convert.input"
local source = require "limax.base.source"

local voxcad_document = {}

--- The first child of that name, if the node is one and has it.
---@param node limax.host.element|nil
---@param name string
---@return limax.host.element|nil
local function child(node, name)
  for _, each in ipairs(node or {}) do
    if each.name == name then return each end
  end
end

--- The element at a path "A.B.C" below a node.
---@param node limax.host.element|nil
---@param path string
---@return limax.host.element|nil
local function at(node, path)
  for name in path:gmatch "[^.]+" do node = child(node, name) end
  return node
end

local function trimmed(text) return (text:gsub("^%s+", ""):gsub("%s+$", "")) end

--- A finite number at a path; `default` where the element is missing.
---@param file string for messages
---@param node limax.host.element
---@param path string
---@param default number|nil none: it must be there
---@return number
function voxcad_document.number_at(file, node, path, default)
  local found = at(node, path)
  if not found then
    if default == nil then input.refuse(file, "%s.%s is missing", node.name, path) end
    return default
  end
  local value = tonumber(trimmed(found.text))
  if not value or value ~= value or math.abs(value) == math.huge then
    input.refuse(file, "%s.%s is %q; expected a number", node.name, path,
      trimmed(found.text):sub(1, 40))
  end
  return value
end

--- The text of an element below a node, empty where either is missing.
---@param node limax.host.element|nil
---@param name string
---@return string
function voxcad_document.text_of(node, name)
  local found = child(node, name)
  return found and trimmed(found.text) or ""
end

local function parse(path)
  local root, message = host.xml(input.read(path), path)
  if not root then input.refuse(path, "%s", message:sub(#path + 3)) end
  return root
end

-- Puts an element of a .vxd in the place that its attribute `replace` names.
local function replace(file, root, element)
  local names = {}
  for name in element.attributes.replace:gmatch "[^.]+" do names[#names + 1] = name end
  if names[1] ~= "VXA" or #names < 2 then
    input.refuse(file, "VXD.%s: replace is %q; expected a path such as \"VXA.VXC.Structure\"",
      element.name, element.attributes.replace:sub(1, 60))
  end
  local node = root
  for k = 2, #names - 1 do
    local below = child(node, names[k])
    if not below then
      below = { name = names[k], text = "", attributes = {} }
      node[#node + 1] = below
    end
    node = below
  end
  for i, each in ipairs(node) do
    if each.name == names[#names] then
      node[i] = element
      return
    end
  end
  node[#node + 1] = element
end

--- The whole document: of a .vxd, its base with what it replaces.
---@param path string
---@param base string|nil the .vxa of a .vxd; base.vxa beside it
---@return limax.host.element VXA
function voxcad_document.open(path, base)
  local root = parse(path)
  if root.name == "VXA" then return root end
  if root.name ~= "VXD" then
    input.refuse(path, "its root is <%s>; expected <VXA> or <VXD>", root.name:sub(1, 40))
  end
  base = base or source.folder_of(path) .. "/base.vxa"
  if host.file.exists(base) ~= "file" then
    input.refuse(path, "a .vxd has no materials: name its .vxa with --base FILE, or put it beside"
      .. " it as base.vxa")
  end
  local whole = parse(base)
  if whole.name ~= "VXA" then
    input.refuse(base, "its root is <%s>; expected <VXA>", whole.name:sub(1, 40))
  end
  for _, element in ipairs(root) do
    if element.attributes.replace then replace(path, whole, element) end
  end
  return whole
end

voxcad_document.child, voxcad_document.at = child, at

return voxcad_document
