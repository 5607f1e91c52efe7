--- division.lua: a generation on several ranks of mpirun. Each breeds, expresses, simulates and
--- scores its own share of the robots, and has only their genomes, bodies and rows. After each
--- score all receive what ranking, survival and selection read (rows.lua); genomes and whole rows
--- travel only to the ranks that breed from them. Without mpirun the share is the whole generation.

local ffi = require "ffi"

local bodies = require "limax.engine.bodies"
local engine_population = require "limax.engine.population"
local exchange = require "limax.base.exchange"
local failure = require "limax.base.failure"
local genes = require "limax.experiment.genes"
local host = require "limax.host"
local metrics = require "limax.run.metrics"
local new_table = require "table.new"
local rows = require "limax.robot.rows"
local sorting = require "limax.base.sorting"
local state = require "limax.run.state"
local structured = require "limax.base.structured"

local division = {}

ffi.cdef [[
  void* malloc(size_t size);
  void free(void* memory);
]]

-- ---- shares -------------------------------------------------------------------------------------

---@class limax.share the robots that a rank has, in order: some of the elites, some of the others
---@field count integer
---@field elites integer how many of them are elites
---@field first_elite integer elites of ranks before
---@field before integer number in the generation of an own robot that is no elite, less that here
---@field total integer robots of the generation
---@field all_elites integer the first of these, of which some may need no simulation
---@field ends { elites: integer[], others: integer[] } of the parts of each rank, from 1
---@field islands { first: integer, last: integer }|nil that it has whole
local Share = {}
Share.__index = Share

-- Where the part of each rank ends, of so many robots in equal parts.
local function equal_parts(count)
  local ends = {}
  for r = 1, exchange.count do ends[r] = math.floor(count * r / exchange.count) end
  return ends
end

-- Where the parts end if each rank has whole islands of `size` robots, of which so many are elites.
local function whole_islands(elites, size)
  local ends, sum, each = { elites = {}, others = {} }, 0, #elites / exchange.count
  for k, count in ipairs(elites) do
    sum = sum + count
    if k % each == 0 then ends.elites[k / each], ends.others[k / each] = sum, k * size - sum end
  end
  return ends
end

--- The share of a rank, this one if left out.
---@param total integer robots of the generation
---@param elites integer|integer[] of the generation, or of each island: then ranks have whole
--- islands if each gets as many, and breed without the genomes of others
---@param rank? integer from 0
---@return limax.share
function division.share(total, elites, rank)
  local r, islands = (rank or exchange.index) + 1, nil
  if type(elites) == "table" then
    islands, elites = elites, 0
    for _, count in ipairs(islands) do elites = elites + count end
  end
  local are_whole = islands and #islands % exchange.count == 0
  local ends = are_whole and whole_islands(islands, total / #islands)
    or { elites = equal_parts(elites), others = equal_parts(total - elites) }
  local first, others = ends.elites[r - 1] or 0, ends.others[r - 1] or 0
  local own = ends.elites[r] - first
  local each = are_whole and #islands / exchange.count
  return setmetatable({ count = own + ends.others[r] - others, elites = own, first_elite = first,
    before = elites + others - own, total = total, all_elites = elites, ends = ends,
    islands = each and { first = (r - 1) * each + 1, last = r * each } or nil }, Share)
end

--- A share of all robots.
function division.whole(total)
  return setmetatable({ count = total, elites = 0, first_elite = 0, before = 0, total = total,
    all_elites = 0 }, Share)
end

--- The place of a robot in this share; nil of another rank's.
---@param i integer its number in the generation
function Share:at(i)
  local k = i - self.before
  if i <= self.all_elites then
    k = i - self.first_elite
    return k >= 1 and k <= self.elites and k or nil
  end
  return k > self.elites and k <= self.count and k or nil
end

--- The number in the generation of robot k of this share.
function Share:number(k) return k <= self.elites and k + self.first_elite or k + self.before end

--- The parts of an array of all robots that are of this share.
---@return { first: integer, count: integer, place: integer }[] the first robot's place there and
--- here, from 0
function Share:segments()
  local first, rest = self.first_elite, self.before + self.elites
  if first + self.elites == rest then
    return { { first = first, count = self.count, place = 0 } }
  end
  local list = {}
  for _, each in ipairs { { first = first, count = self.elites, place = 0 },
    { first = rest, count = self.count - self.elites, place = self.elites } } do
    if each.count > 0 then list[#list + 1] = each end
  end
  return list
end

-- How many robots each rank has in a list of ends.
local function counts_of(ends)
  local list = {}
  for r, last in ipairs(ends) do list[r] = last - (ends[r - 1] or 0) end
  return list
end

--- The rank, from 1, that has a robot.
function division.owner(share, i)
  local ends = share.ends.elites
  if i > share.all_elites then i, ends = i - share.all_elites, share.ends.others end
  local low, high = 1, #ends
  while low < high do
    local middle = math.floor((low + high) / 2)
    if i <= ends[middle] then high = middle else low = middle + 1 end
  end
  return low
end

--- Refuses more ranks than a generation can be divided among.
function division.check(population)
  if population >= 2 * exchange.count then return end
  failure.raise(2, ("population = %d: %d ranks of mpirun are too many, each needs two robots; start"
    .. " at most %d"):format(population, exchange.count, math.floor(population / 2)))
end

-- ---- genomes of other ranks ---------------------------------------------------------------------

-- Bytes of genomes that are read and sent at a time, at least those of one.
local CHUNK = 2 ^ 24

-- Does this rank run a function that all run at the same time, with the same arguments?
local in_common = false

--- Begins or ends functions that all ranks call with the same arguments: they may read any robot.
function division.set_common(value) in_common = value end

-- All genomes of this rank, float[count * genes]: those of the population, or a copy of a GPU's.
local function own_genomes(robots)
  local own = robots.own
  if robots.world.device.kind == "cpu" then return own:genome_view():pointer() end
  local memory = ffi.new("float[?]", own.count * own.genes)
  engine_population.copy_genomes(own, memory)
  return memory
end

-- Gathers items of some robots, of which each rank writes its own. Collective, where there are
-- several ranks.
---@param list integer[] the same on all
---@param memory ffi.cdata* uint8_t[#list * size]
---@param write fun(into: ffi.cdata*, k: integer) the item of robot k of the share
local function gather(share, list, memory, size, write)
  memory = ffi.cast("uint8_t *", memory)
  local count = 0
  for _, i in ipairs(list) do
    local k = share:at(i)
    if k then
      write(memory + count * size, k)
      count = count + 1
    end
  end
  if exchange.count == 1 then return end
  local all, taken = exchange.all(ffi.string(memory, count * size)), {}
  for k, i in ipairs(list) do
    local from = division.owner(share, i)
    local place = taken[from] or 0
    ffi.copy(memory + (k - 1) * size, all[from]:sub(place + 1, place + size), size)
    taken[from] = place + size
  end
end

--- The genomes of some robots. Collective, where there are several ranks.
---@param list integer[] the same on all
---@return ffi.cdata* float[#list * genes]
function division.genomes(robots, list)
  local own, count = robots.own, robots.own.genes
  local memory = ffi.new("float[?]", math.max(1, #list * count))
  gather(robots.share, list, memory, count * ffi.sizeof "float", function(into, k)
    engine_population.copy_genomes(own, ffi.cast("float *", into), k - 1, 1)
  end)
  return memory
end

--- The genome of a robot; nil of another rank's.
---@return ffi.cdata*|nil float[genes]
---@return integer rank that has it, from 1
function division.genome(robots, i)
  local k, copy = robots.share:at(i), nil
  if k then
    copy = ffi.new("float[?]", robots.own.genes)
    engine_population.copy_genomes(robots.own, copy, k - 1, 1)
  end
  return copy, k and exchange.index + 1 or division.owner(robots.share, i)
end

--- Keeps the whole rows of some robots on all ranks. Collective.
---@param list integer[] the same on all
function division.lend(robots, list)
  local all = robots.rows
  if not all.share then return end
  local size, array = all.layout.size, structured.new(all.layout, math.max(1, #list))
  gather(robots.share, list, array.data, size, function(into, k)
    ffi.copy(into, all.data + (k - 1), size)
  end)
  rows.lend(all, list, array)
end

--- Keeps rows, bodies and genomes of some robots on all ranks, beside the own ones. Collective.
---@param list integer[] the same on all ranks
---@param name? "fetched"|"best" replaces those that were kept by this name; "fetched" if left out
function division.fetch(robots, list, name)
  if not robots.world.is_divided or #list == 0 then return end
  division.lend(robots, list)
  local fetched = { engine = robots.world:empty(#list), at = {} }
  fetched.engine:set_genomes(division.genomes(robots, list))
  local rules = robots.world:rules(robots)
  rules.number = function(k) return list[k] end
  genes.express(rules, fetched.engine)
  for k, i in ipairs(list) do fetched.at[i] = k end
  robots[name or "fetched"] = fetched
end

-- The engine's population that has all these robots, and the places there; nil if none has.
local function found(list, from, place_of)
  local at = {}
  for _, i in ipairs(list) do
    at[i] = place_of(i)
    if not at[i] then return nil end
  end
  return from, at
end

--- Where the bodies and genomes of some robots are: a population of the engine, and the place of
--- each. A function that only one rank calls reads robots of others from the run folder.
---@param list integer[]
---@return limax.population|nil
---@return table<integer, integer>|nil at [number in the generation]
function division.reach(robots, list)
  local own, share = rawget(robots, "own"), robots.share
  -- all ranks must take part, or none
  if own and not (in_common and exchange.count > 1) then
    local from, at = found(list, own, function(i) return share:at(i) end)
    if from then return from, at end
  end
  for _, name in ipairs { "best", "fetched" } do
    local kept = rawget(robots, name)
    local from, at = nil, nil
    if kept then from, at = found(list, kept.engine, function(i) return kept.at[i] end) end
    if from then return from, at end
  end
  if own and in_common then
    division.fetch(robots, list)
    return robots.fetched.engine, robots.fetched.at
  end
  return found(list, robots.engine, function(i) return i end)
end

--- The same of one robot.
---@return limax.population|nil
---@return integer|nil place
function division.place(robots, i)
  local from, at = division.reach(robots, { i })
  return from, at and at[i]
end

--- Collects the genomes of all robots, in order, on rank 0. Collective.
---@param all ffi.cdata*|nil float[robots * genes] of rank 0
function division.collect_genomes(robots, all)
  local own, share, count = own_genomes(robots), robots.share, robots.own.genes
  exchange.all(true) -- an error of a rank ends all here, and not within what follows
  local function send(from, into, ends)
    local numbers, sent, received = counts_of(ends), {}, {}
    for r = 1, exchange.count do
      sent[r] = r == 1 and numbers[exchange.index + 1] or 0
      received[r] = exchange.is_first and numbers[r] or 0
    end
    exchange.trade(from, sent, into, received, count * ffi.sizeof "float", robots)
  end
  send(own, all, share.ends.elites)
  send(own + share.elites * count, all and all + share.all_elites * count, share.ends.others)
end

--- Gives each rank the genomes of its share, without elites, which rank 0 reads. Collective.
---@param each integer genes of a robot
---@param read (fun(count: integer): string)|nil those of the next robots, on rank 0
---@param put fun(memory: ffi.cdata*, first: integer, count: integer) takes so many after the first
--- ones of this share
function division.deal(share, each, read, put)
  local size = each * ffi.sizeof "float"
  local step = math.max(1, math.floor(CHUNK / size))
  local memory = ffi.new("float[?]", step * each)
  for r, number in ipairs(counts_of(share.ends.others)) do
    local is_own = r == exchange.index + 1
    for first = 0, number - 1, step do
      local count = math.min(step, number - first)
      local bytes = exchange.is_first and read(count) or nil
      exchange.all(true) -- an error of rank 0 ends all here
      local sent, received = {}, {}
      for other = 1, exchange.count do
        sent[other] = exchange.is_first and other == r and count or 0
        received[other] = is_own and other == 1 and count or 0
      end
      exchange.trade(bytes, sent, memory, received, size)
      if is_own then put(memory, first, count) end
    end
  end
end

-- ---- parents ------------------------------------------------------------------------------------

local REASON = "; its functions may depend only on their arguments, not on a clock, a file, or"
  .. " variables of the script"

-- Raises if ranks chose different parents, or have another state.
local function compare(generation, messages)
  for _, what in ipairs { "parents", "state" } do
    for r = 2, #messages do
      if messages[r][what] ~= messages[1][what] then
        failure.raise(1, ("generation %d: the %s of ranks 0 and %d differ: a function of the"
          .. " experiment gave them different results%s"):format(generation, what, r - 1, REASON))
      end
    end
  end
end

-- Tells ranks what this one asks of them, and receives what they ask of it. Collective, as a trade.
---@param list integer[] numbers, those of the first rank first
---@param counts integer[] of each rank
---@return integer[] numbers that ranks asked this one for, one rank after the other
---@return integer[] how many each did
local function ask(list, counts)
  local ones, numbers, sent, total = {}, {}, {}, 0
  local own = ffi.new("int32_t[?]", exchange.count, counts)
  local asked = ffi.new("int32_t[?]", exchange.count)
  for r = 1, exchange.count do ones[r] = 1 end
  exchange.trade(own, ones, asked, ones, 4)
  for r = 1, exchange.count do sent[r], total = asked[r - 1], total + asked[r - 1] end
  local into = ffi.new("int32_t[?]", total + 1)
  exchange.trade(ffi.new("int32_t[?]", #list + 1, list), counts, into, sent, 4)
  for k = 1, total do numbers[k] = into[k - 1] end
  return numbers, sent
end

-- Copies genomes into a population, from its robot `first` on, by breeding elites: those of a GPU
-- stay there.
---@param places integer[] in `from`
local function copy_genomes(robots, from, places, into, first)
  if #places == 0 then return end
  local twice = {}
  for k, place in ipairs(places) do twice[k] = { place, place } end
  into:breed(from, twice, { elites = into.count, mutation_rate = 0, mutation_scale = 0,
    crossover_rate = 0, seed = 0, repetition = 1, generation = 0 }, robots.world.device, first,
    #places)
end

-- Memory for a ranking and for genomes on their way, which is kept from generation to generation:
-- new pages cost more time than the copy into them. That for genomes is not kept on a CPU, where a
-- generation takes longer and needs the memory.
local ways = { sent = { bytes = -1 }, received = { bytes = -1 }, ranking = { bytes = -1 } }

local function release(way)
  if way.memory then ffi.C.free(ffi.gc(way.memory, nil)) end
  way.memory, way.bytes = nil, -1
end

local function memory_of(way, bytes, device)
  if way.bytes < bytes then
    release(way)
    way.bytes = math.ceil((device.kind == "cpu" and 1 or 1.2) * bytes)
    way.memory = ffi.gc(ffi.C.malloc(math.max(1, way.bytes)), ffi.C.free)
    if way.memory == nil then error("not enough memory", 0) end
  end
  return ffi.cast("float *", way.memory)
end

local function done_with(way, device)
  if device.kind == "cpu" then release(way) end
end

-- Copies genomes of robots of this rank into memory, one after the other.
---@param list integer[] numbers in the generation
local function gather_genomes(robots, list, to)
  if #list == 0 then return end
  local own, each, share = robots.own, robots.own.genes, robots.share
  if robots.world.device.kind == "cpu" then
    local from = own:genome_view():pointer()
    for k, i in ipairs(list) do
      ffi.copy(to + (k - 1) * each, from + (share:at(i) - 1) * each, each * ffi.sizeof "float")
    end
  else
    local gathered, places = robots.world:empty(#list), {}
    for k, i in ipairs(list) do places[k] = share:at(i) end
    copy_genomes(robots, own, places, gathered, 1)
    engine_population.copy_genomes(gathered, to)
    gathered:free()
  end
end

-- Receives genomes from other ranks, and sends those that they ask for. Collective, as a trade.
---@param list integer[] numbers that this rank asks for, those of the first rank first
---@param counts integer[] of each rank
---@param to ffi.cdata* float[#list][genes]
---@param write fun(numbers: integer[], to: ffi.cdata*) those that other ranks asked for
local function trade_genomes(robots, list, counts, to, write)
  local numbers, sent = ask(list, counts)
  local size, device = robots.own.genes * ffi.sizeof "float", robots.world.device
  local from = memory_of(ways.sent, #numbers * size, device)
  write(numbers, from)
  exchange.all(true) -- an error of a rank ends all here, and not within what follows
  exchange.trade(from, sent, to, counts, size)
  done_with(ways.sent, device)
end

-- The same of whole rows.
local function trade_rows(robots, list, counts)
  local all, share = robots.rows, robots.share
  local numbers, sent = ask(list, counts)
  local leaving = structured.new(all.layout, math.max(1, #numbers))
  local arriving = structured.new(all.layout, math.max(1, #list))
  for k, i in ipairs(numbers) do structured.copy(leaving, k - 1, all, share:at(i) - 1, 1) end
  exchange.all(true)
  exchange.trade(leaving.data, sent, arriving.data, counts, all.layout.size)
  rows.lend(all, list, arriving)
end

-- What ranks have of a list, those of the first rank first, and how many each has.
---@param last integer only up to this place of the list
---@param rank_of fun(item: any): integer|nil from 1; nil leaves an item out
local function by_rank(list, last, rank_of)
  local groups, sorted, counts = {}, {}, {}
  for r = 1, exchange.count do groups[r] = {} end
  for k = 1, last do
    local rank = rank_of(list[k])
    if rank then table.insert(groups[rank], list[k]) end
  end
  for r, group in ipairs(groups) do
    counts[r] = #group
    for _, item in ipairs(group) do sorted[#sorted + 1] = item end
  end
  return sorted, counts
end

---@class limax.division.archive the genomes of an archive
---@field rank fun(row: limax.archive.row): integer that has its genome, from 1
---@field place fun(row: limax.archive.row): integer in the archive
---@field genome fun(place: integer): ffi.cdata* float[genes] of one that this rank has

--- The genomes from which this rank breeds, of robots and of the archive. Collective.
---@param sources integer[] numbers of the generation
---@param whole integer the whole rows of so many of them, the first, are lent if they are of other
--- ranks: of elites, or of all where a function may look at them
---@param chosen string digest of all that survival and selection chose
---@param of_archive limax.archive.row[]
---@param archive limax.division.archive
---@return limax.population of the engine: the own one if it has them all, else a copy
---@return table<integer|limax.archive.row, integer> places there by number of the generation or row
function division.parents(robots, sources, whole, chosen, of_archive, archive)
  local share, own_state, at = robots.share, rawget(robots, "state"), {}
  local function other_rank(i) return not share:at(i) and division.owner(share, i) or nil end
  local foreign, counts = by_rank(sources, #sources, other_rank)
  local lent, lent_counts = by_rank(sources, whole, other_rank)
  local archived, archived_counts = by_rank(of_archive, #of_archive, archive.rank)
  local archived_places = {}
  for k, row in ipairs(archived) do archived_places[k] = archive.place(row) end
  local count, places = #foreign + #archived, {}
  local each, device = robots.own.genes, robots.world.device
  local arrived = memory_of(ways.received, count * each * ffi.sizeof "float", device)
  local messages = exchange.all { parents = chosen, state = own_state and state.encode(own_state),
    genomes = #foreign, rows = #lent, archived = #archived }
  compare(robots.generation + 1, messages)
  local total = { genomes = 0, rows = 0, archived = 0 }
  for _, message in ipairs(messages) do
    for what, sum in pairs(total) do total[what] = sum + message[what] end
  end
  if total.genomes > 0 then
    trade_genomes(robots, foreign, counts, arrived, function(list, to)
      gather_genomes(robots, list, to)
    end)
  end
  -- after division.complete each rank has the whole rows of all
  if total.rows > 0 and robots.rows.share then trade_rows(robots, lent, lent_counts) end
  if total.archived > 0 then
    local function write(list, to)
      for k, place in ipairs(list) do
        ffi.copy(to + (k - 1) * each, archive.genome(place), each * ffi.sizeof "float")
      end
    end
    trade_genomes(robots, archived_places, archived_counts, arrived + #foreign * each, write)
  end
  for k, i in ipairs(foreign) do at[i] = k end
  for k, row in ipairs(archived) do at[row] = #foreign + k end
  for _, i in ipairs(sources) do
    local place = share:at(i)
    if place then
      places[#places + 1] = place
      at[i] = count > 0 and count + #places or place
    end
  end
  if count == 0 then return robots.own, at end
  local all = robots.world:empty(count + #places)
  copy_genomes(robots, robots.own, places, all, count + 1)
  engine_population.put_genomes(all, arrived, 0, count)
  done_with(ways.received, device)
  return all, at
end

--- Frees the genomes and bodies of a generation that was bred, and what it has of robots of other
--- ranks: from here on they are read from the run folder.
function division.forget(robots)
  if not (robots.world.is_divided and rawget(robots, "own")) then return end
  robots.own:free()
  robots.own = nil
  rows.forget_others(robots.rows)
end

-- ---- ranking ------------------------------------------------------------------------------------

-- Robots per rank of the sample that divides the ranking: parts then differ by an eighth or so.
local SAMPLE = 64

-- The limits of a rank's part of the ranking, each as { score, i }: its first robot, and the first
-- one behind it; false for an empty part. All ranks take the same sample.
local function part_of(data, count, rank)
  local scores, numbers = {}, {}
  for i = 1, count, math.max(1, math.floor(count / (SAMPLE * exchange.count))) do
    local score = data[i - 1].fitness
    if score == score then scores[#scores + 1], numbers[#numbers + 1] = score, i end
  end
  local ends, order = equal_parts(#scores), sorting.descending(scores)
  local first, last = ends[rank - 1] or 0, ends[rank]
  if first == last and (rank > 1 or #scores > 0) then return false end
  local function limit(place)
    local k = order[place + 1]
    return { scores[k], numbers[k] }
  end
  return first > 0 and limit(first) or { math.huge, 0 },
    last < #scores and limit(last) or { -math.huge, math.huge }
end

--- Ranks scored robots as metrics.rank: each rank sorts a part of the ranking, and receives the
--- others. Collective.
---@return integer[]
function division.rank(robots)
  local all = robots.rows
  if not all.share then return metrics.rank(all) end
  local data, count = rows.scored(all).data, 0
  local from, to = part_of(data, all.count, exchange.index + 1)
  local numbers = {}
  if from then
    local most, first, least, last = from[1], from[2], to[1], to[2]
    for i = 1, all.count do
      local score = data[i - 1].fitness
      if (score < most or score == most and i >= first)
        and (score > least or score == least and i < last) then
        count = count + 1
        numbers[count] = i
      end
    end
  end
  local scores, own = ffi.new("double[?]", count + 1), ffi.new("int32_t[?]", count + 1, numbers)
  for k = 1, count do scores[k - 1] = data[numbers[k] - 1].fitness end
  sorting.sort(scores, own, count, true)
  local counts, before, total = exchange.all(count), 0, 0
  for r, each in ipairs(counts) do
    total = total + each
    if r <= exchange.index then before = before + each end
  end
  local ranking = ffi.cast("int32_t *", memory_of(ways.ranking, 4 * total, robots.world.device))
  local ranked = new_table(total, 0)
  ffi.copy(ranking + before, own, 4 * count)
  exchange.all(true)
  exchange.share(ranking, counts, 4)
  for k = 1, total do ranked[k] = ranking[k - 1] end
  return ranked
end

-- ---- diversity ----------------------------------------------------------------------------------

--- The robots whose bodies this rank counts; nil where it has all bodies.
---@param all limax.rows of all robots
---@return integer[]|nil
function division.counted(all)
  return exchange.count > 1 and rows.with_hashes(all, exchange.index, exchange.count) or nil
end

-- The engine's diversity of a set of robots, whose parts ranks add up: each counts the different
-- bodies in a part of all hashes. Collective.
---@param counted integer[]|nil division.counted
---@param has fun(i: integer): boolean is robot i in the set?
---@param count integer its size, at least one
local function diversity(robots, all, counted, has, count)
  local own, share, list, largest, distinct = robots.own, robots.share, {}, 0, 0
  for k = 1, share.count do
    if has(share:number(k)) then list[#list + 1] = k end
  end
  if exchange.count == 1 then return own:diversity(list) end
  local hashes, number = ffi.new("uint64_t[?]", #counted + 1), 0
  for _, i in ipairs(counted) do
    if has(i) then
      hashes[number] = rows.hash(all, i)
      number = number + 1
    end
  end
  for _, each in ipairs(exchange.all { largest = bodies.largest_gene(own, list),
    distinct = bodies.distinct(hashes, number) }) do
    distinct = distinct + each.distinct
    -- not a number stays
    if largest == largest and not (each.largest <= largest) then largest = each.largest end
  end
  local sums, size = bodies.sums(own, list, largest)
  exchange.sum(sums, size)
  return bodies.diversity_of(own, sums, largest, distinct, count)
end

--- The engine's diversity of the best robots of a scored generation. Collective.
---@param count integer at least one
---@param counted integer[]|nil division.counted
---@return limax.diversity
function division.diversity_of_best(robots, count, counted)
  local data, last = rows.scored(robots.rows).data, robots.ranked[count]
  local score = data[last - 1].fitness
  -- equal scores are ranked in index order
  return diversity(robots, robots.rows, counted, function(i)
    local own = data[i - 1].fitness
    return own > score or own == score and i <= last
  end, count)
end

--- That of a set of robots, for a script.
---@param set integer[] at least one robot
function division.diversity_of(robots, set)
  if not (rawget(robots, "own") and (in_common or exchange.count == 1)) then
    return robots.engine and robots.engine:diversity(set)
  end
  local has = {}
  for _, i in ipairs(set) do has[i] = true end
  -- an island has a part of the rows
  local all = (rawget(robots, "whole") or robots).rows
  return diversity(robots, all, division.counted(all), function(i) return has[i] end, #set)
end

-- ---- rows ---------------------------------------------------------------------------------------

-- Raises if functions that score robots wrote to the state, which other ranks do not receive.
local function check_state(robots, own_state)
  local before = robots.before.state
  if before and state.encode(own_state) ~= state.encode(before) then
    failure.raise(2, "the fitness, a descriptor or an objective writes to `state`: on several ranks"
      .. " of mpirun each scores a part of the robots only. Write to it in the survival or the"
      .. " selection, or run on one rank")
  end
end

-- Completes an array of all robots, of which each rank has its own, in place.
local function complete(share, array)
  local size, ends = array.layout.size, share.ends
  exchange.share(array.data, counts_of(ends.elites), size, array)
  exchange.share(array.data + share.all_elites, counts_of(ends.others), size, array)
end

--- Brings the whole rows of all robots to all ranks. Collective.
function division.complete(robots)
  local all, share = robots.rows, robots.share
  if not all.share then return end
  local array = structured.new(all.layout, share.total)
  for _, part in ipairs(share:segments()) do
    structured.copy(array, part.first, all, part.place, part.count)
  end
  exchange.all(true) -- an error of a rank ends all here, and not within what follows
  complete(share, array)
  rows.complete(all, array)
end

--- Sends the robots that this rank scored to all others, and receives theirs.
---@param robots limax.population.scored simulated and scored here
---@param failures scoring.failure[] of the robots that were scored here
---@param own_state table|nil that the functions that score may have written to
function division.exchange(robots, failures, own_state)
  if not robots.unscored then return failures end
  check_state(robots, own_state)
  local began = host.clock()
  local facts, failed = robots.rows.facts, {}
  local messages = exchange.all { failures = failures, warnings = exchange.take_warnings(),
    cases = facts.cases, measures = facts.measures }
  local all = robots.rows
  for _, message in ipairs(messages) do
    rows.widen(all, message.cases or 0, message.measures or {})
  end
  rows.outline(all)
  complete(robots.share, all.brief)
  all.stamp = all.stamp + 1
  robots.timing.ranks = host.clock() - began
  for _, message in ipairs(messages) do
    for _, each in ipairs(message.failures) do failed[#failed + 1] = each end
    for _, each in ipairs(message.warnings) do robots.world.say(each.text, each.key) end
  end
  robots.unscored = false
  -- in the order of the robots, whoever scored them
  table.sort(failed, function(a, b) return a.index < b.index end)
  return failed
end

return division
