--- modes.lua: the hard cases of this kind; scripts/lib/hard_cases/modes.lua holds them.
require "limax.hard_cases.suite" "modes"
