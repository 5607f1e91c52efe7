require "limax.hard_cases.suite" "friction"
