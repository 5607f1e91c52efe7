--- activity.lua: what a long command is doing, on standard error: one line that is redrawn in place
--- on a terminal, elsewhere a line every 10 s.

local host = require "limax.host"
local terminal = require "limax.base.terminal"

local activity = {}

-- s
local BETWEEN_LINES = 10

---@class limax.activity.options
---@field on_terminal? boolean is standard error one?
---@field columns? integer
---@field clock? fun(): number s
---@field write? fun(text: string)

--- Returns a function that shows a text; called without one it removes the line of the terminal.
---@param options? limax.activity.options those of this process where left out
---@return fun(text: string|nil)
function activity.new(options)
  options = options or {}
  local facts = host.terminal()
  local on_terminal = options.on_terminal
  if on_terminal == nil then on_terminal = facts.stderr end
  local columns = options.columns or facts.columns or 80
  local clock, write = options.clock or host.clock, options.write
    or function(text) io.stderr:write(text) end
  local shown, last = nil, clock()
  return function(text)
    text = text and terminal.word(text)
    if on_terminal then
      if text ~= shown then
        write("\r\27[K" .. terminal.beginning(text or "", math.max(10, columns - 1)))
      end
      shown = text
    elseif text and clock() - last >= BETWEEN_LINES then
      write(text .. "\n")
      last = clock()
    end
  end
end

return activity
