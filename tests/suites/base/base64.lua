--- base64.lua: bytes as base64 text.

local base64 = require "limax.base.base64"

local suite = require("limax.test").suite "base64"

suite:test("base64 is that of RFC 4648", function(t)
  for plain, text in pairs { [""] = "", f = "Zg==", fo = "Zm8=", foo = "Zm9v", foob = "Zm9vYg==",
    fooba = "Zm9vYmE=", foobar = "Zm9vYmFy", ["\255\239\190"] = "/+++" } do
    t:equal(base64.encode(plain), text)
  end
end)
