--- contact.lua: the hard cases of this kind; scripts/lib/hard_cases/contact.lua holds them.
require "limax.hard_cases.suite" "contact"
