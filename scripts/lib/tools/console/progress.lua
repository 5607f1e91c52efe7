--- progress.lua: the progress of a run on standard error: a bar that is redrawn in place on a
--- terminal, elsewhere one line per generation and every 10 s within one, only warnings when quiet.

local duration = require "limax.base.duration"
local host = require "limax.host"
local terminal = require "limax.base.terminal"

local progress = {}

---@class limax.progress
local Progress = {}
Progress.__index = Progress

-- Least time between two drawings of the bar, s.
local between = 0.1
-- s between two lines within a generation without a terminal
local BETWEEN_LINES = 10
-- s after which the bar shows how far a generation is
local LONG = 2
-- colours of the 256
local GREEN, YELLOW = 34, 136

---@class limax.progress.options
---@field total integer generations of all repetitions
---@field done? integer of them, by an earlier process
---@field repetitions integer
---@field quiet? boolean
---@field write? fun(text: string) standard error if left out

--- Progress over `total` generations.
function progress.new(options)
  local facts = host.terminal()
  return setmetatable({ total = options.total, done = options.done or 0, fresh = 0,
    repetitions = options.repetitions, quiet = options.quiet,
    bar = facts.stderr and not options.quiet, style = { color = facts.color_stderr },
    columns = math.max(40, facts.columns or 80),
    write = options.write or function(text) io.stderr:write(text) end,
    began = host.clock(), generation_began = host.clock(), drawn = -1, written = host.clock() },
    Progress)
end

--- Removes the bar from its line.
function Progress:finish()
  if self.shown then self.write "\r\27[K" end
  self.shown = false
end

--- A line that stays, quiet or not: a warning, or what failed.
function Progress:say(text)
  self:finish()
  self.write(terminal.paint("! ", YELLOW, self.style) .. terminal.shown(text) .. "\n")
end

-- "best 0.512  mean 0.31  diversity 0.42  failed 2", "  coarse 1" where steps were too long, and
-- "  coverage 0.4  QD score 29.9" of an archive with cells.
local function numbers(entry)
  local failed = entry.failed
  local all = entry.diversity.all or { hamming = 0 }
  return ("best %.4g  mean %.4g  diversity %.3f  failed %d"):format(entry.best, entry.mean,
    all.hamming, failed.invalid + failed.diverged + failed.fitness)
    .. (entry.coarse > 0 and ("  coarse %d"):format(entry.coarse) or "")
    .. (entry.archive and entry.archive.coverage and ("  coverage %.3f  QD score %.4g"):format(
      entry.archive.coverage, entry.archive.qd_score) or "")
end

-- How far a generation is: "  3 of 30 simulations done, 410 of 5000 s on average".
local function within(state)
  return ("  %d of %d simulations done, %.4g of %.4g s on average"):format(state.done, state.robots,
    state.time, state.duration)
end

-- Time left, from the generations that this process did.
function Progress:time_left(share)
  local past = self.fresh + share
  if past < 0.2 and (past == 0 or host.clock() - self.began < LONG) then return "" end
  local left = (host.clock() - self.began) / past * (self.total - self.done - share)
  return "  " .. duration(left) .. " left"
end

local function rate_text(rate)
  return rate and ("  %.2g springs/s"):format(rate) or ""
end

-- "generation 3/40  8 s left"
function Progress:where(share)
  return ("generation %d/%d"):format(math.min(self.done + 1, self.total), self.total)
    .. self:time_left(share)
end

function Progress:draw(state)
  local share = state and state.steps_total > 0 and state.steps / state.steps_total or 0
  local width = math.max(8, math.min(24, self.columns - 100))
  local full = math.floor(width * (self.done + share) / self.total + 0.5)
  local bar = terminal.paint(("#"):rep(full), GREEN, self.style) .. ("-"):rep(width - full)
  local is_long = state and state.robots > 0 and host.clock() - self.generation_began >= LONG
  -- a narrow terminal cuts off the end
  local text = self:where(share) .. (is_long and within(state) or "")
    .. (self.last and "  " .. numbers(self.last) or "") .. rate_text(self.spring_rate)
  local room = self.columns - width - 4
  self.write(("\r\27[K[%s] %s"):format(bar, text:sub(1, math.max(room, 10))))
  self.shown = true
  self.drawn = host.clock()
end

--- Called while robots are simulated, with the progress of together.run.
---@param state { steps: number, steps_total: number, spring_rate: number, done: integer,
--- robots: integer, time: number, duration: number }
function Progress:robots(state)
  self.spring_rate = state.spring_rate
  local now = host.clock()
  if self.bar then
    if now - self.drawn >= between then self:draw(state) end
  elseif not self.quiet and state.robots > 0 and now - self.written >= BETWEEN_LINES then
    self.write(self:where(state.steps / state.steps_total) .. within(state) .. "\n")
    self.written = now
  end
end

--- Called after each generation with its history entry.
function Progress:generation(entry, seconds)
  self.done, self.fresh, self.last = self.done + 1, self.fresh + 1, entry
  self.generation_began, self.written = host.clock(), host.clock()
  if self.bar then
    self:draw()
  elseif not self.quiet then
    local repetition = self.repetitions > 1 and ("repetition %d  "):format(entry.repetition) or ""
    local spent = seconds.simulate + seconds.fitness + seconds.breed
    self.write(("%sgeneration %d  %s  %.2f s%s%s\n"):format(repetition, entry.generation,
      numbers(entry), spent, rate_text(self.spring_rate), self:time_left(0)))
  end
end

return progress
