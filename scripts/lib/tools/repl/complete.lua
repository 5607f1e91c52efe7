--- complete.lua: completion with Tab: names, fields, methods after `:`, and file names inside
--- strings.

local api = require "limax.tools.reference.api"
local host = require "limax.host"
local kind = require "limax.tools.repl.kind"
local names = require "limax.tools.repl.names"
local terminal = require "limax.base.terminal"

local complete = {}

-- Adds the names among the keys of a table and of the tables that its metatable indexes.
local function add_keys(list, value, methods_only)
  for _ = 1, 8 do
    if type(value) ~= "table" then return end
    for key, entry in pairs(value) do
      local is_name = type(key) == "string" and key:match "^[%a_][%w_]*$"
      if is_name and (not methods_only or type(entry) == "function") then list[#list + 1] = key end
    end
    local class = getmetatable(value)
    if type(class) ~= "table" then return end
    for _, name in ipairs(not methods_only and rawget(class, "__fields") or {}) do
      list[#list + 1] = name
    end
    value = rawget(class, "methods") or rawget(class, "__index")
  end
end

-- The value of a path such as "a.b[1].c"; calls nothing but `__index`.
local function value_of(path)
  local value
  for name in path:gsub("%[", "."):gsub("%]", ""):gmatch "[^.:]+" do
    local within = value
    local fine, found = pcall(function()
      if within == nil then return names.get(name) end
      return type(within) == "table" and within[tonumber(name) or name] or nil
    end)
    if not fine or found == nil then return nil end
    value = found
  end
  return value
end

local function members(path, separator)
  local value, list = value_of(path), {}
  if type(value) == "string" and separator == ":" then value = string end
  -- of limax's own classes only public names
  local group = api.group_of(kind.of(value))
  for _, entry in ipairs(group and group.list or {}) do
    if entry.kind == "function" or separator == "." then list[#list + 1] = entry.short end
  end
  if #list == 0 then add_keys(list, value, separator == ":") end
  return list
end

local function files_at(typed)
  local folder, beginning = typed:match "^(.*/)([^/]*)$"
  beginning = beginning or typed
  local list = {}
  for _, name in ipairs(host.file.list(folder or ".") or {}) do
    local hidden = name:sub(1, 1) == "." and beginning:sub(1, 1) ~= "."
    if not hidden then
      local path = (folder or "") .. name
      list[#list + 1] = host.file.exists(path) == "folder" and path .. "/" or path
    end
  end
  return list
end

-- The beginning of a string that the last line does not end; nil outside a string.
local function open_string(text)
  local line = text:match "[^\n]*$"
  local quote, typed = line:match "([\"'])([^\"']*)$"
  local _, count = line:gsub(quote or "%z", "")
  return count % 2 == 1 and typed or nil
end

-- The candidates for the last word, and that word.
local function candidates(text)
  local file = open_string(text)
  if file then return files_at(file), file end
  local path = text:match "[%a_][%w_%.:%[%]]*$" or ""
  local base, separator, word = path:match "^(.*)([.:])([%w_]*)$"
  if path:match "%.%.[%w_]*$" then return {}, "" end
  if base then return members(base, separator), word end
  return names.all(), path:match "[%w_]*$"
end

local function common(list)
  local beginning = list[1]
  for _, word in ipairs(list) do
    while word:sub(1, #beginning) ~= beginning do beginning = beginning:sub(1, -2) end
  end
  return beginning
end

-- The words as lines that fit into the terminal; of files without their folder.
local function lines_of(list)
  local shown = {}
  for i, word in ipairs(list) do shown[i] = word:gsub("^.*/(.)", "%1") end
  return table.concat(terminal.wrap(table.concat(shown, " "), terminal.style().width, ""), "\n")
end

--- All completions, sorted, and the typed word.
---@param text string of the statement so far, up to the cursor
function complete.words(text)
  local topic = text:match "^%s*%?%s*([%a_][%w_]*)$"
  local all, typed = candidates((text:gsub("^%s*%?%s*", "")))
  -- help also finds public names by their last part
  for _, entry in ipairs(topic and api.entries() or {}) do all[#all + 1] = entry.short end
  local list, seen = {}, {}
  for _, word in ipairs(all) do
    -- names that begin with _ are private
    local private = word:sub(1, 1) == "_" and typed == ""
    if word:sub(1, #typed) == typed and not seen[word] and not private then
      seen[word] = true
      list[#list + 1] = word
    end
  end
  table.sort(list)
  return list, typed
end

--- The effect of Tab: text to insert, or candidates to show.
---@return string|nil insert
---@return string|nil show
function complete.edit(text)
  -- at the beginning of a line Tab indents
  if text:match "\n[ \t]*$" or text:match "^[ \t]*$" then return "  ", nil end
  local list, typed = complete.words(text)
  if #list == 0 then return nil, nil end
  local insert = common(list):sub(#typed + 1)
  if insert ~= "" then return insert, nil end
  return nil, #list > 1 and lines_of(list) or nil
end

return complete
