--- control.lua: controllers by name: each function writes a text in the language of CONTROL.md, and
--- returns what the `control` of a scene takes: `scene = { control = limax.control.sine {} }`.
---
--- Every function takes the fields of the effect `control` too, such as `rate` (Hz) and `noise`.
--- Activations act as the muscles' sine does: 1 lengthens an expanding muscle by its amplitude and
--- shortens a contracting one. Genes are those of control, `robots:control(i)`.

local engine = require "limax.engine"
local fault = require "limax.engine.fault"
local schema = require "limax.engine.schema"
local strict = require "limax.engine.strict"
local suggest = require "limax.engine.suggest"

-- A wrong option is an error of configuration, as it is in a scene.
local function configured(make)
  return function(...)
    local ok, result = pcall(make, ...)
    if ok then return result end
    if fault.is(result) and not result.status then result.kind, result.status = "usage", 2 end
    error(result, 0)
  end
end

local control = strict.module("limax.control", configured)

local MOST_LAYER = 64 -- inputs, hidden units and outputs of a perceptron
local MOST_GENES = 4096

-- The same sum as sin(2 pi frequency t + phase), of sensors that are exact at every time.
local SINE = "clock_sine * cos(phase) + clock_cosine * sin(phase)"

-- ---- options ------------------------------------------------------------------------------------

-- Checks the options of a function, and returns them completed, and a table with those that are
-- fields of the effect.
local function split(name, options, rules)
  local what = "control." .. name
  options = schema.demand(schema.table, options or {}, what)
  local known, fields = {}, {}
  for option in pairs(rules) do known[option] = true end
  for _, effect in ipairs(engine.effects()) do
    for _, field in ipairs(effect.name == "control" and effect.fields or {}) do
      known[field.name] = true
      local rule = schema.field(field)
      if options[field.name] ~= nil then
        fields[field.name] = schema.demand(rule, options[field.name], what .. "." .. field.name)
      end
    end
  end
  schema.known(options, known, what)
  local own = {}
  for option, rule in pairs(rules) do
    local value, message = rule(options[option], what .. "." .. option)
    if message then engine.fail(message) end
    own[option] = value
  end
  return own, fields
end

local base_rule = schema.choice { "passive", "sine" }

-- What zero genes give, as the beginning of a sum.
local function base_of(own) return own.base == "sine" and SINE .. " + " or "" end

-- ---- sensors ------------------------------------------------------------------------------------

local CLOCK = { "clock_sine", "clock_cosine" }

-- Sensors that differ between the voxels of a body.
local OF_VOXEL = { strain = true, strain_rate = true, load = true, contact = true,
  activation = true, place = true, phase = true }

-- The numbers that a sensor's name stands for, as a text names them.
local function numbers_of(name, path)
  if name == "clock" then return CLOCK end
  local names, numbers = { "clock" }, {}
  for _, each in ipairs(engine.sensors()) do
    names[#names + 1] = each.name
    local parts = {}
    for axis in ("xyz"):sub(1, each.components == 3 and 3 or 0):gmatch "." do
      parts[#parts + 1] = each.name .. "." .. axis
      names[#names + 1] = parts[#parts]
      numbers[parts[#parts]] = { parts[#parts] }
    end
    numbers[each.name] = each.components == 3 and parts or { each.name }
  end
  local sensor = type(name) == "string" and numbers[name]
  if not sensor then
    if type(name) ~= "string" then schema.refuse(path, "the name of a sensor", name) end
    engine.fail(("%s: there is no sensor %s%s"):format(path, schema.show(name),
      suggest.ending(name, names)))
  end
  return sensor
end

-- A list of sensors as a list of numbers; `of_body`: without those of a voxel.
local function sensors_of(name, list, of_body)
  local path, all = "control." .. name .. ".sensors", {}
  if not schema.list_size(list) or #list == 0 then
    schema.refuse(path, 'a list of sensors, such as { "gravity", "clock" }', list)
  end
  for i, sensor in ipairs(list) do
    local place = ("%s[%d]"):format(path, i)
    for _, number in ipairs(numbers_of(sensor, place)) do
      if of_body and OF_VOXEL[number:match "^[^.]*"] then
        engine.fail(("%s: %s differs from voxel to voxel, and a controller of the whole body reads"
          .. " sensors of the body and the scene; limax.control.network reads it"):format(place,
          sensor))
      end
      for _, other in ipairs(all) do
        if other == number then engine.fail(("%s: %s is listed twice"):format(place, number)) end
      end
      all[#all + 1] = number
    end
  end
  return all
end

-- One number that a voxel senses.
local function number_of(value, path)
  local numbers = numbers_of(value, path)
  if #numbers == 1 then return numbers[1] end
  schema.refuse(path, ('one number, such as "%s"'):format(numbers[1]), value)
end

-- ---- texts --------------------------------------------------------------------------------------

-- The genes of a perceptron, as the engine counts them.
local function genes_of_perceptron(inputs, hidden, outputs)
  return hidden * (4 * math.ceil((inputs + outputs) / 4) + 1) + outputs
end

-- The statement of a perceptron at g[0], and the first gene behind it.
local function perceptron(name, inputs, hidden, outputs)
  for what, count in pairs { inputs = #inputs, outputs = outputs } do
    if count > MOST_LAYER then
      engine.fail(("control.%s: its network has %d %s; at most %d are possible"):format(name, count,
        what, MOST_LAYER))
    end
  end
  local genes = genes_of_perceptron(#inputs, hidden, outputs)
  return ("real y[%d] = perceptron(%d, g[0], %s);"):format(outputs, hidden,
    table.concat(inputs, ", ")), genes
end

local function finished(fields, lines)
  fields.signal = table.concat(lines, "\n") .. "\n"
  return fields
end

-- ---- controllers --------------------------------------------------------------------------------

--- The open loop as a controller: a = sin(2 pi frequency t + phase), with the phase of each voxel's
--- muscle. It has no genes.
---@param options? table fields of the effect: `frequency` (Hz), `rate` (Hz), ...
---@return table control
function control.sine(options)
  local _, fields = split("sine", options, {})
  return finished(fields, { "a = " .. SINE .. ";" })
end

--- A reflex: a = -gain sensor, in every voxel; with a `frequency` added to the sine. The sensor is
--- in units of its range. With a gain above 0 a stretched expanding muscle shortens, so that the
--- reflex resists; in a contracting muscle the same gain assists. It has no genes; `gain` is a
--- parameter of the scene.
---@param options? table `gain` (0.5), `sensor` ("strain.x"), fields of the effect
---@return table control
function control.reflex(options)
  local own, fields = split("reflex", options, {
    gain = schema.number({ minimum = -1000, maximum = 1000 }, 0.5), sensor = schema.any })
  local sensor = number_of(own.sensor == nil and "strain.x" or own.sensor, "control.reflex.sensor")
  local sine = fields.frequency and SINE .. " " or ""
  fields.gain = own.gain
  return finished(fields, { ("a = %s- gain * %s;"):format(sine, sensor) })
end

--- One network that all voxels of a robot share: a perceptron over the sensors, the sums of each
--- message over the six neighbours, and the voxel's states. Its outputs are the activation, the
--- messages and the states; every sensor also has a weight that leads directly to the activation.
--- All weights are genes. States leak: s becomes (1 - leak) s + leak tanh(output). Zero genes give
--- a = 0, with base = "sine" the sine of `frequency`.
---@param options table `sensors` (names; "clock" is clock_sine and clock_cosine), `hidden` (16),
--- `messages` (0), `states` (0), `leak` (0.3), `base` ("passive" or "sine"), fields of the effect
---@return table control
function control.network(options)
  local own, fields = split("network", options, { sensors = schema.any,
    hidden = schema.whole(1, MOST_LAYER, 16), messages = schema.whole(0, 4, 0),
    states = schema.whole(0, 16, 0), leak = schema.number({ minimum = 0, maximum = 1 }, 0.3),
    base = base_rule })
  local sensors = sensors_of("network", own.sensors)
  local lines, inputs = {}, { unpack(sensors) }
  for m = 0, own.messages - 1 do
    local heard = {}
    for side = 0, 5 do heard[#heard + 1] = ("heard[%d]"):format(6 * m + side) end
    lines[#lines + 1] = ("real m%d = %s;"):format(m, table.concat(heard, " + "))
    inputs[#inputs + 1] = "m" .. m
  end
  for k = 0, own.states - 1 do inputs[#inputs + 1] = ("s[%d]"):format(k) end
  local network, gene = perceptron("network", inputs, own.hidden, 1 + own.messages + own.states)
  local last = gene + #sensors
  if last > MOST_GENES then
    engine.fail(("control.network: it has %d genes; at most %d are possible: take fewer hidden"
      .. " units or sensors"):format(last, MOST_GENES))
  end
  lines[#lines + 1] = network
  local sum = { "y[0]" }
  for i, sensor in ipairs(sensors) do sum[i + 1] = ("g[%d] * %s"):format(gene + i - 1, sensor) end
  lines[#lines + 1] = ("a = %stanh(%s);"):format(base_of(own), table.concat(sum, " + "))
  for m = 0, own.messages - 1 do
    lines[#lines + 1] = ("say[%d] = tanh(y[%d]);"):format(m, 1 + m)
  end
  for k = 0, own.states - 1 do
    lines[#lines + 1] = ("s[%d] = (1 - leak) * s[%d] + leak * tanh(y[%d]);"):format(k, k,
      1 + own.messages + k)
  end
  if own.states > 0 then fields.leak = own.leak end
  return finished(fields, lines)
end

-- The output of a voxel's group: its half along the first axis, and so on.
local GROUPS = {
  [2] = "place.x > 0 ? y[1] : y[0]",
  [4] = "place.y > 0 ? (place.x > 0 ? y[3] : y[2]) : (place.x > 0 ? y[1] : y[0])",
  [8] = "place.z > 0 ? (place.y > 0 ? (place.x > 0 ? y[7] : y[6]) : (place.x > 0 ? y[5] : y[4]))"
    .. " : (place.y > 0 ? (place.x > 0 ? y[3] : y[2]) : (place.x > 0 ? y[1] : y[0]))",
}

--- A controller of the whole body: a perceptron over sensors of the body and the scene with one
--- output for each group of voxels. Two groups are the halves of the lattice along x, four are
--- those along x and y, eight those along x, y and z; the middle of an odd number belongs to the
--- lower half. All weights are genes. Zero genes give a = 0, with base = "sine" the sine of
--- `frequency`.
---@param options table `sensors` (names; "clock" is clock_sine and clock_cosine), `groups` (8),
--- `hidden` (16), `base` ("passive" or "sine"), fields of the effect
---@return table control
function control.central(options)
  local own, fields = split("central", options, { sensors = schema.any,
    hidden = schema.whole(1, MOST_LAYER, 16), groups = schema.any, base = base_rule })
  local groups = own.groups == nil and 8 or own.groups
  if not GROUPS[groups] then schema.refuse("control.central.groups", "2, 4 or 8", groups) end
  local network = perceptron("central", sensors_of("central", own.sensors, true), own.hidden,
    groups)
  return finished(fields, { network,
    ("a = %stanh(%s);"):format(base_of(own), GROUPS[groups]) })
end

--- Coupled oscillators: each voxel has a phase p, which begins as that of its muscle, and
--- a = sin(2 pi frequency t + p). Neighbours across faces pull at each other:
--- dp/dt = 2 pi g[0] + g[1] sum of sin(p' - p) over them + g[2] `feedback`. g[0] is a change of
--- the frequency (Hz), g[1] is in rad/s; zero genes are the sine. `feedback` names a sensor.
--- Source: Kuramoto, "Self-entrainment of a population of coupled non-linear oscillators" (1975);
--- in robots Ijspeert, "Central pattern generators for locomotion control in animals and robots: a
--- review" (2008).
---@param options? table `feedback`, fields of the effect: `frequency` (Hz), ...
---@return table control
function control.oscillators(options)
  local own, fields = split("oscillators", options, { feedback = schema.any })
  local feedback = ""
  if own.feedback ~= nil then
    feedback = " + g[2] * " .. number_of(own.feedback, "control.oscillators.feedback")
  end
  -- s[0] is p less the muscle's phase, s[1] the time of the last tick; sine and cosine of p are
  -- messages, 0 from no neighbour
  local sine, cosine = {}, {}
  for side = 0, 5 do
    sine[#sine + 1] = ("heard[%d]"):format(side)
    cosine[#cosine + 1] = ("heard[%d]"):format(6 + side)
  end
  return finished(fields, {
    "real before = phase + s[0];",
    ("real pull = (%s) * cos(before) - (%s) * sin(before);"):format(table.concat(sine, " + "),
      table.concat(cosine, " + ")),
    ("s[0] += (t - s[1]) * (6.283185307179586 * g[0] + g[1] * pull%s);"):format(feedback),
    "s[1] = t;",
    "real p = phase + s[0];",
    "say[0] = sin(p);",
    "say[1] = cos(p);",
    "a = clock_sine * say[1] + clock_cosine * say[0];",
  })
end

return strict.close("limax.control", control)
