--- process.lua: starts the limax executable from a suite, as a user's shell would, and says what it
--- printed and how it ended.

local host = require "limax.host"

local process = {}

--- A word as a POSIX shell takes it literally.
---@param word string
---@return string
function process.quoted(word) return "'" .. word:gsub("'", "'\\''") .. "'" end

local function read(path)
  local file = assert(io.open(path, "rb"))
  local text = file:read "*a"
  file:close()
  return text
end

---@class limax.process.options
---@field folder string where its output is kept; also the working folder
---@field signal? string "INT", "KILL", ...: sent to it `after` seconds
---@field after? number s
---@field before? string shell text in front of the command: "ulimit -f 8;", "LC_ALL=de_DE.UTF-8"

--- Runs `limax` with these arguments to its end.
---@param arguments string[]
---@param options limax.process.options
---@return { status: integer, stdout: string, stderr: string }
function process.limax(arguments, options)
  local words = {}
  if options.signal then
    -- --foreground: a signal for limax alone, as a terminal's kill sends it
    words[1] = ("timeout --foreground --preserve-status -s %s %.3f"):format(options.signal,
      options.after)
  end
  words[#words + 1] = process.quoted(host.executable)
  for _, argument in ipairs(arguments) do words[#words + 1] = process.quoted(argument) end
  local out, err = options.folder .. "/.stdout", options.folder .. "/.stderr"
  local line = ("cd %s && { %s %s; } >%s 2>%s </dev/null; echo $?"):format(
    process.quoted(options.folder), options.before or "", table.concat(words, " "),
    process.quoted(out), process.quoted(err))
  local pipe = assert(io.popen(line, "r"))
  local status = tonumber(pipe:read "*a")
  pipe:close()
  return { status = status, stdout = read(out), stderr = read(err) }
end

return process
