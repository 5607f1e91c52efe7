-- luacheck over bindings, scripts and tests: LuaJIT's globals and no others.
std = "luajit"
globals = {}
max_line_length = 100
-- a method need not use its object
self = false
-- "not (x > 0)" is also true of a NaN, "x <= 0" is not
ignore = { "581", "582" }
