--- seal.lua: this user's key, whose a document is, and lines of JSON that begin with their hash.

local host = require "limax.host"
local process = require "support.process"
local sealed = require "limax.base.sealed"

local suite = require("limax.test").suite "seal"

-- Prints whose the documents in these files are. `+`: seals one into the next file.
local SCRIPT = [[
local host, seal = require "limax.host", require "limax.base.seal"
local adds = false
for _, word in ipairs(arg) do
  if word == "+" then
    adds = true
  elseif adds then
    adds = false
    host.file.write_atomic(word, seal.add { name = "r", run = { "x" } })
  else
    local object, whose, key = seal.open(io.open(word):read "*a", word)
    print(object and object.name .. #object.run .. tostring(object.seal), whose, key)
  end
end
]]

-- Runs the script with the key file of this name.
local function run(folder, key, words, environment)
  process.write(folder .. "/seal.lua", SCRIPT)
  return select(2, process.run(folder, { "seal.lua", unpack(words) },
    environment or ("LIMAX_KEY_FILE=%s/%s"):format(folder, key)))
end

suite:test("a document is this user's as long as no byte of it changes", function(t)
  local folder = t:folder()
  t:equal(run(folder, "keys/mine", { "+", "a", "a" }):match "^r1nil\town\t%x+\n$" ~= nil, true)
  local text = process.read(folder .. "/a")
  local key = host.file.read_private(folder .. "/keys/mine"):match "^(%x+)\n$"
  local name = host.sha256(key):sub(1, 8)
  -- the definition in seal.lua
  local body = '{\n  "name": "r",\n  "run": ["x"]'
  t:equal({ #key, text }, { 64, ('%s,\n  "seal": { "key": "%s", "hmac": "%s" }\n}\n'):format(body,
    name, host.hmac_sha256(key, body .. "\n}\n")) })
  t:equal(run(folder, "other", { "a", "+", "b" }), ("r1nil\tother\t%s\n"):format(name))
  local own, hmac = "r1nil\town\t" .. name .. "\n", ('"hmac": "%s"'):format(("0"):rep(64))
  for changed, expected in pairs { [text] = own, [text:gsub("x", "y")] = own:gsub("own", "edited"),
    [text:gsub("\n *", "")] = own:gsub("own", "edited"), [text .. " "] = own:gsub("own", "edited"),
    [text:gsub('"hmac": "%x+"', hmac)] = own:gsub("own", "edited"),
    [text:gsub('"key": "%x+"', '"key": "\\u001b[2J"')] = "r1nil\tedited\tnil\n",
    [body .. "\n}\n"] = "r1nil\tnone\tnil\n" } do
    process.write(folder .. "/c", changed)
    t:equal(run(folder, "keys/mine", { "c" }), expected)
  end
  process.write(folder .. "/c", text:sub(2))
  t:ok(run(folder, "keys/mine", { "c" }):find "^nil\tc: ", "no JSON")
end)

suite:test("without a private key documents are unsealed, with one warning", function(t)
  local folder = t:folder()
  run(folder, "mine", { "+", "a" })
  local warning = "limax: your key cannot be used, so files are neither sealed nor recognised as "
    .. "yours: "
  local documents = { "+", "b", "+", "c", "a", "b" }
  local key = host.file.read_private(folder .. "/mine")
  local name = host.sha256((key:gsub("\n", ""))):sub(1, 8)
  local unsealed = ("r1nil\tother\t%s\nr1nil\tnone\tnil\n"):format(name)
  local function refused(message, environment)
    t:equal(run(folder, "mine", documents, environment), warning .. message .. "\n" .. unsealed)
  end
  os.execute(("chmod 640 %s/mine"):format(folder))
  refused(("%s/mine is accessible to other users; run: chmod 600 %s/mine"):format(folder, folder))
  process.write(folder .. "/mine", key:sub(2))
  os.execute(("chmod 600 %s/mine"):format(folder))
  refused(folder .. "/mine is not a key of limax")
  -- neither a folder that cannot be made nor the working folder has the key
  refused(("cannot make the folder %s/a: Not a directory"):format(folder),
    ("LIMAX_KEY_FILE=%s/a/key"):format(folder))
  refused("$LIMAX_KEY_FILE is not an absolute path", "LIMAX_KEY_FILE=mine")
  refused("neither $XDG_CONFIG_HOME nor $HOME is an absolute path",
    "-u LIMAX_KEY_FILE HOME=. XDG_CONFIG_HOME=conf")
  t:equal({ host.file.exists(folder .. "/.config"), host.file.exists(folder .. "/conf") }, {})
  run(folder, nil, { "+", "b" }, ("-u LIMAX_KEY_FILE HOME=%s XDG_CONFIG_HOME=conf"):format(folder))
  t:ok(host.file.read_private(folder .. "/.config/limax/key"), "relative paths are passed over")
end)

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
