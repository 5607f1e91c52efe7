--- reference.lua: writes what is made from the API table: scripts/REFERENCE.md and the stub that
--- editors read. `limax scripts/dev/reference.lua`, after a change of a public name or its comment.

local host = require "limax.host"

for _, made in ipairs { require "limax.tools.reference.page", require "limax.tools.reference.stub" } do
  local path = host.home .. "/" .. made.path
  assert(host.file.mkdir(path:match "^(.*)/"))
  assert(host.file.write_atomic(path, made.text()))
  print(made.path)
end
