--- output.lua: limax prints through one function, which shows control characters; bytes as base64.

local base64 = require "limax.base.base64"
local host = require "limax.host"
local process = require "support.process"
local shell = require "limax.base.shell"
local source = require "limax.base.source"
local terminal = require "limax.base.terminal"

local suite = require("limax.test").suite "output"

suite:test("control characters are shown, line ends and limax's own colours stay", function(t)
  local painted = terminal.paint("ä", 34, { color = true }) .. "\t\n"
  t:equal(terminal.shown(painted, true), painted)
  t:equal(terminal.shown(painted), "\\u001b[38;5;34mä\\u001b[0m\t\n")
  for text, shown in pairs { ["\27[2J\27[8mx\27"] = "\\u001b[2J\\u001b[8mx\\u001b",
    ["\0\7\r\127"] = "\\u0000\\u0007\\u000d\\u007f", ["\194\155c"] = "\\u009bc",
    ["\155c"] = "\\x9bc", ["a\226\128\174b\226\129\169\216\156"] = "a\\u202eb\\u2069\\u061c",
    ["“שלום” …"] = "“שלום” …" } do
    t:equal(terminal.shown(text, true), shown)
  end
end)

suite:test("a printed command names a folder with control characters", function(t)
  local name = "it's\na \\ \27[31mb\194\155\226\128\174"
  local command = shell.resume_command(name)
  t:equal(terminal.shown(command), command)
  local word = command:match "%-%-resume (.*)"
  t:equal(process.output("bash -c " .. process.quote("printf %s " .. word)), name)
end)

-- Files that write by themselves: the output of tests and users, the bar, a cleared screen.
local OTHERS = { ["scripts/lib/base/output.lua"] = true, ["scripts/commands/test.lua"] = true,
  ["scripts/lib/tools/console/activity.lua"] = true,
  ["scripts/lib/tools/console/progress.lua"] = true, ["scripts/commands/watch.lua"] = true }

suite:test("no other file of limax writes to a stream", function(t)
  local function visit(path)
    for _, name in ipairs(host.file.list(host.home .. "/" .. path) or {}) do
      visit(path .. "/" .. name)
    end
    if not path:match "%.lua$" or OTHERS[path] then return end
    for line in source.read(host.home .. "/" .. path):gmatch "[^\n]+" do
      t:ok(not line:find "io%.std%l+:write" and not line:find "io%.write"
        and not (" " .. line):find "[^%w_.:\"]print%s*[(\"']", path .. ": " .. line)
    end
  end
  visit "scripts/lib"
  visit "scripts/commands"
  visit "bindings/engine"
end)

suite:test("base64 is that of RFC 4648", function(t)
  for plain, text in pairs { [""] = "", f = "Zg==", fo = "Zm8=", foo = "Zm9v", foob = "Zm9vYg==",
    fooba = "Zm9vYmE=", foobar = "Zm9vYmFy", ["\255\239\190"] = "/+++" } do
    t:equal(base64.encode(plain), text)
  end
end)
