--- friction.lua: the hard cases of this kind; scripts/lib/hard_cases/friction.lua holds them.
require "limax.hard_cases.suite" "friction"
