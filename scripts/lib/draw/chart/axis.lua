--- axis.lua: logarithmic and linear axes of a chart: the range that holds all values, the place of
--- a value between 0 and 1, ticks and their labels.

local axis = {}

local SUPERSCRIPTS = { ["-"] = "⁻", ["0"] = "⁰", ["1"] = "¹", ["2"] = "²", ["3"] = "³",
  ["4"] = "⁴", ["5"] = "⁵", ["6"] = "⁶", ["7"] = "⁷", ["8"] = "⁸", ["9"] = "⁹" }

-- A digit times 10 to the power n; a plain number near 1.
local function power_text(digit, n)
  if n >= -2 and n <= 3 then return ("%g"):format(digit * 10 ^ n) end
  return (digit == 1 and "10" or digit .. "·10") .. tostring(n):gsub(".", SUPERSCRIPTS)
end

---@class limax.chart.tick
---@field at number 0 to 1
---@field text string|nil nil for a small tick
---@field value number

---@class limax.chart.axis
---@field place fun(value: number): number 0 at the low end, 1 at the high end; clamped
---@field ticks limax.chart.tick[]
---@field low number
---@field high number
---@field label string

local function logarithmic(low, high)
  local first, last = math.log10(low), math.log10(high)
  local ticks = {}
  local decades = last - first
  -- labels of more than eight decades would crowd each other
  local every = math.max(1, math.ceil(decades / 8))
  for n = math.floor(first), math.ceil(last) do
    for digit = 1, 9 do
      local value = digit * 10 ^ n
      local at = (math.log10(value) - first) / decades
      if at >= -1e-9 and at <= 1 + 1e-9 and (digit == 1 or decades < 6) then
        local text
        if digit == 1 and n % every == 0 then text = power_text(1, n) end
        -- two decades or less show their 2 and 5 too
        if decades <= 1.6 and (digit == 2 or digit == 5) then text = power_text(digit, n) end
        ticks[#ticks + 1] = { at = at, text = text, value = value }
      end
    end
  end
  return function(value)
    return (math.log10(math.min(math.max(value, low), high)) - first) / decades
  end, ticks
end

-- A round step (1, 2 or 5 times a power of ten) of which about `count` fill the range.
local function round_step(range, count)
  local raw = range / count
  local power = 10 ^ math.floor(math.log10(raw))
  for _, factor in ipairs { 1, 2, 5 } do
    if factor * power >= raw * 0.999 then return factor * power end
  end
  return 10 * power
end

local function linear(low, high, whole)
  local step, ticks = round_step(high - low, 5), {}
  if whole then step = math.max(step, 1) end
  for k = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) do
    -- + 0: no "-0"
    ticks[#ticks + 1] = { at = (k * step - low) / (high - low), value = k * step,
      text = ("%.10g"):format(k * step + 0) }
  end
  return function(value)
    return (math.min(math.max(value, low), high) - low) / (high - low)
  end, ticks
end

--- An axis that holds all `values`. A logarithmic one leaves out values up to 0 and spans half a
--- decade at least; `low` and `high` fix an end, and a linear axis of `whole` numbers has ticks at
--- whole numbers only.
---@param options { label: string, linear: boolean|nil, low: number|nil, high: number|nil,
--- whole: boolean|nil, text: nil|fun(value: number): string }
---@param values number[]
---@return limax.chart.axis
function axis.new(options, values)
  local low, high = options.low or math.huge, options.high or -math.huge
  for _, value in ipairs(values) do
    local fits = value == value and math.abs(value) < math.huge and (options.linear or value > 0)
    if fits and not options.low then low = math.min(low, value) end
    if fits and not options.high then high = math.max(high, value) end
  end
  if low > high then low, high = options.linear and 0 or 0.1, 1 end
  if options.linear then
    local room = high > low and 0.05 * (high - low) or math.max(0.05 * math.abs(low), 1e-3)
    low, high = options.low or low - room, options.high or high + room
  else
    -- a little room, and half a decade at least
    local room = math.max(1.25, math.sqrt(10 ^ 0.5 / (high / low)))
    low, high = options.low or low / room, options.high or high * room
  end
  local place, ticks = (options.linear and linear or logarithmic)(low, high, options.whole)
  if options.text then
    for _, tick in ipairs(ticks) do tick.text = tick.text and options.text(tick.value) end
  end
  return { place = place, ticks = ticks, low = low, high = high, label = options.label }
end

return axis
