--- forged.lua: changes a file of a run folder as somebody would who knows how limax works: sizes
--- and hashes in its journal fit again, so that only what a file contains gives it away.

local config = require "limax.run.config"
local files = require "limax.run.files"
local host = require "limax.host"
local sealed = require "limax.base.sealed"
local source = require "limax.base.source"

local forged = {}

local function write(path, text) assert(host.file.write_atomic(path, text)) end

-- The end of a generation's line in a growing file, and its hash.
local function line_part(text, generation)
  local at, k = 0, -1
  for line in text:gmatch "[^\n]*\n" do
    at, k = at + #line, k + 1
    if k == generation then return { at, host.xxh3(line) } end
  end
end

--- Replaces the text of a file, and its size and hash in the journal.
---@param folder string
---@param file string below it
---@param change fun(text: string): string
function forged.text(folder, file, change)
  local text, lines, at = change(source.read(folder .. "/" .. file)), {}, 0
  write(folder .. "/" .. file, text)
  for each in source.read(folder .. "/journal.jsonl"):gmatch "[^\n]+" do
    local line = sealed.open(each)
    if line.config == file then line.config_hash = config.hash(text) end
    for kind in pairs(line.files or {}) do
      if files.place(kind, line.repetition, line.generation) == file then
        local row = line.files[kind][3]
        line.files[kind] = { #text, host.xxh3(text, row), row }
      end
    end
    for name in pairs(line.lines or {}) do
      if files.growing(name, line.repetition) == file then
        line.lines[name] = line_part(text, line.generation)
      end
    end
    line.at = line.at and at
    lines[#lines + 1] = sealed.add(host.json.encode(line)) .. "\n"
    at = at + #lines[#lines]
  end
  write(folder .. "/journal.jsonl", table.concat(lines))
end

--- Changes the object of a JSON file, or of the first line of a growing one.
---@param change fun(object: table)
function forged.object(folder, file, change)
  forged.text(folder, file, function(text)
    local first, rest = text, ""
    if file:match "%.jsonl$" then first, rest = text:match "^([^\n]*)(.*)$" end
    local object = host.json.decode(first)
    change(object)
    return host.json.encode(object) .. rest
  end)
end

return forged
