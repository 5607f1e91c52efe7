--- reference.lua: writes scripts/REFERENCE.md and the tables of scripts/RUN_FOLDER.md and
--- scripts/CONTROL.md: `limax scripts/dev/reference.lua`, after a change of a public name, a field,
--- a sensor or a comment.

local host = require "limax.host"

for _, name in ipairs { "page", "run_folder_page", "control_page" } do
  local page = require("limax.tools.reference." .. name)
  assert(host.file.write_atomic(host.home .. "/" .. page.path, page.text()))
  print(page.path)
end
