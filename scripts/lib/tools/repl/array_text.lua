--- array_text.lua: a summary of views and lists of numbers in one line: shape, minimum, mean,
--- maximum and number of NaN.

local array_text = {}

-- Minimum, mean and maximum of numbers, and the number of NaN.
local function measure(each)
  local low, high, sum, count, nan = math.huge, -math.huge, 0, 0, 0
  each(function(value)
    value = tonumber(value)
    if value ~= value then
      nan = nan + 1
    else
      low, high = math.min(low, value), math.max(high, value)
      sum, count = sum + value, count + 1
    end
  end)
  return { low = low, high = high, mean = sum / count, count = count, nan = nan }
end

local function described(facts, unit)
  if facts.count == 0 then return ("no number, NaN %d"):format(facts.nan) end
  return ("min %.6g, mean %.6g, max %.6g%s, NaN %d"):format(facts.low, facts.mean, facts.high,
    unit and unit ~= "" and " " .. unit or "", facts.nan)
end

-- Calls `act` with every number of nested lists.
local function walk(list, act)
  for _, value in ipairs(list) do
    if type(value) == "table" then walk(value, act) else act(value) end
  end
end

--- "view of center_of_mass [251][3]: min ..., mean ..., max ... m, NaN 0; 50 Hz".
function array_text.view(view)
  local valid, list = pcall(view.table, view)
  -- the view is no longer valid
  if not valid then return tostring(view) .. ": " .. tostring(list) end
  local function field(name)
    local known, value = pcall(function() return view[name] end)
    return known and value or nil
  end
  local rate = field "rate"
  return ("%s: %s%s"):format(tostring(view), described(measure(function(act) walk(list, act) end),
    field "unit"), rate and ("; %g Hz"):format(rate) or "")
end

--- The lengths of nested lists of numbers along their axes, nil for any other table.
---@return integer[]|nil
function array_text.shape(list)
  local size, keys = #list, 0
  for _ in pairs(list) do keys = keys + 1 end
  if size == 0 or keys ~= size then return nil end
  if type(list[1]) == "number" then
    for i = 2, size do
      if type(list[i]) ~= "number" then return nil end
    end
    return { size }
  end
  if type(list[1]) ~= "table" or getmetatable(list[1]) then return nil end
  local inner = array_text.shape(list[1])
  if not inner or #inner > 3 then return nil end
  for i = 2, size do
    local other = type(list[i]) == "table" and array_text.shape(list[i])
    if not other or table.concat(other, " ") ~= table.concat(inner, " ") then return nil end
  end
  return { size, unpack(inner) }
end

--- The summary of nested lists.
function array_text.list(list, shape)
  local lengths = {}
  for i, length in ipairs(shape) do lengths[i] = ("[%d]"):format(length) end
  return ("numbers %s: %s"):format(table.concat(lengths),
    described(measure(function(act) walk(list, act) end)))
end

return array_text
