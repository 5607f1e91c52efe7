require "limax.hard_cases.suite" "modes"
