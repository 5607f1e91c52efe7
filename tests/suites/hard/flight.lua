require "limax.hard_cases.suite" "flight"
