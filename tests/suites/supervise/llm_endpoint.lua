--- llm_endpoint.lua: URL and key of a language model, from options, environment and key files; what
--- an experiment may not name; how the key is replaced in a text.

local choice = require "limax.base.choice"
local endpoint = require "limax.supervise.llm.endpoint"
local host = require "limax.host"
local llm = require "limax.supervise.llm"
local process = require "support.process"

local suite = require("limax.test").suite "llm endpoint"

local KEY = require("support.model_stage").KEY
local HERE, AZURE = "http://127.0.0.1:8080", "https://x.openai.azure.com"

local function find(variables, changes)
  variables.LIMAX_LLM_MODEL = variables.LIMAX_LLM_MODEL or "m"
  return endpoint.find(changes or {}, function(name) return variables[name] end)
end

suite:test("a base URL with or without /v1 and /chat/completions is the same endpoint", function(t)
  for url, expected in pairs {
    [HERE] = HERE .. "/v1", [HERE .. "/"] = HERE .. "/v1", [HERE .. "/v1"] = HERE .. "/v1",
    [HERE .. "/v1/chat/completions/"] = HERE .. "/v1",
    [AZURE .. "/openai/v1/"] = AZURE .. "/openai/v1",
    [AZURE .. "/openai/deployments/d?api-version=2024-10-21"] = AZURE .. "/openai/deployments/d",
  } do
    local found, message = find { LIMAX_LLM_URL = url, LIMAX_LLM_KEY = KEY }
    t:equal(found and found.shown or message, expected .. "/chat/completions")
    t:equal(found.url, found.shown .. (url:match "%?.*" or ""))
  end
  local found = find({ LIMAX_LLM_URL = HERE, LIMAX_LLM_MODEL = "a" },
    { url = "http://127.0.0.1:2", model = "b" })
  t:equal({ found.shown, found.model }, { "http://127.0.0.1:2/v1/chat/completions", "b" })
  t:equal(find({ LIMAX_LLM_URL = "http://10.0.0.1:8000" }, { allow_insecure = true }).shown,
    "http://10.0.0.1:8000/v1/chat/completions")
end)

suite:test("an experiment cannot name a key", function(t)
  for _, name in ipairs { "key", "api_key", "apikey", "api-key", "authorization", "token",
    "headers" } do
    t:raises("an experiment cannot name a key, because it is recorded with the run",
      function() choice.read("supervisor", { "llm", [name] = KEY }, { llm = llm }) end)
  end
end)

suite:test("OPENAI_API_KEY goes only to OpenAI over https, headers follow host or option",
  function(t)
    local bearer, azure, none = { "Bearer " .. KEY }, { nil, KEY }, {}
    -- URL, variable of the key, header (nil: no endpoint), options
    for _, row in ipairs {
      { "https://example.org", "LIMAX_LLM_KEY", bearer }, { AZURE, "LIMAX_LLM_KEY", azure },
      { "https://openai.azure.com.example.org", "LIMAX_LLM_KEY", bearer },
      { "https://example.org", "LIMAX_LLM_KEY", azure, { key_header = "api-key" } },
      { AZURE, "LIMAX_LLM_KEY", bearer, { key_header = "authorization" } },
      { HERE, "NO_KEY", none }, { HERE, "OPENAI_API_KEY", none },
      { "https://api.openai.com/v1", "OPENAI_API_KEY", bearer },
      { "https://API.OpenAI.com/v1", "OPENAI_API_KEY", bearer },
      { "https://api.openai.com.example.org", "OPENAI_API_KEY" },
      { "https://example.org/api.openai.com", "OPENAI_API_KEY" },
      { "http://api.openai.com", "OPENAI_API_KEY", none, { allow_insecure = true } },
    } do
      local url, variable, expected, changes = unpack(row, 1, 4)
      local found = find({ LIMAX_LLM_URL = url, [variable] = KEY }, changes)
      local headers = found and found.headers()
      t:equal({ url, headers and { headers.Authorization, headers["api-key"] } },
        { url, expected })
      t:equal(found and found.key_source, expected and next(expected) and variable or nil)
      -- no table of an endpoint holds the key
      for _, value in pairs(found or {}) do
        t:ok(type(value) ~= "table" and not tostring(value):find("SENTINEL", 1, true))
      end
    end
    t:equal(find({ LIMAX_LLM_URL = HERE }).headers(),
      { Accept = "application/json", ["Content-Type"] = "application/json" })
    t:equal(find({ LIMAX_LLM_URL = "https://api.openai.com", OPENAI_API_KEY = "a",
      LIMAX_LLM_KEY = "b" }).headers().Authorization, "Bearer b")
  end)

suite:test("invalid URLs and keys are refused without being printed", function(t)
  local org = "https://example.org/v1"
  -- URL, key, text of the message
  for _, row in ipairs {
    { "https://me:" .. KEY:gsub("[/+=]", "") .. "@example.org/v1", KEY, "contains credentials" },
    { org .. "?api_key=" .. KEY, KEY, "looks like a key" },
    { org .. "#" .. KEY, KEY, "a part after #" },
    { "http://example.org/v1", KEY, "use https, or set allow_insecure = true" },
    { "ftp://127.0.0.1/", KEY, "must start with https://" },
    { nil, KEY, "set LIMAX_LLM_URL" },
    { org, nil, "no key for https://example.org: set LIMAX_LLM_KEY" },
    { HERE, KEY .. "\nX-Header: y", "the key in LIMAX_LLM_KEY contains a line break" },
    { HERE, KEY .. " x", "contains a space" }, { HERE, KEY .. '"', "that no key has" },
    { HERE .. "/" .. KEY, KEY, "contains the key" },
  } do
    local url, key, expected = unpack(row, 1, 3)
    local found, message = find { LIMAX_LLM_URL = url, LIMAX_LLM_KEY = key }
    t:equal(found, nil)
    t:ok(message:find(expected, 1, true) and not message:find("SENTINEL", 1, true), message)
  end
  local found, message = endpoint.find({ url = "http://127.0.0.1" }, function() return "" end)
  t:equal(found, nil)
  t:ok(message:find("no model is named: set LIMAX_LLM_MODEL", 1, true), message)
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
  os.execute("chmod 604 " .. path)
  refused("accessible to other users; run: chmod 600 " .. path)
  os.execute("chmod 600 " .. path)
  local found = asked()
  t:equal({ found.headers().Authorization, found.key_source },
    { "Bearer " .. KEY, "the file of LIMAX_LLM_KEY_FILE" })
  process.write(path, KEY .. "\nsecond")
  refused "contains a line break"
  process.write(path, "\n")
  refused "is empty"
  host.file.remove(path)
  -- a pipe without a writer does not block
  os.execute("mkfifo -m 600 " .. path)
  refused "is not a regular file"
end)

suite:test("the key is replaced in a text, a placeholder is not", function(t)
  local function redactor(key) return find({ LIMAX_LLM_URL = HERE, LIMAX_LLM_KEY = key }).redact end
  t:equal(redactor(KEY)("a " .. KEY .. KEY .. " b " .. KEY), "a [key][key] b [key]")
  t:equal(host.json.decode(redactor(KEY)(('{"a":"x%s"}'):format(KEY))), { a = "x[key]" })
  t:equal(redactor("a.*%w[x]-^$z")("a.*%w[x]-^$z aaaaw[x]-^$z"), "[key] aaaaw[x]-^$z")
  t:equal(redactor("none")("none"), "none")
  t:equal(redactor()(KEY), KEY)
end)
