--- stub.lua: writes the stub that editors read: `limax scripts/dev/stub.lua [FILE]`. The build
--- runs it.

local host = require "limax.host"
local stub = require "limax.tools.reference.stub"

local path = arg[1] or host.home .. "/scripts/meta/limax.lua"
assert(host.file.mkdir(path:match "^(.*)/" or "."))
assert(host.file.write_atomic(path, stub.text()))
