require "limax.hard_cases.suite" "muscles"
