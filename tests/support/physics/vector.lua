--- vector.lua: arithmetic on lists of three numbers, and other helpers of the reference integrator.

local vector = { zero = { 0, 0, 0 } }

function vector.dot(a, b) return a[1] * b[1] + a[2] * b[2] + a[3] * b[3] end
--- a + s b
function vector.plus(a, s, b) return { a[1] + s * b[1], a[2] + s * b[2], a[3] + s * b[3] } end
function vector.minus(a, b) return { a[1] - b[1], a[2] - b[2], a[3] - b[3] } end
function vector.times(s, a) return { s * a[1], s * a[2], s * a[3] } end
function vector.length(a) return math.sqrt(vector.dot(a, a)) end
function vector.cross(a, b)
  return { a[2] * b[3] - a[3] * b[2], a[3] * b[1] - a[1] * b[3], a[1] * b[2] - a[2] * b[1] }
end
--- The part of v across a unit normal.
function vector.across(n, v) return vector.plus(v, -vector.dot(n, v), n) end

--- fun(i) for i = 1 to count.
function vector.each(count, fun)
  local list = {}
  for i = 1, count do list[i] = fun(i) end
  return list
end

--- Does a list of numbers come before another? Their first difference decides.
function vector.before(a, b)
  for k = 1, #a do
    if a[k] ~= b[k] then return a[k] < b[k] end
  end
  return false
end

local slot = require("ffi").new "float[1]"

--- The nearest fp32 number.
function vector.single(value)
  slot[0] = value
  return slot[0]
end

return vector
