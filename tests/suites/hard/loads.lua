--- loads.lua: the hard cases of this kind; scripts/lib/hard_cases/loads.lua holds them.
require "limax.hard_cases.suite" "loads"
