--- statistics.lua: the exact tests against enumeration of every sign and every split, and against
--- published tables; intervals against all resamples of a small sample; power against the size of
--- a test and a published table.

local bootstrap = require "limax.base.statistics.bootstrap"
local holm = require "limax.base.statistics.holm"
local limax = require "limax"
local power = require "limax.base.statistics.power"
local rank_sum = require "limax.base.statistics.rank_sum"
local sample = require "limax.base.statistics.sample"
local signed_rank = require "limax.base.statistics.signed_rank"
local sorting = require "limax.base.sorting"
local student = require "limax.base.statistics.student"

local suite = require("limax.test").suite "statistics"

local function stream(k) return limax.engine.random(11, 1, "user", k, 0) end

-- A mid-rank by its definition: the values below, and half of the equal ones.
local function rank_of(value, list)
  local below, equal = 0, 0
  for _, other in ipairs(list) do
    below = below + (other < value and 1 or 0)
    equal = equal + (other == value and 1 or 0)
  end
  return below + (equal + 1) / 2
end

-- Wilcoxon's p over all 2^n signs of the sizes.
local function enumerated_signs(differences)
  local sizes, observed, total = {}, 0, 0
  for _, d in ipairs(differences) do
    if d ~= 0 then sizes[#sizes + 1] = math.abs(d) end
  end
  for _, d in ipairs(differences) do
    if d ~= 0 then
      local rank = rank_of(math.abs(d), sizes)
      total = total + rank
      if d > 0 then observed = observed + rank end
    end
  end
  local far, n = 0, #sizes
  for signs = 0, 2 ^ n - 1 do
    local sum, left = 0, signs
    for i = 1, n do
      if left % 2 == 1 then sum = sum + rank_of(sizes[i], sizes) end
      left = math.floor(left / 2)
    end
    if math.abs(sum - total / 2) >= math.abs(observed - total / 2) then far = far + 1 end
  end
  return far / 2 ^ n
end

-- Numbers whose bits are hard to sort: of all magnitudes, both zeros, both infinities, equal ones.
local function hard_number(random)
  local kind = random:integer(5)
  return kind == 1 and 0 or kind == 2 and -0 or kind == 3 and random:integer(-2, 2)
    or kind == 4 and (random:integer(2) == 1 and math.huge or -math.huge)
    or random:normal() * 2 ^ random:integer(-1070, 1020)
end

suite:test("numbers are sorted, equal ones in index order", function(t)
  local random, wrong = stream(9), 0
  for count = 0, 300 do
    local list = {}
    for k = 1, count do list[k] = hard_number(random) end
    for name, sign in pairs { ascending = 1, descending = -1 } do
      local order = sorting[name](list)
      if #order ~= count then wrong = wrong + 1 end
      for k = 2, count do
        local a, b = sign * list[order[k - 1]], sign * list[order[k]]
        if not (a < b or a == b and order[k - 1] < order[k]) then wrong = wrong + 1 end
      end
    end
  end
  t:equal(wrong, 0)
end)

suite:test("signed ranks: p equals enumeration, with ties and zeros", function(t)
  for k = 1, 60 do
    local random, differences = stream(k), {}
    -- few different values give ties and zeros; every third sample has none
    for i = 1, 1 + k % 9 do
      differences[i] = k % 3 == 0 and random:normal() or random:integer(9) - 4
    end
    t:near(signed_rank.test(differences).p, enumerated_signs(differences), { rtol = 1e-14 })
  end
end)

suite:test("signed ranks: extreme samples and critical values", function(t)
  t:equal(signed_rank.test({}).p, 1)
  t:equal(signed_rank.test({ 0, 0 }).zeros, 2)
  t:equal(signed_rank.test({ 1, 2, 3, 4, 5, 6 }).p, signed_rank.smallest_p(6))
  t:equal(signed_rank.smallest_p(6), 0.03125)
  -- opposite signs have the same p
  t:equal(signed_rank.test({ 1, -2, 3, 4 }).p, signed_rank.test({ -1, 2, -3, -4 }).p)
  -- Wilcoxon's table
  t:equal(signed_rank.critical(10, 0.05), 8)
  t:equal(signed_rank.critical(7, 0.05), 2)
  t:equal(signed_rank.critical(20, 0.05), 52)
  t:equal(signed_rank.critical(5, 0.05), nil)
end)

-- The Mann-Whitney p over all splits into n and m, and the observed U.
local function enumerated_splits(first, second)
  local all = { unpack(first) }
  for _, value in ipairs(second) do all[#all + 1] = value end
  local n, mean = #first, #first * #second / 2
  -- U of the values whose bits are set, and their number
  local function u_of(mask)
    local u, count = 0, 0
    for i, value in ipairs(all) do
      local is_first = bit.band(mask, bit.lshift(1, i)) ~= 0
      count = count + (is_first and 1 or 0)
      for j, other in ipairs(all) do
        if is_first and bit.band(mask, bit.lshift(1, j)) == 0 then
          u = u + (value > other and 1 or value == other and 0.5 or 0)
        end
      end
    end
    return u, count
  end
  local observed, far, whole = u_of(2 ^ (n + 1) - 2), 0, 0
  for mask = 0, 2 ^ (#all + 1) - 2, 2 do
    local u, count = u_of(mask)
    if count == n then
      whole = whole + 1
      far = far + (math.abs(u - mean) >= math.abs(observed - mean) and 1 or 0)
    end
  end
  return far / whole, observed
end

suite:test("rank sums: p and U equal enumeration, with ties", function(t)
  for k = 1, 45 do
    local random, first, second = stream(1000 + k), {}, {}
    local function draw() return k % 3 == 0 and random:normal() or random:integer(6) end
    for i = 1, 1 + k % 5 do first[i] = draw() end
    for i = 1, 1 + k % 4 do second[i] = draw() end
    local found = rank_sum.test(first, second)
    local p, u = enumerated_splits(first, second)
    t:near(found.p, p, { rtol = 1e-12 })
    t:equal(found.u, u)
    t:equal(found.a12, u / (#first * #second))
  end
end)

suite:test("rank sums: extreme samples and critical values", function(t)
  t:near(rank_sum.test({ 4, 5, 6 }, { 1, 2, 3 }).p, 0.1, { rtol = 1e-14 })
  t:near(rank_sum.smallest_p(3, 3), 0.1, { rtol = 1e-14 })
  t:near(rank_sum.smallest_p(5, 5), 2 / 252, { rtol = 1e-14 })
  t:equal(rank_sum.test({ 1, 1 }, { 1, 1 }).p, 1)
  -- published table
  t:equal(rank_sum.critical(10, 10, 0.05), 23)
  t:equal(rank_sum.critical(5, 5, 0.05), 2)
  t:equal(rank_sum.critical(3, 3, 0.05), nil)
end)

suite:test("Holm's adjustment", function(t)
  t:near(holm.adjust { 0.01, 0.04, 0.03, 0.005 }, { 0.03, 0.06, 0.06, 0.02 })
  t:equal(holm.adjust { 0.6, 0.7 }, { 1, 1 })
  t:near(holm.adjust { 0.02, 0.02, 0.02 }, { 0.06, 0.06, 0.06 })
  t:equal(holm.adjust {}, {})
end)

suite:test("median, interquartile mean, mean and quantiles", function(t)
  t:equal(sample.interquartile_mean { 8, 1, 2, 7, 3, 6, 5, 100 }, (3 + 5 + 6 + 7) / 4)
  -- nine values lose two at each end
  t:equal(sample.interquartile_mean { 9, 8, 7, 6, 5, 4, 3, 2, 1 }, 5)
  t:equal({ sample.centre { 1, 2, 9, 3, 4, 5, 6 } }, { 4, "median" })
  t:equal({ sample.centre { 8, 1, 2, 7, 3, 6, 5, 100 } }, { 5.25, "interquartile mean" })
  t:equal(sample.median { 1, 2, 4, 9 }, 3)
  t:equal(sample.mean {}, nil)
  t:near(sample.quantile({ 1, 2, 3, 4 }, 0.5), 2.5)
  t:near(sample.quantile({ 1, 2, 3, 4 }, 0.1), 1.3)
  t:equal(sample.quantile({ 7 }, 0.9), 7)
end)

suite:test("the bootstrap interval is that of all resamples", function(t)
  local list, means = { 1, 2, 4, 8, 16 }, {}
  local function resample(k, sum)
    if k > #list then
      means[#means + 1] = sum / #list
      return
    end
    for i = 1, #list do resample(k + 1, sum + list[i]) end
  end
  resample(1, 0)
  table.sort(means)
  local low, high = bootstrap.interval(list, sample.mean)
  -- 3125 equally likely means in steps of 0.2
  t:near(low, means[math.floor(0.025 * #means)], { atol = 0.21 })
  t:near(high, means[math.floor(0.975 * #means)], { atol = 0.21 })
  t:same_bits({ bootstrap.interval(list, sample.mean) }, { low, high })
  t:equal({ bootstrap.interval({ 3, 3, 3 }, sample.median, 0.95, 100) }, { 3, 3 })
end)

suite:test("power: the size of the test without an effect, a table's value with one", function(t)
  -- four standard errors of 4000 simulations
  local function close(got, expected)
    t:near(got, expected, { atol = 4 * math.sqrt(expected * (1 - expected) / 4000) })
  end
  close(power.signed_rank(6, 0, 0.05), 2 / 64)
  close(power.rank_sum(5, 0, 0.05), 2 * 4 / 252)
  t:equal(power.signed_rank(5, 3, 0.05), 0)
  t:equal(power.rank_sum(3, 3, 0.05), 0)
  -- n = 5, 10, 20 and a shift of one standard deviation
  close(power.rank_sum(5, 1, 0.05), 0.22)
  close(power.rank_sum(10, 1, 0.05), 0.50)
  close(power.rank_sum(20, 1, 0.05), 0.84)
end)

suite:test("Student's t against its table and an interval by hand", function(t)
  -- two-sided 95 % and 99.9 %
  for _, row in ipairs { { 1, 12.706, 636.62 }, { 2, 4.303, 31.599 }, { 5, 2.571, 6.869 },
    { 10, 2.228, 4.587 }, { 30, 2.042, 3.646 } } do
    t:near(student.quantile(0.95, row[1]), row[2], { atol = 6e-4 })
    t:near(student.quantile(0.999, row[1]), row[3], { atol = 6e-3 })
  end
  -- closed forms
  t:near(student.within(3, 1), 2 / math.pi * math.atan(3), { rtol = 1e-14 })
  t:near(student.within(3, 2), 3 / math.sqrt(11), { rtol = 1e-14 })
  local mean, half = student.interval({ 1, 2, 3, 4 }, 0.95)
  t:near({ mean, half }, { 2.5, 3.18245 * math.sqrt(5 / 3 / 4) }, { rtol = 1e-5 })
end)
