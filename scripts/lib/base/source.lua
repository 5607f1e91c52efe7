--- source.lua: where Lua functions are defined. A run folder records each function of an experiment
--- as file, lines and SHA-256 of those lines, and copies the script files.

local failure = require "limax.base.failure"
local host = require "limax.host"

local source = {}

local NOT_FOUND = 2 -- the system's ENOENT

local function folder_of(path) return path:match "^(.*)/[^/]*$" or "." end
source.folder_of = folder_of

function source.name_of(path) return path:match "([^/]*)$" end

--- Opens a regular file for reading; reading a pipe might wait forever.
---@return file*|nil
---@return string|nil message
---@return boolean|nil missing is there no such file?
function source.open(path)
  local kind = host.file.exists(path)
  if kind and kind ~= "file" then return nil, path .. ": is not a regular file" end
  local file, message, code = io.open(path, "rb")
  return file, message, code == NOT_FOUND
end

--- The whole text of a regular file.
---@return string|nil text
---@return string|nil message
---@return boolean|nil missing is there no such file?
function source.read(path)
  local file, message, missing = source.open(path)
  if not file then return nil, message, missing end
  local text = file:read "*a"
  file:close()
  if not text then return nil, path .. ": cannot be read" end
  return text
end

--- What is wrong with a file of a folder that may come from somebody else, where a link is refused.
---@return string|nil message
function source.foreign(path)
  return host.file.exists(path, true) == "other" and path .. " is a link, or no file" or nil
end

--- The whole text of a regular file of such a folder.
function source.read_own(path)
  local message = source.foreign(path)
  if message then return nil, message end
  return source.read(path)
end

--- Refuses links, pipes and devices in a folder that may come from somebody else.
---@param depth integer how many levels of folders below it are looked at too
function source.refuse_links(path, depth)
  for _, name in ipairs(host.file.list(path) or {}) do
    local inner = path .. "/" .. name
    local kind = host.file.exists(inner, true)
    if kind == "other" then
      failure.raise(2, ("%s is a link, or no regular file: such a folder holds its files itself;"
        .. " replace it by a copy"):format(inner))
    elseif kind == "folder" and depth > 0 then
      source.refuse_links(inner, depth - 1)
    end
  end
end

--- Is this the path of a file below a folder? No part of it may be empty, "." or "..".
function source.is_below(path)
  return not ("/" .. path .. "/"):find "/%.?%.?/" and not path:find "%c"
end

--- The bytes of a file; nil if there is none.
function source.size(path)
  local file = source.open(path)
  local size = file and file:seek "end"
  if file then file:close() end
  return size
end

--- The value of a JSON file.
---@return any nil if the file is missing or damaged
---@return string|nil message
function source.read_json(path)
  local text, message = source.read(path)
  if not text then return nil, message end
  return host.json.decode(text, path)
end

--- Writes a file, complete or not at all; a failure ends the command.
function source.write(path, bytes)
  local written, message = host.file.write_atomic(path, bytes)
  if not written then failure.raise(1, message) end
end

--- The file and line of the nearest calling function that is not part of limax. `return
--- limax.experiment { ... }` is a tail call, so its file may not be on the stack: then it is the
--- started script, without a line.
---@return string|nil file absolute
---@return integer|nil line
function source.caller()
  for level = 2, math.huge do
    local info = debug.getinfo(level, "Sl")
    if not info then break end
    if info.source:sub(1, 1) == "@" then
      local path = host.file.absolute(info.source:sub(2))
      if not failure.is_ours(path) then return path, info.currentline end
    end
  end
  local started = rawget(_G, "arg")
  local path = type(started) == "table" and started[0]
  if path and host.file.exists(path) == "file" then return host.file.absolute(path) end
end

-- A path in a configuration: relative if it is below the experiment's folder, so that moving a
-- project changes nothing.
local function shown(path, base)
  if base and path:find(base .. "/", 1, true) == 1 then return path:sub(#base + 2) end
  if failure.is_ours(path) then return "limax" .. path:sub(#host.home + 1) end
  return path
end

--- Lines `first` to `last` of a text.
function source.lines_of(text, first, last)
  local picked, number = {}, 0
  for line in (text .. "\n"):gmatch "(.-)\n" do
    number = number + 1
    if number >= first and number <= last then picked[#picked + 1] = line end
  end
  return table.concat(picked, "\n")
end

--- The path of a file that an experiment names: as it is, else beside the experiment.
---@param folder string|nil of the experiment
---@return string path as it is where there is no such file
---@return string|nil message where it was looked for
function source.beside(path, folder)
  if host.file.exists(path) == "file" then return path end
  local places = path:sub(1, 1) ~= "/" and { host.file.absolute "." } or {}
  if folder and places[1] then
    local beside = folder .. "/" .. path
    if host.file.exists(beside) == "file" then return beside end
    if folder ~= places[1] then places[2] = folder end
  end
  return path, ("there is no file %s%s%s"):format(path, places[1] and " in " or "",
    table.concat(places, ", nor beside the experiment in "))
end

local DEEPEST, MOST_ENTRIES = 4, 1000 -- of the tables that are read
local held_by, add_held

-- Adds the entries of a table to the parts of `held_by`.
local function add_table(parts, name, value, seen, depth)
  local texts, entries = {}, {}
  for key, entry in next, value do
    if #texts == MOST_ENTRIES then return end
    if type(key) == "string" or type(key) == "number" then
      local text = ("%s[%s %s]"):format(name, type(key), tostring(key))
      texts[#texts + 1], entries[text] = text, entry
    end
  end
  table.sort(texts)
  for _, text in ipairs(texts) do add_held(parts, text, entries[text], seen, depth + 1) end
end

-- Adds a value that a function reads from outside, as text.
function add_held(parts, name, value, seen, depth)
  local kind = type(value)
  if kind == "function" and not seen[value] then
    local info = debug.getinfo(value, "S")
    seen[value] = true
    if info.what ~= "C" and not failure.is_ours(info.source) then
      parts[#parts + 1] = ("%s=%s%s"):format(name, source.text_of(info), held_by(value, seen))
    end
  elseif kind == "table" and not seen[value] and depth < DEEPEST and not getmetatable(value) then
    seen[value] = true
    add_table(parts, name, value, seen, depth)
  elseif kind == "number" or kind == "string" or kind == "boolean" then
    parts[#parts + 1] = ("%s=%s"):format(name, kind == "number" and ("%.17g"):format(value)
      or tostring(value))
  end
end

-- The numbers, texts and switches that a function reads from outside, and the functions and plain
-- tables there. Tables that are deeper or larger do not count.
function held_by(call, seen)
  local parts, k = {}, 1
  while true do
    local name, value = debug.getupvalue(call, k)
    if not name then break end
    add_held(parts, name, value, seen, 0)
    k = k + 1
  end
  return #parts > 0 and "\n" .. table.concat(parts, "\n") or ""
end

--- The lines of a function.
---@param info table of debug.getinfo(call, "S")
function source.text_of(info)
  local text = info.source
  if text:sub(1, 1) == "@" then text = source.read(host.file.absolute(text:sub(2))) or "" end
  return source.lines_of(text, info.linedefined, info.lastlinedefined)
end

--- File and lines of a function, and the SHA-256 of its text with the numbers, texts, switches,
--- functions and plain tables that it reads from outside.
---@param base string|nil folder that file names are relative to
---@return { file: string, first_line: integer, last_line: integer, sha256: string }
function source.of_function(call, base)
  local info = debug.getinfo(call, "S")
  local record = { file = "(no file)", first_line = info.linedefined,
    last_line = info.lastlinedefined }
  if info.source:sub(1, 1) == "@" then
    record.file = shown(host.file.absolute(info.source:sub(2)), base)
  end
  record.sha256 = host.sha256(source.text_of(info) .. held_by(call, { [call] = true }))
  return record
end

--- Where a function of a configuration begins; nil if it is not a function.
---@param chosen any a fitness, selection or supervisor of config.json
---@return string|nil place FILE:LINE
function source.place(chosen)
  local own = type(chosen) == "table" and chosen["function"]
  return own and ("%s:%d"):format(own.file, own.first_line) or nil
end

--- A copy of a value with every function replaced by its record, so that it can be written as JSON.
function source.describe(value, base)
  if type(value) == "function" then return { ["function"] = source.of_function(value, base) } end
  if type(value) ~= "table" then return value end
  local copy, named = {}, false
  for key, entry in pairs(value) do
    copy[key] = source.describe(entry, base)
    named = named or type(key) == "string"
  end
  -- a JSON object cannot be a list too: { "tournament", size = 3 } becomes { name = "tournament",
  -- size = 3 }
  if named and type(copy[1]) == "string" then
    copy.name = table.remove(copy, 1)
  elseif named and type(value[1]) == "function" then
    copy["function"] = table.remove(copy, 1)["function"]
  end
  return copy
end

local function add_functions(value, add)
  if type(value) == "function" then
    local from = debug.getinfo(value, "S").source
    if from:sub(1, 1) == "@" then add(host.file.absolute(from:sub(2))) end
  elseif type(value) == "table" then
    for _, entry in pairs(value) do add_functions(entry, add) end
  end
end

--- The script files of an experiment: its own, those of its functions, and the modules loaded from
--- its folder. Sorted, absolute, without files of limax itself.
---@param origin string|nil the experiment's file
---@param fields table the argument of limax.experiment
---@param named? string[] absolute paths of more files, if they exist
function source.scripts(origin, fields, named)
  local seen, list = {}, {}
  local function add(path)
    if seen[path] or failure.is_ours(path) or host.file.exists(path) ~= "file" then return end
    seen[path] = true
    list[#list + 1] = path
  end
  if origin then
    add(origin)
    local pattern = folder_of(origin) .. "/?.lua"
    for name in pairs(package.loaded) do
      local path = type(name) == "string" and package.searchpath(name, pattern)
      if path then add(host.file.absolute(path)) end
    end
  end
  add_functions(fields, add)
  for _, path in ipairs(named or {}) do add(path) end
  table.sort(list)
  return list
end

--- The path of the first table found that is also one of those around it, as `copy` sees them;
--- nil if there is none.
function source.cycle(value, path, around)
  if type(value) ~= "table" or getmetatable(value) ~= nil then return nil end
  around = around or {}
  if around[value] then return path end
  around[value] = true
  for key, entry in pairs(value) do
    local found = source.cycle(entry, path .. "." .. tostring(key), around)
    if found then return found end
  end
  around[value] = nil
end

--- A deep copy of plain tables; anything else is shared.
function source.copy(value)
  if type(value) ~= "table" or getmetatable(value) ~= nil then return value end
  local copy = {}
  for key, entry in pairs(value) do copy[key] = source.copy(entry) end
  return copy
end

return source
