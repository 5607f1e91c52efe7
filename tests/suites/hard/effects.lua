--- effects.lua: the hard cases of this kind; scripts/lib/tools/bench/hard_cases/effects.lua holds them.
require "limax.tools.bench.hard_cases.suite" "effects"
