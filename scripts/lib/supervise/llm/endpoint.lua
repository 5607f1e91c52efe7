--- endpoint.lua: the URL, model and key of a language model, from an experiment's options and the
--- environment. Only closures hold the key, so that no table that is printed or recorded can.

local host = require "limax.host"
local text = require "limax.supervise.llm.text"

local endpoint = {}

local OPENAI = "api.openai.com"
-- hosts of Azure's own: NAME.openai.azure.com
local AZURE = "%.openai%.azure%.com$"
local LONGEST_KEY = 8192 -- bytes

-- parts of a query parameter's name that mean a secret; Azure's functions use "code"
local SECRETS = { "key", "token", "secret", "pass", "auth", "sig", "cred", "code" }

-- The path of chat completions below a base URL's path, never doubled.
local function chat_path(path)
  path = path:gsub("/+$", "")
  if path:find "/chat/completions$" then return path end
  -- a path with a version, or with Azure's deployments, is complete
  local whole = (path .. "/"):find "/v%d[%w]*/" or path:find("/deployments/", 1, true)
  return path .. (whole and "" or "/v1") .. "/chat/completions"
end

-- Why the URL's query cannot be used; nil where it can.
local function secret_in(query)
  for name in (query or ""):gmatch "([^&=]+)" do
    local lower = name:lower()
    for _, part in ipairs(SECRETS) do
      if lower:find(part, 1, true) then
        return ("its query has a %q, which looks like a key, and a URL is recorded; set"
          .. " LIMAX_LLM_KEY instead"):format(name:gsub("%W", "?"):sub(1, 20))
      end
    end
  end
  return nil
end

-- A query without its values.
local function query_names(query)
  return query and (query .. "&"):gsub("=[^&]*&", "&") or nil
end

-- What is wrong with a key, without repeating it.
local function bad_key(key)
  if key:find "[\r\n]" then return "contains a line break" end
  if not key:find "^[!-~]+$" then return "contains a space or a character that no key has" end
  if #key > LONGEST_KEY then return ("is longer than %d bytes"):format(LONGEST_KEY) end
  return nil
end

local function set(getenv, name)
  local value = getenv(name)
  return value ~= "" and value or nil
end

-- The key and its source; nil and nil where there is none, nil and a message where it cannot be
-- used.
local function find_key(getenv, url)
  local key, source = set(getenv, "LIMAX_LLM_KEY"), "LIMAX_LLM_KEY"
  local file = not key and set(getenv, "LIMAX_LLM_KEY_FILE")
  if file then
    local content, message = host.file.read_private(file)
    if not content then return nil, "LIMAX_LLM_KEY_FILE: " .. message end
    key, source = content:gsub("\r?\n$", ""), "the file of LIMAX_LLM_KEY_FILE"
    if key == "" then return nil, ("LIMAX_LLM_KEY_FILE: %s is empty"):format(file) end
  elseif not key and url.host:lower() == OPENAI and url.scheme == "https" then
    key, source = set(getenv, "OPENAI_API_KEY"), "OPENAI_API_KEY"
  end
  if not key then return nil end
  local problem = bad_key(key)
  if problem then return nil, ("the key in %s %s"):format(source, problem) end
  return key, source
end

local function provider_of(url)
  local name = url.host:lower()
  if name == OPENAI then return "openai" end
  if name:find(AZURE) then return "azure.ai.openai" end
  return "openai_compatible"
end

-- Why this URL cannot be an endpoint; nil where it can. Its text is not repeated: it may contain a
-- key.
local function bad_url(url, allow_insecure)
  if url.credentials then
    return "it contains credentials, and a URL is recorded; set LIMAX_LLM_KEY instead"
  end
  if url.fragment then return "it has a part after #, which no server receives" end
  if url.scheme ~= "http" and url.scheme ~= "https" then
    return ("it must start with https://, or http:// for this machine, not %s://")
      :format(url.scheme)
  end
  if url.scheme == "http" and not url.loopback and not allow_insecure then
    return ("http to %s would send the key and the data unencrypted; use https, or set"
      .. " allow_insecure = true"):format(url.host)
  end
  return secret_in(query_names(url.query))
end

---@class limax.llm.endpoint
---@field url string
---@field shown string the same without its query, for messages and records
---@field model string
---@field provider string a value of OpenTelemetry's gen_ai.provider.name, or "openai_compatible"
---@field loopback boolean
---@field key_source string|nil
---@field headers fun(): table<string, string> of a request
---@field redact fun(text: string): string without the key in any form of text.lua

--- The endpoint that options and environment name; nil and a message.
---@param options { url?: string, model?: string, allow_insecure?: boolean, key_header?: string }
---@param getenv? fun(name: string): string|nil
function endpoint.find(options, getenv)
  getenv = getenv or os.getenv
  local address, from = options.url, "url"
  if not address then address, from = set(getenv, "LIMAX_LLM_URL"), "LIMAX_LLM_URL" end
  if not address then
    return nil, "no endpoint of a language model is configured: set LIMAX_LLM_URL, for example to"
      .. " http://127.0.0.1:8080, or the field url"
  end
  local url, message = host.url(address)
  message = url and bad_url(url, options.allow_insecure) or message
  if message then return nil, ("%s: %s"):format(from, message) end

  local model = options.model or set(getenv, "LIMAX_LLM_MODEL")
  if not model then
    return nil, "no model is named: set LIMAX_LLM_MODEL, or the field model (llama.cpp's server"
      .. " takes any name)"
  end
  if model:find "%c" then
    return nil, "LIMAX_LLM_MODEL: the name contains a control character"
  end

  local key, source = find_key(getenv, url)
  if not key and source then return nil, source end
  if not key and not url.loopback and url.scheme == "https" then
    return nil, ("no key for https://%s: set LIMAX_LLM_KEY, or LIMAX_LLM_KEY_FILE to a file that"
      .. " only you can read"):format(url.host)
  end
  local secret = key and #key >= text.SHORTEST_KEY
  if secret and (address:find(key, 1, true) or model:find(key, 1, true)) then
    return nil, "the URL or the model's name contains the key, and both are recorded"
  end

  local base = ("%s://%s%s"):format(url.scheme, url.host, url.port and ":" .. url.port or "")
  local shown = base .. chat_path(url.path or "")
  local azure = options.key_header == "api-key"
    or not options.key_header and url.host:lower():find(AZURE) ~= nil
  return {
    url = shown .. (url.query and "?" .. url.query or ""), shown = shown, model = model,
    provider = provider_of(url), loopback = url.loopback, key_source = key and source or nil,
    redact = text.redactor(key),
    headers = function()
      local headers = { ["Content-Type"] = "application/json", Accept = "application/json" }
      if key and azure then headers["api-key"] = key
      elseif key then headers.Authorization = "Bearer " .. key end
      return headers
    end,
  }
end

return endpoint
