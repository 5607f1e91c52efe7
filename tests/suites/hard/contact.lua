require "limax.hard_cases.suite" "contact"
