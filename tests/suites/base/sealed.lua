--- sealed.lua: lines of JSON that begin with their hash.

local host = require "limax.host"
local sealed = require "limax.base.sealed"

local suite = require("limax.test").suite "sealed"

suite:test("a sealed line gives its object back, and a change of any byte is found", function(t)
  local rest = ',"champion":{"hash":"a"},"name":"{\\"hash\\":"}'
  local line = '{"hash":"' .. host.xxh3(rest) .. '"' .. rest
  local json = '{"champion":{"hash":"a"},"name":"{\\"hash\\":"}'
  t:equal({ sealed.add(json), sealed.add(json .. "\n") }, { line, line .. "\n" })
  t:equal({ sealed.open(line), sealed.open(line .. "\n") },
    { host.json.decode(json), host.json.decode(json) })
  t:equal(sealed.open(sealed.add "{}"), {})
  local found = 0
  for i = 1, #line do
    local changed = line:sub(1, i - 1) .. string.char(bit.bxor(line:byte(i), 1)) .. line:sub(i + 1)
    if not sealed.check(changed) and not sealed.check(line:sub(1, i - 1)) then found = found + 1 end
  end
  t:equal(found, #line)
  -- neither two lines nor a line with the hash at another place
  for _, text in ipairs { line .. "\n\n", line .. "\n" .. line, line:gsub("^{", "{ "), "", "{}" } do
    t:equal({ sealed.check(text), sealed.open(text) }, { false, nil, "does not match its hash" })
  end
end)
