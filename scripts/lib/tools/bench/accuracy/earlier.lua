--- earlier.lua: what other calls of `limax bench` left in JSON, as sections of this one: hours of
--- measuring can be spread over several calls and machines, and judged together.

local failure = require "limax.base.failure"
local host = require "limax.host"
local robustness = require "limax.tools.bench.accuracy.robustness"
local source = require "limax.base.source"

local earlier = {}

-- Rows of a document by section.
local READERS = {
  accuracy = function(document, add)
    for _, row in ipairs(document.rows) do
      if row.section then add(row.section, row) end
    end
  end,
  ["blow-ups"] = function(document, add)
    local cases = document.cases
    if type(cases) == "table" then
      add("robustness", { what = "blow-ups", first = cases.first, count = cases.count,
        failed = cases.step,
        reported = cases.diverged - cases.step })
    end
  end,
  stability = function(document, add)
    local cases = document.cases
    if type(cases) == "table" then
      add("robustness", { what = "hard cases", devices = robustness.devices(document.rows),
        count = cases.cases - cases.skipped, failed = cases.failed + cases.differ })
    end
  end,
}

local function bad(path, text)
  failure.raise(2, ("--with %s: %s"):format(path, text))
end

--- Reads files. Raises where one is none of `limax bench`.
---@param paths string[]
---@return table<string, { rows: table[] }> by section
function earlier.read(paths)
  local results = {}
  local function add(section, row)
    results[section] = results[section] or { rows = {} }
    table.insert(results[section].rows, row)
  end
  for _, path in ipairs(paths) do
    if host.file.exists(path) ~= "file" then bad(path, "no such file") end
    local document, message = host.json.decode(source.read(path), path)
    if type(document) ~= "table" then bad(path, message or "no JSON object") end
    local reader = document.schema == "limax.bench/1" and type(document.rows) == "table"
      and READERS[document.bench]
    if not reader then
      bad(path, "not what limax bench accuracy, blow-ups or stability left with --json")
    end
    reader(document, add)
  end
  return results
end

--- Sections of other calls and of this one; what was measured now has the word.
---@param others table<string, { rows: table[] }>
---@param own table<string, { rows: table[] }>
---@return table<string, { rows: table[] }>
function earlier.joined(others, own)
  local results = {}
  for name, section in pairs(others) do results[name] = section end
  for name, section in pairs(own) do results[name] = section end
  -- a search or a matrix of another call counts beside this one's
  if others.robustness and own.robustness then
    local rows = {}
    for _, section in ipairs { others.robustness, own.robustness } do
      for _, row in ipairs(section.rows) do rows[#rows + 1] = row end
    end
    results.robustness = { rows = rows }
  end
  return results
end

return earlier
