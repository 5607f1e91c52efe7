--- complete.lua: completion with Tab: names, fields, methods after `:`, the options of a public
--- function inside its table, and file names inside strings.

local api = require "limax.tools.reference.api"
local host = require "limax.host"
local kind = require "limax.tools.repl.kind"
local names = require "limax.tools.repl.names"
local terminal = require "limax.base.terminal"
local tokens = require "limax.tools.repl.tokens"

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
    name = tonumber(name) or name
    if value == nil then
      value = names.get(name)
    elseif type(value) == "table" then
      local within = value
      local fine, found = pcall(function() return within[name] end)
      value = fine and found or nil
    else
      return nil
    end
    if value == nil then return nil end
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

-- ---- inside a call ------------------------------------------------------------------------------

local closing = { [")"] = true, ["}"] = true, ["]"] = true }
local opening = { ["("] = true, ["{"] = true, ["["] = true }

-- The dotted name that ends at token i.
local function path_ending(list, i)
  local parts = {}
  while list[i] and list[i].kind == "name" do
    table.insert(parts, 1, list[i].text)
    local joint = list[i - 1]
    if not (joint and (joint.text == "." or joint.text == ":")) then break end
    table.insert(parts, 1, joint.text)
    i = i - 2
  end
  return table.concat(parts)
end

-- The open brackets, the innermost last, each with the number of commas after it and the names that
-- are assigned in it.
local function open_brackets(list)
  local open = {}
  for i, token in ipairs(list) do
    local inner = open[#open]
    if opening[token.text] and token.kind == "symbol" then
      open[#open + 1] = { at = i, text = token.text, commas = 0, taken = {} }
    elseif closing[token.text] and token.kind == "symbol" then
      open[#open] = nil
    elseif inner then
      if token.text == "," then inner.commas = inner.commas + 1 end
      local assigned = token.kind == "name" and list[i + 1] and list[i + 1].text == "="
      if assigned then inner.taken[token.text] = true end
    end
  end
  return open
end

-- The place after the last token: the path of the function that is called, the number of the
-- argument, the keys of the tables in it, whether it is in a table, and the names that are assigned
-- there.
local function place_of(list)
  local last, open = list[#list], open_brackets(list)
  local level, keys = #open, {}
  local inner = open[level] or { taken = {} }
  local place = { argument = 1, keys = keys, taken = inner.taken, in_table = inner.text == "{" }
  if last and last.kind == "name" then
    place.path = path_ending(list, #list)
    return place
  end
  if last and last.text == "=" then keys[1] = list[#list - 1] and list[#list - 1].text end
  local called -- the token of the bracket or table that begins the arguments
  while open[level] and open[level].text == "{" do
    called = open[level].at
    local before = list[called - 1] and list[called - 1].text
    level = level - 1
    if before ~= "=" then break end
    table.insert(keys, 1, list[called - 2] and list[called - 2].text or "")
    called = nil
  end
  local before = called and list[called - 1] and list[called - 1].text
  local outer = open[level]
  if outer and outer.text == "(" and (not called or before == "(" or before == ",") then
    called, place.argument = outer.at, outer.commas + 1
  end
  place.path = called and path_ending(list, called - 1) or ""
  return place
end

-- The public function of a typed path: a method of the object, or a function of that name.
local function function_of(path)
  local base, short = path:match "^(.-)[.:]([^.:]+)$"
  local class = base and kind.of(value_of(base))
  for _, entry in ipairs(api.entries()) do
    if entry.doc and (class and entry.group.class == class and entry.short == short
      or not class and entry.name:gsub(":", ".") == path:gsub(":", ".")) then
      return entry
    end
  end
end

-- The parameter or the field of a table at a place, with its type and fields, and the function.
local function value_at(place)
  local entry = place.path ~= "" and function_of(place.path)
  local name = entry and entry.doc.arguments[place.argument]
  if not name then return nil end
  local param = entry.doc.param[name]
  local value = { type = param and param.type, fields = api.options(entry, name) }
  for _, key in ipairs(place.keys) do
    value = value.fields and api.named(value.fields, key)
    if not value then return nil end
  end
  return value, entry
end

-- ---- inside a string ----------------------------------------------------------------------------

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

-- The words of a type such as `"cpu"|"cuda"`; of a robot's trace the recorded ones.
local function words_at(place)
  local value, entry = value_at(place)
  local words = {}
  if entry and entry.name == "robot:trace" then
    local robot = value_of(place.path:match "^(.*)[.:]")
    local rates = kind.of(robot) == "limax.scored_robot" and robot.context.options.record or {}
    for name, rate in pairs(rates) do words[#words + 1] = rate > 0 and name or nil end
  elseif value and value.type and not value.type:find("{", 1, true) then
    for word in value.type:gmatch '"([^"]*)"' do words[#words + 1] = word end
  end
  return words
end

-- ---- the edit -----------------------------------------------------------------------------------

-- The candidates for the last word, and that word.
local function candidates(text)
  local list = tokens.of(text)
  local last = list[#list]
  if last and last.kind == "comment" and last.last == #text then return {}, "" end
  if last and last.open then
    local typed = last.text:match "^[\"'](.*)$"
    if last.kind ~= "string" or not typed then return {}, "" end
    list[#list] = nil
    local words = words_at(place_of(list))
    return #words > 0 and words or files_at(typed), typed
  end
  local path = text:match "[%a_][%w_%.:%[%]]*$" or ""
  local base, separator, word = path:match "^(.*)([.:])([%w_]*)$"
  if path:match "%.%.[%w_]*$" then return {}, "" end
  if base then return members(base, separator), word end
  if path:find("[", 1, true) then path = path:match "[%w_]*$" end
  if path ~= "" then list[#list] = nil end
  local before = list[#list]
  if before and (before.text == "{" or before.text == ",") then
    local place, words = place_of(list), {}
    local value = place.in_table and value_at(place)
    for _, option in ipairs(value and value.fields or {}) do
      local matches = option.name:sub(1, #path) == path
      if matches and not place.taken[option.name] then words[#words + 1] = option.name .. " = " end
    end
    if #words > 0 then return words, path end
  end
  return names.all(), path
end

local function common(list)
  local beginning = list[1]
  for _, word in ipairs(list) do
    while word:sub(1, #beginning) ~= beginning do beginning = beginning:sub(1, -2) end
  end
  return beginning
end

-- The words in columns.
local function columns(list)
  local shown, widest = {}, 0
  for i, word in ipairs(list) do
    shown[i] = word:gsub(" = $", ""):gsub("^.*/(.)", "%1")
    widest = math.max(widest, terminal.width(shown[i]))
  end
  local across = math.max(1, math.floor((terminal.style().width + 1) / (widest + 2)))
  local down = math.ceil(#shown / across)
  local lines = {}
  for row = 1, down do
    local parts = {}
    for i = row, #shown, down do parts[#parts + 1] = terminal.pad(shown[i], widest) end
    lines[row] = table.concat(parts, "  "):gsub("%s+$", "")
  end
  return table.concat(lines, "\n")
end

--- All completions, sorted, and the typed word.
---@param text string of the statement so far, up to the cursor
---@return string[] words
---@return string typed
function complete.words(text)
  local topic = text:match "^%s*%?%s*([%a_][%w_]*)$"
  local all, typed = candidates((text:gsub("^%s*%?%s*", "")))
  -- help also finds public names by their last part
  if topic then
    for _, entry in ipairs(api.entries()) do all[#all + 1] = entry.short end
  end
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
---@param text string of the statement so far, up to the cursor
---@return string|nil insert
---@return string|nil show
function complete.edit(text)
  -- at the beginning of a line Tab indents
  if text:match "\n[ \t]*$" or text:match "^[ \t]*$" then return "  ", nil end
  local list, typed = complete.words(text)
  if #list == 0 then return nil, nil end
  local insert = common(list):sub(#typed + 1)
  if insert ~= "" then return insert, nil end
  return nil, #list > 1 and columns(list) or nil
end

return complete
