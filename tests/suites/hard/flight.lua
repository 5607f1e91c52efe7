--- flight.lua: the hard cases of this kind; scripts/lib/hard_cases/flight.lua holds them.
require "limax.hard_cases.suite" "flight"
