--- names.lua: the enumerations of the C interface and the names that scripts use for their values.

local C = require("limax.engine.abi").C

local names = {}

---@class limax.enumeration
---@field text table<integer, string> name of a value
---@field value table<string, integer> value of a name
---@field names string[] the names, in the interface's order

-- A list of { name, constant }.
local function enumeration(list)
  local result = { text = {}, value = {}, names = {} }
  for i, pair in ipairs(list) do
    local name, value = pair[1], tonumber(C[pair[2]])
    result.text[value], result.value[name], result.names[i] = name, value, name
  end
  return result
end

names.material_kind = enumeration {
  { "empty", "LIMAX_EMPTY" }, { "passive", "LIMAX_PASSIVE" },
  { "expanding", "LIMAX_EXPANDING" }, { "contracting", "LIMAX_CONTRACTING" },
}

names.body_status = enumeration {
  { "unknown", "LIMAX_BODY_UNKNOWN" }, { "valid", "LIMAX_BODY_VALID" },
  { "no voxel", "LIMAX_BODY_NO_VOXEL" }, { "no muscle", "LIMAX_BODY_NO_MUSCLE" },
}

names.stream = enumeration {
  { "selection", "LIMAX_STREAM_SELECTION" }, { "supervision", "LIMAX_STREAM_SUPERVISION" },
  { "user", "LIMAX_STREAM_USER" },
}

names.integrator = enumeration {
  { "symplectic_euler", "LIMAX_SYMPLECTIC_EULER" }, { "leapfrog", "LIMAX_LEAPFROG" },
  { "rk4", "LIMAX_RK4" }, { "xpbd", "LIMAX_XPBD" },
}

names.precision = enumeration {
  { "single", "LIMAX_SINGLE" }, { "compensated", "LIMAX_COMPENSATED" },
  { "mixed", "LIMAX_MIXED" }, { "double", "LIMAX_DOUBLE" },
}

names.sharing = enumeration { { "mean", "LIMAX_SHARING_MEAN" }, { "sum", "LIMAX_SHARING_SUM" } }

names.robot_status = enumeration {
  { "skipped", "LIMAX_ROBOT_SKIPPED" }, { "running", "LIMAX_ROBOT_RUNNING" },
  { "done", "LIMAX_ROBOT_DONE" },
  { "invalid", "LIMAX_ROBOT_INVALID" }, { "diverged", "LIMAX_ROBOT_DIVERGED" },
}

names.divergence = enumeration {
  { "nonfinite", "LIMAX_NONFINITE" }, { "speed", "LIMAX_SPEED" }, { "stretch", "LIMAX_STRETCH" },
}

names.trace = enumeration {
  { "center_of_mass", "LIMAX_TRACE_CENTER_OF_MASS" }, { "position", "LIMAX_TRACE_POSITION" },
  { "velocity", "LIMAX_TRACE_VELOCITY" }, { "contact", "LIMAX_TRACE_CONTACT" },
  { "energy", "LIMAX_TRACE_ENERGY" }, { "strain", "LIMAX_TRACE_STRAIN" },
  { "ledger", "LIMAX_TRACE_LEDGER" }, { "block", "LIMAX_TRACE_BLOCK" },
}

--- Unit of each trace; "J, J, J, W" is one for each column.
names.trace_unit = {
  center_of_mass = "m", position = "m", velocity = "m/s", contact = "1",
  energy = "J, J, J, W", strain = "1", ledger = "J",
  block = "m, m, m, 1, 1, 1, 1",
}

return names
