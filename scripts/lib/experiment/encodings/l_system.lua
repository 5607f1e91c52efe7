--- l_system.lua: a body that grows by rewriting: a generative encoding in Lua only. Each of a few
--- letters has a rule, a word of letters, moves and brackets that replaces it at every level. A
--- turtle then reads the word: a letter places a voxel, a move goes one voxel on, brackets return
--- to where they opened. Hornby and Pollack, "Body-brain co-evolution using L-systems as a
--- generative encoding", GECCO 2001.

local schema = require "limax.engine.schema"

local LETTERS, LENGTH = 4, 6
-- what a symbol of a rule means: letters 1 to 4, then moves along an axis, then brackets
local MOVES = { { 1, 1 }, { 1, -1 }, { 2, 1 }, { 2, -1 }, { 3, 1 }, { 3, -1 } }
local OPEN, CLOSE = LETTERS + #MOVES + 1, LETTERS + #MOVES + 2
local SYMBOLS = CLOSE
-- genes of a letter besides its rule: material, stiffness, amplitude, phase
local FACTS = 4

-- A gene as a whole number from 1 to n: its fraction, so that any gene means something.
local function one_of(gene, n) return 1 + math.floor((gene - math.floor(gene)) * n) end

local function fraction(gene) return gene - math.floor(gene) end

-- The word after `levels` of rewriting, cut at `most` symbols.
local function grown(genes, levels, most)
  local word = { 1 }
  for _ = 1, levels do
    local longer = {}
    for _, symbol in ipairs(word) do
      if symbol <= LETTERS then
        longer[#longer + 1] = symbol
        for k = 1, LENGTH do
          longer[#longer + 1] = one_of(genes[(symbol - 1) * LENGTH + k], SYMBOLS)
        end
      else
        longer[#longer + 1] = symbol
      end
      if #longer > most then break end
    end
    word = longer
  end
  return word
end

-- The turtle: begins in the middle of the floor, and stays where a move would leave the lattice.
local function draw(word, lattice, place)
  local at, stack = { math.ceil(lattice[1] / 2), math.ceil(lattice[2] / 2), 1 }, {}
  for _, symbol in ipairs(word) do
    local move = MOVES[symbol - LETTERS]
    if symbol <= LETTERS then
      place(1 + at[1] - 1 + lattice[1] * (at[2] - 1 + lattice[2] * (at[3] - 1)), symbol)
    elseif move then
      local axis = move[1]
      at[axis] = math.max(1, math.min(lattice[axis], at[axis] + move[2]))
    elseif symbol == OPEN then
      stack[#stack + 1] = { at[1], at[2], at[3] }
    elseif symbol == CLOSE and stack[1] then
      at = table.remove(stack)
    end
  end
end

return {
  fields = { initial_scale = true },
  options = { levels = schema.number { value = 4, unit = "times that a word is rewritten",
    minimum = 1, maximum = 8, integer = true, note = "fills a body of 5x5x5 voxels" } },
  make = function(options, context)
    local letters = LETTERS * LENGTH
    return {
      genes = letters + LETTERS * FACTS,
      express = function(robots)
        for _, i in ipairs(robots) do
          local genes, voxels, weights = robots:genes(i), robots:voxels(i), robots:weights(i)
          for v = 1, #voxels do voxels[v] = 0 end
          local word = grown(genes, options.levels, 8 * context.voxels)
          draw(word, context.lattice, function(v, letter)
            local first = letters + (letter - 1) * FACTS
            -- the empty material is 0
            voxels[v] = one_of(genes[first + 1], context.materials - 1)
            for kind = 1, 3 do weights[kind][v] = fraction(genes[first + 1 + kind]) end
          end)
        end
      end,
    }
  end,
}
