--- sameness.lua: the hard cases of this kind; scripts/lib/hard_cases/sameness.lua holds them.
require "limax.hard_cases.suite" "sameness"
