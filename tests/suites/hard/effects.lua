--- effects.lua: the hard cases of this kind; scripts/lib/hard_cases/effects.lua holds them.
require "limax.hard_cases.suite" "effects"
