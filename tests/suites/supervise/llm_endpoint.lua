--- llm_endpoint.lua: URL and key of a language model, from options, environment and key files; what
--- an experiment may not name; how a key is taken out of a text.

local base64 = require "limax.base.base64"
local choice = require "limax.base.choice"
local defaults = require "limax.settings.defaults"
local endpoint = require "limax.supervise.llm.endpoint"
local host = require "limax.host"
local options = require "limax.supervise.llm.options"
local process = require "support.process"
local text_of = require "limax.supervise.llm.text"

local suite = require("limax.test").suite "llm endpoint"

local KEY = "sk-SENTINEL/0123+456789=abcdef"

local function find(variables, changes)
  variables.LIMAX_LLM_MODEL = variables.LIMAX_LLM_MODEL or "m"
  return endpoint.find(changes or {}, function(name) return variables[name] end)
end

suite:test("a base URL with or without /v1 and /chat/completions is the same endpoint", function(t)
  for url, expected in pairs {
    ["http://127.0.0.1:8080"] = "http://127.0.0.1:8080/v1/chat/completions",
    ["http://127.0.0.1:8080/"] = "http://127.0.0.1:8080/v1/chat/completions",
    ["http://127.0.0.1:8080/v1"] = "http://127.0.0.1:8080/v1/chat/completions",
    ["http://127.0.0.1:8080/v1/"] = "http://127.0.0.1:8080/v1/chat/completions",
    ["http://127.0.0.1:8080/v1/chat/completions"] = "http://127.0.0.1:8080/v1/chat/completions",
    ["http://127.0.0.1:8080/v1/chat/completions/"] = "http://127.0.0.1:8080/v1/chat/completions",
    ["http://localhost/proxy"] = "http://localhost/proxy/v1/chat/completions",
    ["http://[::1]:11434/v1"] = "http://[::1]:11434/v1/chat/completions",
    ["https://openrouter.ai/api/v1"] = "https://openrouter.ai/api/v1/chat/completions",
    ["https://generativelanguage.googleapis.com/v1beta/openai"] =
      "https://generativelanguage.googleapis.com/v1beta/openai/chat/completions",
    ["https://x.openai.azure.com/openai/v1/"] =
      "https://x.openai.azure.com/openai/v1/chat/completions",
    ["https://x.openai.azure.com/openai/deployments/d?api-version=2024-10-21"] =
      "https://x.openai.azure.com/openai/deployments/d/chat/completions",
  } do
    local found, message = find { LIMAX_LLM_URL = url, LIMAX_LLM_KEY = KEY }
    t:equal(found and found.shown or message, expected)
    t:equal(found.url, expected .. (url:match "%?.*" or ""))
  end
end)

suite:test("the header of the key follows the host, or the option", function(t)
  local function header(url, changes)
    local headers = find({ LIMAX_LLM_URL = url, LIMAX_LLM_KEY = KEY }, changes).headers()
    return headers.Authorization, headers["api-key"]
  end
  local bearer = "Bearer " .. KEY
  t:equal({ header "https://example.org" }, { bearer })
  t:equal({ header "https://x.openai.azure.com" }, { nil, KEY })
  t:equal({ header "https://openai.azure.com.example.org" }, { bearer })
  t:equal({ header("https://example.org", { key_header = "api-key" }) }, { nil, KEY })
  t:equal({ header("https://x.openai.azure.com", { key_header = "authorization" }) }, { bearer })
  local headers = find({ LIMAX_LLM_URL = "http://127.0.0.1" }).headers()
  t:equal(headers, { Accept = "application/json", ["Content-Type"] = "application/json" })
end)

suite:test("url and model of an experiment win over the environment, a key is refused", function(t)
  local found = find({ LIMAX_LLM_URL = "http://127.0.0.1:1", LIMAX_LLM_MODEL = "a" },
    { url = "http://127.0.0.1:2", model = "b" })
  t:equal({ found.shown, found.model }, { "http://127.0.0.1:2/v1/chat/completions", "b" })
  for _, name in ipairs { "key", "api_key", "apikey", "api-key", "authorization", "token",
    "headers" } do
    t:raises("an experiment cannot name a key, because it is recorded with the run", function()
      choice.read("supervisor", { "llm", [name] = KEY }, { llm = { options = options.rules } })
    end)
  end
  local message = t:raises("budget: expected a number above 0", function()
    choice.read("supervisor", { "llm", budget = -1 }, { llm = { options = options.rules } })
  end)
  t:ok(message:find("(s)", 1, true), message)
end)

suite:test("OPENAI_API_KEY goes to OpenAI's own host over https and nowhere else", function(t)
  local function source(url, changes)
    local found = find({ LIMAX_LLM_URL = url, OPENAI_API_KEY = KEY }, changes)
    return found and (found.key_source or "none")
  end
  t:equal(source "https://api.openai.com/v1", "OPENAI_API_KEY")
  t:equal(source "https://API.OpenAI.com/v1", "OPENAI_API_KEY")
  for _, url in ipairs { "https://api.openai.com.example.org", "https://api.openai.com.",
    "https://eu.api.openai.com", "https://example.org/api.openai.com", "https://openai.com" } do
    t:equal(source(url), nil)
  end
  t:equal(source "http://127.0.0.1:8080", "none")
  t:equal(source("http://api.openai.com", { allow_insecure = true }), "none")
  t:equal(find({ LIMAX_LLM_URL = "https://api.openai.com", OPENAI_API_KEY = "a",
    LIMAX_LLM_KEY = "b" }).headers().Authorization, "Bearer b")
end)

suite:test("invalid URLs are refused without being printed", function(t)
  for url, expected in pairs {
    ["https://me:" .. KEY:gsub("[/+=]", "") .. "@example.org/v1"] = "contains credentials",
    ["https://me@example.org/v1"] = "contains credentials",
    ["https://example.org/v1?api_key=" .. KEY] = "looks like a key",
    ["https://example.org/v1?a=1&Token=" .. KEY] = "looks like a key",
    ["https://example.org/v1?x=" .. KEY] = "contains the key",
    ["https://example.org/v1#" .. KEY] = "a part after #",
    ["http://example.org/v1"] = "use https, or set allow_insecure = true",
    ["http://127.0.0.1.example.org/v1"] = "use https",
    ["http://10.0.0.1:8080"] = "use https",
    ["ftp://127.0.0.1/"] = "must start with https://",
    ["127.0.0.1:8080"] = "not a valid URL",
    ["http://127.0.0.1\r\nX: y"] = "not a valid URL",
  } do
    local found, message = find { LIMAX_LLM_URL = url, LIMAX_LLM_KEY = KEY }
    t:equal(found, nil)
    t:ok(message:find(expected, 1, true), message)
    t:ok(message:find("^LIMAX_LLM_URL: ") or expected == "contains the key", message)
    t:ok(not message:find("SENTINEL", 1, true), message)
  end
  local found, message = find {}
  t:equal(found, nil)
  t:ok(message:find("set LIMAX_LLM_URL", 1, true), message)
  found, message = find { LIMAX_LLM_URL = "https://example.org" }
  t:equal(found, nil)
  t:ok(message:find("no key for https://example.org: set LIMAX_LLM_KEY", 1, true), message)
  found, message = endpoint.find({ url = "http://127.0.0.1" }, function() return "" end)
  t:equal(found, nil)
  t:ok(message:find("no model is named: set LIMAX_LLM_MODEL", 1, true), message)
  t:equal(find({ LIMAX_LLM_URL = "http://10.0.0.1:8000" }, { allow_insecure = true }).shown,
    "http://10.0.0.1:8000/v1/chat/completions")
end)

suite:test("a key with a line break or a space is refused without being repeated",
  function(t)
    for key, expected in pairs { [KEY .. "\nX-Header: y"] = "contains a line break",
      [KEY .. "\r"] = "contains a line break", [KEY .. " x"] = "contains a space",
      ["\200" .. KEY] = "a character that no key has",
      [("k"):rep(8193)] = "longer than 8192 bytes" } do
      local found, message = find { LIMAX_LLM_URL = "http://127.0.0.1", LIMAX_LLM_KEY = key }
      t:equal(found, nil)
      t:ok(message:find("the key in LIMAX_LLM_KEY " .. "", 1, true) and message:find(expected, 1,
        true), message)
      t:ok(not message:find("SENTINEL", 1, true) and not message:find("kkk", 1, true), message)
    end
  end)

suite:test("a key file is read if only its owner can access it", function(t)
  local path = t:folder() .. "/key"
  local function asked()
    return find { LIMAX_LLM_URL = "http://127.0.0.1", LIMAX_LLM_KEY_FILE = path }
  end
  local function refused(expected)
    local found, message = asked()
    t:equal(found, nil)
    t:ok(message:find("^LIMAX_LLM_KEY_FILE: ") or message:find "^the key in the file", message)
    t:ok(message:find(expected, 1, true), message)
    t:ok(not message:find("SENTINEL", 1, true), message)
  end
  refused "No such file"
  process.write(path, KEY .. "\n")
  for _, mode in ipairs { "640", "604", "620" } do
    os.execute(("chmod %s %s"):format(mode, path))
    refused("accessible to other users; run: chmod 600 " .. path)
  end
  for _, mode in ipairs { "600", "400" } do
    os.execute(("chmod %s %s"):format(mode, path))
    local found = asked()
    t:equal({ found.headers().Authorization, found.key_source },
      { "Bearer " .. KEY, "the file of LIMAX_LLM_KEY_FILE" })
  end
  os.execute("chmod 600 " .. path)
  process.write(path, KEY .. "\nsecond")
  refused "contains a line break"
  process.write(path, "\n")
  refused "is empty"
  process.write(path, ("k"):rep(70000))
  refused "not a key"
  host.file.remove(path)
  host.file.mkdir(path)
  refused "is not a regular file"
  host.file.remove(path)
  -- a pipe without a writer does not block
  os.execute("mkfifo -m 600 " .. path)
  refused "is not a regular file"
end)

suite:test("no table of an endpoint holds the key", function(t)
  local found = find { LIMAX_LLM_URL = "http://127.0.0.1", LIMAX_LLM_KEY = KEY }
  for _, value in pairs(found) do
    t:ok(type(value) ~= "table")
    t:ok(not tostring(value):find("SENTINEL", 1, true))
  end
end)

local function each(text, format)
  return (text:gsub(".", function(letter) return format:format(letter:byte()) end))
end

suite:test("a key is taken out of a text in every form, whole or from its beginning", function(t)
  local redact, mark = text_of.redactor(KEY), text_of.MARK
  t:equal(redact("a " .. KEY .. " b " .. KEY), ("a %s b %s"):format(mark, mark))
  t:equal(redact(KEY .. KEY), mark .. mark)
  -- as in an error 401 of OpenAI
  t:equal(redact "Incorrect API key: sk-SENTI****cdef.",
    ("Incorrect API key: %s****cdef."):format(mark))
  for length = 8, #KEY do t:equal(redact("<" .. KEY:sub(1, length) .. ">"), "<" .. mark .. ">") end
  t:equal(redact("sk-SENT sk-"), "sk-SENT sk-")
  -- without its beginning
  for at = 2, #KEY - 11 do t:equal(redact("****" .. KEY:sub(at)), "****" .. mark) end
  for _, form in ipairs { each(KEY, "%%%02X"), each(KEY, "%%%02x"), each(KEY, "%02x"),
    each(KEY, "\\u%04x"), KEY:gsub("/", "\\/"), "sk-SENTINEL%2F0123%2B456789%3Dabcdef",
    "sk-SENTINEL%2f0123%2b456789%3dabcdef" } do
    local clean = redact("x" .. form .. "y")
    t:ok(#clean <= #mark + 2 and clean:find(mark, 1, true), clean)
  end
  -- within a longer text in base64, as in "Basic ..."
  for before = 0, 6 do
    for after = 0, 3 do
      local text = base64.encode(("u"):rep(before) .. KEY .. ("v"):rep(after))
      for _, form in ipairs { text, (text:gsub("+", "-"):gsub("/", "_")) } do
        local clean = redact(form)
        -- four letters on either side are made of the key and of its neighbours
        t:ok(clean:find(mark, 1, true) and #clean <= (before + after) * 1.34 + #mark + 8, clean)
      end
    end
  end
  -- JSON stays JSON
  local text = ('{"a":"%s","b":["x%s\\n","%s"]}'):format(KEY, KEY, each(KEY, "\\u%04x"))
  t:equal(host.json.decode(redact(text)), { a = "[key]", b = { "x[key]\n", "[key]" } })
  -- a placeholder is not a secret
  t:equal(text_of.redactor("none")("none"), "none")
  t:equal(text_of.redactor("sk-no-key-required")('"required"'), '"required"')
  t:equal(text_of.redactor(nil)(KEY), KEY)
  for _, other in ipairs { "", "sk-", '{"a":"\\u0000\\u001f"}', ("0123456789abcde"):rep(100),
    "%20%2F%3D" } do
    t:equal(redact(other), other)
  end
end)

suite:test("base64 is that of RFC 4648", function(t)
  for plain, text in pairs { [""] = "", f = "Zg==", fo = "Zm8=", foo = "Zm9v", foob = "Zm9vYg==",
    fooba = "Zm9vYmE=", foobar = "Zm9vYmFy", ["\255\239\190"] = "/+++" } do
    t:equal(base64.encode(plain), text)
  end
end)

suite:test("the client's page names every option and default, and its example runs", function(t)
  local page = process.read(host.home .. "/scripts/lib/supervise/llm/README.md")
  for name in pairs(options.rules) do
    t:ok(page:find("`" .. name .. "`", 1, true) or name:find "^api" or name == "token", name)
  end
  for _, name in ipairs { "budget", "budget_loopback", "timeout", "timeout_loopback",
    "max_tokens" } do
    local value = defaults.fields.llm[name].value
    t:ok(page:find("[^%d]" .. value .. "[^%d]"), name)
  end
  local example = page:match "```lua\n(.-)```"
  local status, output = process.script(t:folder(), example, "-u LIMAX_LLM_URL")
  t:equal(status, 0)
  t:ok(output:find("^no endpoint of a language model is configured"), output)
  status, output = process.script(t:folder(), example, "-u LIMAX_LLM_KEY -u LIMAX_LLM_KEY_FILE"
    .. " LIMAX_LLM_URL=http://127.0.0.1:9 LIMAX_LLM_MODEL=m")
  t:equal(status, 0)
  t:ok(output:find("^transport: .*\n3\thttp://127.0.0.1:9/v1/chat/completions\n"), output)
end)
