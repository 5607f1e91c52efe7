--- reference.lua: writes scripts/REFERENCE.md: `limax scripts/dev/reference.lua`, after a change of
--- a public name, a field or a comment.

local host = require "limax.host"
local page = require "limax.tools.reference.page"

assert(host.file.write_atomic(host.home .. "/" .. page.path, page.text()))
print(page.path)
