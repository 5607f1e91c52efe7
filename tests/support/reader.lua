--- reader.lua: other programs that read what limax writes: Python modules and command-line tools of
--- Debian. If one is not installed, the test is skipped with the name of its package.

local process = require "support.process"

local reader = {}

-- Debian's own Python first: another one may lack the packages
local PYTHONS = { "/usr/bin/python3", "python3" }

local function run(line, folder)
  local output = folder .. "/.reader"
  local status = os.execute(("{ %s; } >%s 2>&1 </dev/null"):format(line, process.quote(output)))
  return status == 0, process.read(output)
end

--- Runs a Python script that needs these modules and returns its output. An exception fails the
--- test.
---@param t limax.test_context
---@param folder string working folder
---@param packages table<string, string> Debian package of each module
---@param script string
---@return string
function reader.python(t, folder, packages, script)
  local missing
  for _, python in ipairs(PYTHONS) do
    missing = nil
    for _, module in ipairs(packages) do
      local line = ("%s -c 'import %s'"):format(python, module)
      if not missing and not run(line, folder) then missing = packages[module] end
    end
    if not missing then
      process.write(folder .. "/.script.py", script)
      local fine, text = run(("cd %s && %s -B .script.py"):format(process.quote(folder), python),
        folder)
      t:ok(fine, text)
      return text
    end
  end
  t:skip(("there is no %s (Debian: apt-get install %s)"):format(missing, missing))
end

--- Runs a command-line tool and returns its output.
---@param t limax.test_context
---@param folder string
---@param tool string
---@param words string shell text after its name
---@param package? string of Debian, if not the tool's name
---@return string
function reader.tool(t, folder, tool, words, package)
  if not run("command -v " .. tool, folder) then
    t:skip(("there is no %s (Debian: apt-get install %s)"):format(tool, package or tool))
  end
  local fine, text = run(("cd %s && %s %s"):format(process.quote(folder), tool, words), folder)
  t:ok(fine, text)
  return text
end

return reader
