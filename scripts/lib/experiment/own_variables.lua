--- own_variables.lua: finds functions of an experiment that keep results in variables of the
--- script, which are lost when a run continues. It compares the variables, and the entries of plain
--- tables in them, before and after a generation; it does not see deeper changes.

local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local source = require "limax.base.source"

local own_variables = {}

local function is_plain(value) return type(value) == "table" and getmetatable(value) == nil end

local function contains(entries, others)
  for key, entry in next, others do
    if not rawequal(entries[key], entry) then return false end
  end
  return true
end

--- Lists the variables of the functions in a value, and of functions in these, as they are now.
function own_variables.list(value, field, list)
  list = list or {}
  for _, key in ipairs(is_plain(value) and choice.sorted_keys(value) or {}) do
    own_variables.list(value[key], field or tostring(key), list)
  end
  local info = type(value) == "function" and debug.getinfo(value, "Su")
  if not info or list[value] or failure.is_ours(info.source) then return list end
  list[value] = true
  for k = 1, info.nups do
    local name, held = debug.getupvalue(value, k)
    if type(held) == "function" then own_variables.list(held, field, list) end
    local entries = {}
    for key, entry in next, is_plain(held) and held or {} do entries[key] = entry end
    list[#list + 1] = { field = field, call = value, k = k, name = name, value = held,
      entries = entries }
  end
  return list
end

--- A note on the listed variables that have changed; nil if none has.
---@param base string|nil folder that file names are relative to
function own_variables.note(list, base)
  local parts, first = {}, nil
  for _, each in ipairs(list) do
    local _, value = debug.getupvalue(each.call, each.k)
    if not rawequal(value, each.value) or is_plain(value)
      and not (contains(value, each.entries) and contains(each.entries, value)) then
      first = first or each
      parts[#parts + 1] = ("%s (%s)%s in `%s`"):format(each.field,
        source.place(source.describe(each.call, base)), parts[1] and "" or " keeps results",
        each.name)
    end
  end
  if not first then return nil end
  local example = type(first.value) == "number" and first.value or is_plain(first.value) and "{}"
  return ("%s: variables of a script are lost when a run continues; use state = function() return"
    .. " { %s = %s } end"):format(table.concat(parts, ", "), first.name, example or "...")
end

return own_variables
