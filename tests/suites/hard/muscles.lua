--- muscles.lua: the hard cases of this kind; scripts/lib/hard_cases/muscles.lua holds them.
require "limax.hard_cases.suite" "muscles"
