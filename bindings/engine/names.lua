--- names.lua: the enumerations of the C interface and the names that scripts use for their values.

local C = require("limax.engine.abi").C

local names = {}

---@class limax.enumeration
---@field text table<integer, string> name of a value
---@field value table<string, integer> value of a name
---@field names string[] the names, in the interface's order

-- The constants are named LIMAX_, `prefix` and the name in capitals.
local function enumeration(prefix, ...)
  local result = { text = {}, value = {}, names = { ... } }
  for _, name in ipairs(result.names) do
    local value = tonumber(C["LIMAX_" .. prefix .. name:upper():gsub(" ", "_")])
    result.text[value], result.value[name] = name, value
  end
  return result
end

names.material_kind = enumeration("", "empty", "passive", "expanding", "contracting")
names.body_status = enumeration("BODY_", "unknown", "valid", "no voxel", "no muscle")
names.stream = enumeration("STREAM_", "selection", "supervision", "user", "variation")
names.network = enumeration("NETWORK_", "fourier", "cppn", "direct", "none")
names.integrator = enumeration("", "symplectic_euler", "leapfrog", "rk4")
names.precision = enumeration("", "single", "compensated", "double")
names.sharing = enumeration("SHARING_", "mean", "sum")
names.bound = enumeration("BOUND_", "springs", "voxels")
names.robot_status = enumeration("ROBOT_", "skipped", "running", "done", "invalid", "diverged")
names.divergence = enumeration("", "nonfinite", "speed", "stretch", "control")
names.trace = enumeration("TRACE_", "center_of_mass", "position", "velocity", "contact", "energy",
  "strain", "activation", "sensor", "ledger", "block")

--- Columns of each trace, along its last axis. The works of `ledger` are since t = 0; `block` is
--- the centre of each rigid block and the quaternion that turns its own axes into the world's.
--- Those of `activation` and `sensor` are voxels of the lattice.
names.trace_columns = {
  center_of_mass = { "x", "y", "z" }, position = { "x", "y", "z" }, velocity = { "x", "y", "z" },
  contact = { "share of masses" }, energy = { "kinetic", "elastic", "gravitational",
    "muscle power" }, strain = { "mean", "most" },
  ledger = { "kinetic", "springs", "contact", "gravitational", "muscles", "damping",
    "contact_damping", "friction", "other" },
  block = { "x", "y", "z", "qw", "qx", "qy", "qz" }, activation = {}, sensor = {},
}

--- Unit of each trace; "J, J, J, W" is one for each column.
names.trace_unit = {
  center_of_mass = "m", position = "m", velocity = "m/s", contact = "1",
  energy = "J, J, J, W", strain = "1", ledger = "J",
  block = "m, m, m, 1, 1, 1, 1", activation = "1", sensor = "1",
}

return names
