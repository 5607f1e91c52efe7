--- own_variables.lua: finds results that functions of an experiment keep in variables of the
--- script, which a run that continues has lost. It reads the bytecode of each function, of the
--- closures in it and of the functions that it calls: a variable from outside of a function keeps
--- results if it is assigned, or if the table in it is written to.

local choice = require "limax.base.choice"
local failure = require "limax.base.failure"
local source = require "limax.base.source"
local util = require "jit.util"

local own_variables = {}

-- ---- instructions -------------------------------------------------------------------------------

-- The number of an instruction differs between versions of LuaJIT, so it is read from a function
-- that has it: the statement, and the place of the instruction in it.
local NAMES = {}
for name, example in pairs {
  MOV = { "a = b", 1 }, UGET = { "return u", 1 }, GGET = { "return type", 1 },
  FNEW = { "return function() end", 1 },
  USETV = { "u = a", 1 }, USETS = { "u = ''", 1 }, USETN = { "u = 1", 1 }, USETP = { "u = nil", 1 },
  TGETV = { "return a[b]", 1 }, TGETS = { "return a.x", 1 }, TGETB = { "return a[1]", 1 },
  TSETV = { "a[b] = c", 1 }, TSETS = { "a.x = b", 1 }, TSETB = { "a[1] = b", 1 },
  CALL = { "a()", 2 }, CALLM = { "a(b())", 4 }, CALLT = { "return a()", 2 },
  CALLMT = { "return a(b())", 4 },
} do
  local make = loadstring("local u; return function(a, b, c) " .. example[1] .. " end")
  NAMES[bit.band(util.funcbc(make(), example[2]), 0xff)] = name
end

-- Registers between a called function and its first argument: 1, or 2 where pointers have 64 bits.
local first_argument = bit.band(bit.rshift(
  util.funcbc(loadstring "return function(a, b) a(b) end" (), 2), 8), 0xff) - 2

-- The name of instruction `pc`, its operands, and whether it overwrites register `a`; nil at the
-- end.
local function instruction(code, pc)
  local word, mode = util.funcbc(code, pc)
  if not word then return nil end
  local function byte(shift) return bit.band(bit.rshift(word, shift), 0xff) end
  return NAMES[byte(0)] or "other", byte(8), byte(24), byte(16), bit.rshift(word, 16),
    bit.band(mode, 7) == 1
end

-- ---- one function -------------------------------------------------------------------------------

-- What a register holds: `value`, if it is known before the run, and where a write to it goes:
-- `variable` of the script, with its name and its first value in a state, or `parameter`, a number.

-- What functions of Lua write to: their first argument.
local WRITERS = { [table.insert] = true, [table.remove] = true, [table.sort] = true,
  [rawset] = true }

-- An entry of a table, without calling metamethods that are functions.
local function entry_of(value, key)
  while type(value) == "table" and key ~= nil do
    local entry = rawget(value, key)
    if entry ~= nil then return entry end
    value = (debug.getmetatable(value) or {}).__index
  end
end

local read

-- Notes a write through what a register holds.
local function write(found, held)
  if held and held.variable then found.variables[held.variable.name] = held.variable.first end
  if held and held.parameter then found.parameters[held.parameter] = true end
end

-- Follows a call: the function in register `a` may write to its arguments.
local function call(found, registers, a, count, known)
  local callee = registers[a] and registers[a].value
  if type(callee) ~= "function" then return end
  local inner = read(callee, known)
  for name, first in pairs(inner.variables) do found.variables[name] = first end
  for k in pairs(WRITERS[callee] and { true } or inner.parameters) do
    if k <= count then write(found, registers[a + first_argument + k - 1]) end
  end
end

-- Reads the instructions of a function or of the prototype of a closure. `outer(k)` is what its
-- variable number k from outside is: a register's content.
local function scan(code, outer, found, known)
  local registers, by_name = {}, {}
  for k = 1, util.funcinfo(code).params do registers[k - 1] = { parameter = k } end
  for k = 0, util.funcinfo(code).upvalues - 1 do by_name[util.funcuvname(code, k)] = outer(k) end
  for pc = 1, math.huge do
    local name, a, b, c, d, overwrites = instruction(code, pc)
    if not name then break end
    local held
    if name == "MOV" then
      held = registers[d]
    elseif name == "UGET" then
      held = outer(d)
    elseif name == "GGET" then
      held = { value = entry_of(_G, util.funck(code, -d - 1)) }
    elseif name:find "^TGET" and registers[b] then
      local key = name == "TGETB" and c or name == "TGETS" and util.funck(code, -c - 1) or nil
      held = { value = entry_of(registers[b].value, key), variable = registers[b].variable,
        parameter = registers[b].parameter }
    elseif name == "FNEW" then
      local inner = util.funck(code, -d - 1)
      -- a closure's variable may also be a local one of this function, which lasts for one call
      scan(inner, function(k) return by_name[util.funcuvname(inner, k)] end,
        { variables = found.variables, parameters = {} }, known)
    elseif name:find "^TSET" then
      write(found, registers[b])
    elseif name:find "^USET" then
      write(found, outer(a))
    elseif name:find "^CALL" then
      call(found, registers, a, name:find "M" and c or c - 1, known)
      for r in pairs(registers) do registers[r] = r < a and registers[r] or nil end
    end
    if overwrites then registers[a] = held end
  end
end

-- What a function writes to: { variables = first values by name, parameters = a set of numbers }.
-- `known` holds the results for other functions.
function read(own, known)
  if known[own] then return known[own] end
  local found = { variables = {}, parameters = {} }
  known[own] = found
  local info = debug.getinfo(own, "S")
  if info.what == "C" or failure.is_ours(info.source) then return found end
  scan(own, function(k)
    local name, value = debug.getupvalue(own, k + 1)
    local first = type(value) == "table" and "{}" or type(value) == "number" and value or "..."
    return { variable = { name = name, first = first }, value = value }
  end, found, known)
  return found
end

-- ---- an experiment ------------------------------------------------------------------------------

local function functions_of(value, path, list)
  if type(value) == "function" then
    list[#list + 1] = { path = path, call = value }
  elseif type(value) == "table" and getmetatable(value) == nil then
    for _, key in ipairs(choice.sorted_keys(value)) do
      local step = type(key) == "number" and ("[%d]"):format(key) or "." .. tostring(key)
      functions_of(value[key], path and path .. step or tostring(key), list)
    end
  end
  return list
end

--- A note on the variables in which functions of an experiment keep results; nil if none does.
---@param spec table the argument of limax.experiment
---@param base string|nil folder that file names are relative to
---@return string|nil
function own_variables.note(spec, base)
  local parts, example, known, advice = {}, nil, {}, ""
  for _, each in ipairs(functions_of(spec, nil, {})) do
    local variables = read(each.call, known).variables
    local names = choice.sorted_keys(variables)
    if names[1] then
      if each.path == "trials" then
        advice = "; trials may depend only on the generation and on random"
      end
      example = example or ("%s = %s"):format(names[1], variables[names[1]])
      parts[#parts + 1] = ("%s (%s)%s in `%s`"):format(each.path,
        source.place { ["function"] = source.of_function(each.call, base) },
        parts[1] and "" or " keeps results", table.concat(names, "`, `"))
    end
  end
  return example and ("%s: variables of a script are lost when a run continues; use state ="
    .. " function() return { %s } end%s"):format(table.concat(parts, ", "), example, advice)
end

return own_variables
