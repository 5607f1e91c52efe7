--- shapes.lua: the hard cases of this kind; scripts/lib/hard_cases/shapes.lua holds them.
require "limax.hard_cases.suite" "shapes"
