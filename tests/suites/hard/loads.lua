require "limax.hard_cases.suite" "loads"
