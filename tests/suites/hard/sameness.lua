require "limax.hard_cases.suite" "sameness"
