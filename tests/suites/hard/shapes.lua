require "limax.hard_cases.suite" "shapes"
