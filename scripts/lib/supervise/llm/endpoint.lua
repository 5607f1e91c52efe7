--- endpoint.lua: the URL, model and key of a language model, from an experiment's options and the
--- environment. Only closures hold the key, so that no table that is printed or recorded can.

local host = require "limax.host"

local endpoint = {}

local OPENAI = "api.openai.com"
-- Azure's hosts: NAME.openai.azure.com
local AZURE = "%.openai%.azure%.com$"
-- A shorter one is a placeholder for a server that wants a key and checks none: it is not hidden.
local SHORTEST_KEY = 8

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

-- Describes the problem of a key, without repeating the key.
local function bad_key(key)
  if key == "" then return "is empty" end
  if key:find "[\r\n]" then return "contains a line break" end
  -- without quotes and backslashes JSON contains it as it is, where it can be found
  if not key:find "^[!-~]+$" or key:find '["\\]' then
    return "contains a space or a character that no key has"
  end
end

-- The function that replaces the key in a text by a mark, which is legal inside a JSON string.
local function redactor(key)
  if not key or #key < SHORTEST_KEY then return function(text) return text end end
  local pattern = key:gsub("%W", "%%%0")
  return function(text) return (text:gsub(pattern, "[key]")) end
end

local function set(getenv, name)
  local value = getenv(name)
  return value ~= "" and value or nil
end

-- The key and its source; nil and nil if there is none, nil and a message if it cannot be
-- used.
local function find_key(getenv, url)
  local key, source = set(getenv, "LIMAX_LLM_KEY"), "LIMAX_LLM_KEY"
  local file = not key and set(getenv, "LIMAX_LLM_KEY_FILE")
  if file then
    local content, message = host.file.read_private(file)
    if not content then return nil, "LIMAX_LLM_KEY_FILE: " .. message end
    key, source = content:gsub("\r?\n$", ""), "the file of LIMAX_LLM_KEY_FILE"
  elseif not key and url.host:lower() == OPENAI and url.scheme == "https" then
    key, source = set(getenv, "OPENAI_API_KEY"), "OPENAI_API_KEY"
  end
  local problem = key and bad_key(key)
  if problem then return nil, ("the key in %s %s"):format(source, problem) end
  return key, key and source
end

-- Why this URL cannot be an endpoint; nil if it can. Its text is not repeated: it may contain a
-- key.
local function bad_url(url, allow_insecure)
  if url.credentials then
    return "it contains credentials, and a URL is recorded; set LIMAX_LLM_KEY instead"
  elseif url.fragment then
    return "it has a part after #, which no server receives"
  elseif url.scheme ~= "http" and url.scheme ~= "https" then
    return ("it must start with https://, or http:// for this machine, not %s://")
      :format(url.scheme)
  elseif url.scheme == "http" and not url.loopback and not allow_insecure then
    return ("http to %s would send the key and the data unencrypted; use https, or set"
      .. " allow_insecure = true"):format(url.host)
  end
  for name in ((url.query or "") .. "&"):gmatch "([^&=]*)[^&]*&" do
    for _, part in ipairs(SECRETS) do
      if name:lower():find(part, 1, true) then
        return ("its query has a %q, which looks like a key, and a URL is recorded; set"
          .. " LIMAX_LLM_KEY instead"):format(name:gsub("%W", "?"):sub(1, 20))
      end
    end
  end
end

---@class limax.llm.endpoint
---@field shown string its URL without the query, for messages and records
---@field provider "openai"|"azure"|"other"
---@field headers fun(): table<string, string> of a request
---@field redact fun(text: string): string with the key replaced

--- The endpoint that options and environment name; nil and a message.
---@param options { url?: string, model?: string, allow_insecure?: boolean, key_header?: string }
function endpoint.find(options, getenv)
  getenv = getenv or os.getenv
  local address, from = options.url or set(getenv, "LIMAX_LLM_URL"), "LIMAX_LLM_URL"
  if options.url then from = "url" end
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

  local key, source = find_key(getenv, url)
  if not key and source then return nil, source end
  if not key and not url.loopback and url.scheme == "https" then
    return nil, ("no key for https://%s: set LIMAX_LLM_KEY, or LIMAX_LLM_KEY_FILE to a file that"
      .. " only you can read"):format(url.host)
  end
  local redact = redactor(key)
  if redact(address) ~= address or redact(model) ~= model then
    return nil, "the URL or the model's name contains the key, and both are recorded"
  end

  local name = url.host:lower()
  local provider = name == OPENAI and "openai" or name:find(AZURE) and "azure" or "other"
  local header = options.key_header or provider == "azure" and "api-key" or "authorization"
  local shown = ("%s://%s%s%s"):format(url.scheme, url.host, url.port and ":" .. url.port or "",
    chat_path(url.path or ""))
  return {
    url = shown .. (url.query and "?" .. url.query or ""), shown = shown, model = model,
    provider = provider, loopback = url.loopback, key_source = source, redact = redact,
    headers = function()
      return { ["Content-Type"] = "application/json", Accept = "application/json",
        ["api-key"] = header == "api-key" and key or nil,
        Authorization = key and header == "authorization" and "Bearer " .. key or nil }
    end,
  }
end

return endpoint
