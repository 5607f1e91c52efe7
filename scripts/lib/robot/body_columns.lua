--- body_columns.lua: the bodies of one generation, in memory as the engine has them. A record's
--- body is made of them when a script reads it.

local bit = require "bit"
local ffi = require "ffi"

local bodies = require "limax.engine.bodies"
local body = require "limax.robot.body"
local choice = require "limax.base.choice"

---@class limax.body_columns
---@field count integer robots
---@field names string[] of the materials, sorted
---@field shapes ffi.cdata* limax_body[count], `counts` in the order of `names`
---@field letters ffi.cdata* char[count][width]
---@field mass ffi.cdata* double[count], kg; 0 of a robot whose body is not known
local Bodies = {}
Bodies.__index = Bodies

local body_columns = {}

local SIZE = ffi.sizeof "limax_body"
-- place of the hash in such a struct, in 32-bit words
local HASH = ffi.offsetof("limax_body", "hash") / ffi.sizeof "uint32_t"

---@param count integer robots
---@return limax.body_columns
function body_columns.new(count) return setmetatable({ count = count }, Bodies) end

local function equal(a, b)
  for k = 1, math.max(#a, #b) do
    if a[k] ~= b[k] then return false end
  end
  return true
end

-- Makes room for bodies of these materials and so many letters. Those of other materials are
-- forgotten.
local function expect(self, names, width)
  if self.names and self.width == width and equal(self.names, names) then return end
  self.names, self.width, self.known = names, width, {}
  self.shapes = ffi.new("limax_body[?]", self.count)
  self.letters = ffi.new("char[?]", self.count * width)
  self.mass = ffi.new("double[?]", self.count)
end

-- Sets body i: its counts and letters are copied, the rest is that of `shape`.
local function set(self, i, shape, letters, mass)
  ffi.copy(self.shapes + i - 1, shape, SIZE)
  ffi.copy(self.letters + (i - 1) * self.width, letters, self.width)
  self.mass[i - 1], self.known[i] = mass, true
end

--- Describes the robots whose bodies are not known yet.
---@param population limax.population expressed
---@param materials limax.materials
function Bodies:describe(population, materials)
  local facts, place = body.facts(materials), {}
  local texts, size = bodies.texts(population, facts.letters)
  local names = { unpack(facts.names) }
  table.sort(names)
  for k, name in ipairs(names) do place[name] = k - 1 end
  -- less a line end and a zero byte
  expect(self, names, size - 2)
  local shapes = bodies.shapes(population)
  for i = 1, self.count do
    if not self.known[i] then
      local from = shapes + i - 1
      set(self, i, from, texts + (i - 1) * size, body.mass(population, i, from.masses, facts))
      local counts = self.shapes[i - 1].counts
      for m, name in ipairs(facts.names) do counts[place[name]] = from.counts[m - 1] end
    end
  end
end

--- Copies bodies of another generation: body `sources[k]` of `from` becomes body `places[k]`.
---@param from limax.body_columns
---@param places integer[]
---@param sources integer[]
function Bodies:copy(from, places, sources)
  if not from.known then return end
  expect(self, from.names, from.width)
  local shapes, letters, mass, width = from.shapes, from.letters, from.mass, from.width
  for k = 1, #places do
    local j = sources[k] - 1
    if from.known[j + 1] then
      set(self, places[k], shapes + j, letters + j * width, mass[j])
    end
  end
end

--- Copies a body of a file.
---@param record limax.body.record
function Bodies:write(i, record)
  expect(self, choice.sorted_keys(record.counts), #record.letters)
  local shape = ffi.new "limax_body"
  shape.voxels, shape.masses, shape.springs = record.voxels, record.masses, record.springs
  local high, low = record.hash:match "^(%x%x%x%x%x%x%x%x)(%x%x%x%x%x%x%x%x)$"
  shape.hash = tonumber(high or "0", 16) * 0x100000000ULL + tonumber(low or "0", 16)
  for k = 0, 2 do shape.size[k] = record.size[k + 1] end
  for k, name in ipairs(self.names) do shape.counts[k - 1] = record.counts[name] end
  set(self, i, shape, record.letters, record.mass)
end

--- A body as a record keeps it; nil where it is not known.
---@return limax.body.record|nil
function Bodies:table(i)
  if not self.known or not self.known[i] then return nil end
  local shape, counts = self.shapes[i - 1], {}
  for k, name in ipairs(self.names) do counts[name] = shape.counts[k - 1] end
  return { letters = ffi.string(self.letters + (i - 1) * self.width, self.width),
    hash = bit.tohex(shape.hash, 16), voxels = shape.voxels, masses = shape.masses,
    springs = shape.springs, size = { shape.size[0], shape.size[1], shape.size[2] },
    counts = counts, mass = self.mass[i - 1] }
end

-- The hashes as texts of 16 digits.
local function hash_texts(self)
  local memory, digits = ffi.new("char[?]", 16 * self.count), ("0123456789abcdef")
  local letters = ffi.cast("const char *", digits)
  for i = 0, self.count - 1 do
    local halves = ffi.cast("const uint32_t *", self.shapes + i) + HASH
    for k = 0, 15 do
      local half = k < 8 and halves[1] or halves[0]
      memory[16 * i + k] = letters[bit.band(bit.rshift(half, 28 - 4 * (k % 8)), 15)]
    end
  end
  return memory
end

--- The fields of all bodies for a file, sorted by name.
---@param escaped fun(name: string): string
---@return limax.npy.field[]
function Bodies:fields(escaped)
  local list = {}
  local function add(name, field, count)
    list[#list + 1] = { name = "body." .. name, kind = "<i4", count = count, memory = self.shapes,
      offset = ffi.offsetof("limax_body", field), stride = SIZE }
  end
  for k, name in ipairs(self.names) do
    add("counts." .. escaped(name), "counts")
    list[k].offset = list[k].offset + (k - 1) * ffi.sizeof "int32_t"
  end
  list[#list + 1] = { name = "body.hash", kind = "|S", memory = hash_texts(self), width = 16 }
  list[#list + 1] = { name = "body.letters", kind = "|S", memory = self.letters,
    width = self.width }
  list[#list + 1] = { name = "body.mass", kind = "<f8", memory = self.mass }
  add("masses", "masses")
  add("size", "size", 3)
  add("springs", "springs")
  add("voxels", "voxels")
  return list
end

return body_columns
