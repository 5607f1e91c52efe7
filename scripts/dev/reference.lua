--- reference.lua: writes scripts/REFERENCE.md and the generated tables of scripts/RUN_FOLDER.md:
--- `limax scripts/dev/reference.lua`, after a change of a public name, a field or a comment.

local host = require "limax.host"

for _, made in ipairs { require "limax.tools.reference.page",
  require "limax.tools.reference.run_folder" } do
  assert(host.file.write_atomic(host.home .. "/" .. made.path, made.text()))
  print(made.path)
end
