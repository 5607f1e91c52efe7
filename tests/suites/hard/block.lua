--- block.lua: the hard cases of this kind; scripts/lib/hard_cases/block.lua holds them.
require "limax.hard_cases.suite" "block"
