--- hashes.lua: stored hashes of the last states on a GPU model, one file per model in hashes/: the
--- same scene on the same model must always give the same bits.

local failure = require "limax.base.failure"
local host = require "limax.host"
local source = require "limax.base.source"

local hashes = {}

local SCHEMA = "limax.bench_hashes/1"

local function path_of(model, folder)
  return ("%s/%s.json"):format(folder or host.home .. "/scripts/lib/tools/bench/hashes",
    (model:gsub("[^%w%-]", "_")))
end

--- Compares with the stored hashes of a GPU model; a difference raises.
---@param model string the GPU's name
---@param found table<string, string> hash of each scene
---@param folder string|nil of the hashes; limax's own if left out
---@return string text for the user
function hashes.check(model, found, folder)
  local path = path_of(model, folder)
  local text = source.read(path)
  if not text then return ("no stored hash for this GPU model (%s)"):format(model) end
  local stored, message = host.json.decode(text, path)
  if not stored then failure.raise(1, message) end
  if stored.schema ~= SCHEMA then failure.raise(1, path .. ": its schema is not " .. SCHEMA) end
  local compared = 0
  for name, hash in pairs(found) do
    local expected = stored.hashes[name]
    if expected and expected ~= hash then
      failure.raise(1, ("%s: the last state has other bits than limax %s gave on %s: nothing is "
        .. "timed. If the physics changed on purpose, --store stores the new ones"):format(name,
        stored.version, model))
    end
    compared = compared + (expected and 1 or 0)
  end
  return ("%d of %d last states have hashes stored for %s, and have those bits"):format(compared,
    hashes.count(found), model)
end

---@param found table<string, string>
---@return integer
function hashes.count(found)
  local count = 0
  for _ in pairs(found) do count = count + 1 end
  return count
end

--- Stores hashes of a GPU model.
---@param model string
---@param found table<string, string>
---@param folder string|nil
---@return string path
function hashes.store(model, found, folder)
  local path = path_of(model, folder)
  local fine, message = host.file.mkdir(path:match "^(.*)/")
  if fine then
    fine, message = host.file.write_atomic(path, host.json.encode({ schema = SCHEMA, gpu = model,
      version = host.version, hashes = found }, { indent = 2 }) .. "\n")
  end
  if not fine then failure.raise(1, message) end
  return path
end

return hashes
