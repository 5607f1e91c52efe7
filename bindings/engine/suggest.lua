--- suggest.lua: the known name nearest to an unknown one, by edit distance, for error messages.

local suggest = {}

--- Number of inserted, deleted, replaced or swapped neighbouring letters that turn `a` into `b`
--- (optimal string alignment distance), case ignored.
function suggest.distance(a, b)
  a, b = a:lower(), b:lower()
  local before, row = {}, {} -- rows i - 2 and i - 1 of the table
  for j = 0, #b do row[j] = j end
  for i = 1, #a do
    local this = { [0] = i }
    for j = 1, #b do
      local same = a:byte(i) == b:byte(j)
      local cost = math.min(row[j] + 1, this[j - 1] + 1, row[j - 1] + (same and 0 or 1))
      if i > 1 and j > 1 and a:byte(i) == b:byte(j - 1) and a:byte(i - 1) == b:byte(j) then
        cost = math.min(cost, before[j - 2] + 1)
      end
      this[j] = cost
    end
    before, row = row, this
  end
  return row[#b]
end

-- Words for a candidate that no typing error explains.
local SYNONYMS = { gpu = "cuda", nvidia = "cuda" }

--- The candidate nearest to `name`, or nil if none is near enough for a typing error. Of equally
--- near ones the first in the alphabet.
function suggest.nearest(name, candidates)
  if type(name) ~= "string" or name == "" then return nil end
  local best, best_distance
  for _, candidate in ipairs(candidates) do
    local distance = suggest.distance(name, candidate)
    local longer = math.max(#name, #candidate)
    -- a beginning ("grav") always counts as near; else up to a third of the letters may differ,
    -- one at least
    local starts = #name >= 3 and candidate:lower():sub(1, #name) == name:lower()
    if starts then distance = math.min(distance, 1) end
    if candidate == SYNONYMS[name:lower()] then return candidate end
    if distance <= math.max(1, math.floor((longer + 1) / 3)) and distance < longer then
      if best == nil or distance < best_distance
        or distance == best_distance and candidate < best then
        best, best_distance = candidate, distance
      end
    end
  end
  return best
end

--- The end of a message about an unknown name: a suggestion, else the list of candidates.
--- `suggest.ending("gravty", { "gravity", "ground" })` is `; did you mean "gravity"?`
function suggest.ending(name, candidates)
  local nearest = suggest.nearest(name, candidates)
  if nearest then return ('; did you mean "%s"?'):format(nearest) end
  if #candidates == 0 then return "" end
  local sorted = { unpack(candidates) }
  table.sort(sorted)
  return "; known are: " .. table.concat(sorted, ", ")
end

return suggest
