--- axis.lua: the axes of a chart: the range that holds all values, the place of a value between 0
--- and 1, ticks and their labels.

local axis = {}

---@class limax.chart.tick
---@field at number 0 to 1
---@field text string
---@field value number

---@class limax.chart.axis
---@field place fun(value: number): number 0 at the low end, 1 at the high end; clamped
---@field ticks limax.chart.tick[]
---@field low number
---@field high number
---@field label string

-- A round step (1, 2 or 5 times a power of ten) of which about `count` fill the range.
local function round_step(range, count)
  local raw = range / count
  local power = 10 ^ math.floor(math.log10(raw))
  for _, factor in ipairs { 1, 2, 5 } do
    if factor * power >= raw * 0.999 then return factor * power end
  end
  return 10 * power
end

--- An axis that holds all `values`. `low` and `high` fix an end. With `whole` it has ticks at whole
--- numbers only.
---@param options { label: string, low: number|nil, high: number|nil, whole: boolean|nil }
function axis.new(options, values)
  local low, high = options.low or math.huge, options.high or -math.huge
  for _, value in ipairs(values) do
    local fits = value == value and math.abs(value) < math.huge
    if fits and not options.low then low = math.min(low, value) end
    if fits and not options.high then high = math.max(high, value) end
  end
  if low > high then low, high = 0, 1 end
  local room = high > low and 0.05 * (high - low) or math.max(0.05 * math.abs(low), 1e-3)
  low, high = options.low or low - room, options.high or high + room
  local step, ticks = round_step(high - low, 5), {}
  if options.whole then step = math.max(step, 1) end
  for k = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9) do
    -- + 0: no "-0"
    ticks[#ticks + 1] = { at = (k * step - low) / (high - low), value = k * step,
      text = ("%.10g"):format(k * step + 0) }
  end
  local function place(value)
    return (math.min(math.max(value, low), high) - low) / (high - low)
  end
  return { place = place, ticks = ticks, low = low, high = high, label = options.label }
end

return axis
