--- extremes.lua: the hard cases of this kind; scripts/lib/hard_cases/extremes.lua holds them.
require "limax.hard_cases.suite" "extremes"
