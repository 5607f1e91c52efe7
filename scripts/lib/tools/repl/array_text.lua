--- array_text.lua: a summary of views and lists of numbers in one line: shape, minimum, mean,
--- maximum and number of NaN.

local array_text = {}

-- Adds the numbers of nested lists to `facts`.
local function measure(list, facts)
  for _, value in ipairs(list) do
    if type(value) == "table" then
      measure(value, facts)
    elseif value ~= value then
      facts.nan = facts.nan + 1
    else
      value = tonumber(value)
      facts.low, facts.high = math.min(facts.low, value), math.max(facts.high, value)
      facts.sum, facts.count = facts.sum + value, facts.count + 1
    end
  end
  return facts
end

local function described(list, unit)
  local facts = measure(list, { low = math.huge, high = -math.huge, sum = 0, count = 0, nan = 0 })
  if facts.count == 0 then return ("no number, NaN %d"):format(facts.nan) end
  return ("min %.6g, mean %.6g, max %.6g%s, NaN %d"):format(facts.low, facts.sum / facts.count,
    facts.high, unit and unit ~= "" and " " .. unit or "", facts.nan)
end

--- "view of center_of_mass [251][3]: min ..., mean ..., max ... m, NaN 0; 50 Hz".
function array_text.view(view)
  local valid, list = pcall(view.table, view)
  -- the view is no longer valid
  if not valid then return tostring(view) .. ": " .. tostring(list) end
  return ("%s: %s%s"):format(tostring(view), described(list, view.unit),
    view.rate and ("; %g Hz"):format(view.rate) or "")
end

--- The lengths of nested lists of numbers along their axes, nil for any other table.
function array_text.shape(list)
  if type(list) ~= "table" or getmetatable(list) then return nil end
  local size, keys = #list, 0
  for _ in pairs(list) do keys = keys + 1 end
  if size == 0 or keys ~= size then return nil end
  local inner = type(list[1]) == "number" and {} or array_text.shape(list[1])
  if not inner or #inner > 3 then return nil end
  local text = table.concat(inner, " ")
  for i = 2, size do
    local other = type(list[i]) == "number" and {} or array_text.shape(list[i])
    if not other or table.concat(other, " ") ~= text then return nil end
  end
  return { size, unpack(inner) }
end

--- The summary of nested lists.
function array_text.list(list, shape)
  return ("numbers [%s]: %s"):format(table.concat(shape, "]["), described(list))
end

return array_text
