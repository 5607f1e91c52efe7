--- seal.lua: documents that state who wrote them: limax runs a script of a run folder only if its
--- own user sealed the folder's configuration.
---
--- A sealed document is JSON, indented by 2, whose last field is this line:
---
---   "seal": { "key": "1f3a9c04", "hmac": "..." }
---
--- `hmac` is the HMAC-SHA256 of the document without that field, that is, without the line and
--- without the comma and line break before it. The HMAC's key is the text of the user's key: 64
--- hexadecimal digits of 32 random bytes. `key` names it: the first 8 digits of its SHA-256.
---
--- The key is in the file $LIMAX_KEY_FILE, else in limax/key below $XDG_CONFIG_HOME (~/.config).
--- It is made when the first document is sealed. Only its user may access the file.

local host = require "limax.host"
local output = require "limax.base.output"
local source = require "limax.base.source"
local user_folder = require "limax.base.user_folder"

local seal = {}

-- the key of this process once it is read
local cached
local is_warned = false

local function key_path()
  local path = os.getenv "LIMAX_KEY_FILE"
  if path and path ~= "" then
    if path:sub(1, 1) == "/" then return path end
    return nil, "$LIMAX_KEY_FILE is not an absolute path"
  end
  local folder, message = user_folder "XDG_CONFIG_HOME"
  return folder and folder .. "/key", message
end

-- No message contains the text of the file.
local function read(path)
  local text, message = host.file.read_private(path)
  if not text then return nil, message end
  local key = text:match "^(%x+)\n?$"
  if not key or #key ~= 64 then return nil, path .. " is not a key of limax" end
  return key
end

local function random_digits()
  local file = assert(io.open("/dev/urandom", "rb"))
  local bytes = file:read(32)
  file:close()
  return (bytes:gsub(".", function(byte) return ("%02x"):format(byte:byte()) end))
end

local function make(path)
  local made, message = host.file.mkdir(source.folder_of(path))
  if made then made, message = host.file.create_private(path, random_digits() .. "\n") end
  if made == nil then return nil, message end
  return read(path) -- another process may have made it
end

-- The user's key; nil without one. Warns once if it cannot be used.
local function key_of_user(may_make)
  if cached then return cached end
  local path, message = key_path()
  local is_missing = path and host.file.exists(path, true) == nil
  if is_missing and not may_make then return nil end
  if path then cached, message = (is_missing and make or read)(path) end
  if not cached and not is_warned then
    is_warned = true
    output.warn("limax: your key cannot be used, so files are neither sealed nor recognised as ",
      "yours: ", message, "\n")
  end
  return cached
end

local function name_of(key) return host.sha256(key):sub(1, 8) end

--- The name of this user's key; nil without one.
function seal.key_name()
  local key = key_of_user(false)
  return key and name_of(key)
end

local function sealed(text, key)
  return ('%s,\n  "seal": { "key": "%s", "hmac": "%s" }\n}\n'):format(text:sub(1, -4),
    name_of(key), host.hmac_sha256(key, text))
end

--- The document of an object, sealed unless the user's key cannot be used.
---@param object table with at least one field
function seal.add(object)
  local text, key = host.json.encode(object, { indent = 2 }) .. "\n", key_of_user(true)
  return key and sealed(text, key) or text
end

--- A document sealed by this user, with its other bytes as they are; nil and a message if the
--- key cannot be used, or limax did not write the document so.
function seal.again(text)
  local key = key_of_user(true)
  if not key then return nil, "there is no key" end
  local made = sealed(seal.without(text), key)
  local object, owner = seal.open(made)
  if not object or owner ~= "own" then return nil, "it has another form than limax writes" end
  return made
end

--- A document without its seal.
function seal.without(text)
  return (text:gsub(',\n  "seal": { "key": "%x+", "hmac": "%x+" }\n}\n$', "\n}\n"))
end

--- The object of a document, without `seal`, and whose it is: of this user ("own"), of another key
--- or of a user without one ("other"), changed after this user sealed it ("edited"), or unsealed
--- ("none"). nil and a message if it is not JSON.
---@param origin? string names it in the message
---@return any
---@return "own"|"other"|"edited"|"none"|string|nil
---@return string|nil key name of the key that sealed it
function seal.open(text, origin)
  local object, message = host.json.decode(text, origin)
  local found = type(object) == "table" and object.seal
  if not found then return object, object == nil and message or "none" end
  object.seal = nil
  local name = type(found) == "table" and found.key
  if type(name) ~= "string" or not name:find("^" .. ("%x"):rep(8) .. "$") then
    return object, "edited"
  end
  local key = key_of_user(false)
  if not key or name ~= name_of(key) then return object, "other", name end
  local is_own = found.hmac == host.hmac_sha256(key, seal.without(text))
  return object, is_own and "own" or "edited", name
end

return seal
