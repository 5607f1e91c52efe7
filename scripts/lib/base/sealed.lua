--- sealed.lua: JSON objects whose last field, `hash`, is the XXH3 hash of the text without it: a
--- change of any byte is found.

local host = require "limax.host"

local sealed = {}

--- Adds the hash to an encoded object.
---@param text string ends in a line break
function sealed.add(text)
  local body, close = text:match "^(.*[^%s])(%s*}\n)$"
  local field = close == "}\n" and ',"hash":"%s"' or ',\n  "hash": "%s"'
  return body .. field:format(host.xxh3(text)) .. close
end

--- The object of a sealed text.
---@return table|nil
---@return string|nil reason
function sealed.open(text)
  local body, close = text:match '^(.*),%s*"hash": ?"%x+"(%s*}\n)$'
  if not body or sealed.add(body .. close) ~= text then return nil, "does not match its hash" end
  return host.json.decode(body .. close)
end

return sealed
