--- control_page.lua: the table of sensors of CONTROL.md, between the lines `<!-- sensors -->` and
--- `<!-- end -->`, from the engine's list.

local engine = require "limax.engine"
local host = require "limax.host"
local source = require "limax.base.source"

local control_page = { path = "scripts/CONTROL.md" }

--- The text of the page with a table that is up to date.
function control_page.text()
  local lines = { "| sensor | | unit | 1 is | noise, delay |\n|---|---|---|---|---|\n" }
  for _, sensor in ipairs(engine.sensors()) do
    lines[#lines + 1] = ("| `%s`%s | %s | %s | %g | %s |\n"):format(sensor.name,
      sensor.components == 3 and " x, y, z" or "", sensor.note, sensor.unit, sensor.range,
      sensor.measured and "yes" or "no")
  end
  local page = assert(source.read(host.home .. "/" .. control_page.path))
  return (page:gsub("(<!%-%- sensors %-%->\n).-(<!%-%- end %-%->)", function(begins, ends)
    return begins .. table.concat(lines) .. ends
  end))
end

return control_page
