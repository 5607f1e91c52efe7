--- run_folder_page.lua: the tables of RUN_FOLDER.md, which are made of settings/records.lua: those
--- between a line `<!-- fields: NAME -->` and a line `<!-- end -->`.

local host = require "limax.host"
local record_rules = require "limax.settings.record_rules"
local records = require "limax.settings.records"
local source = require "limax.base.source"

local run_folder_page = { path = "scripts/RUN_FOLDER.md" }

-- Fields of arrays, which have a type of NumPy.
local IN_ARRAY = { robot = true, body = true, outcome = true }

--- The text of the page with tables that are up to date.
function run_folder_page.text()
  local page = assert(source.read(host.home .. "/" .. run_folder_page.path))
  return (page:gsub("(<!%-%- fields: ([%w.]+) %-%->\n).-(<!%-%- end %-%->)",
    function(begins, name, ends)
      local rows = records
      for part in name:gmatch "[^.]+" do rows = assert(rows[part], name) end
      return begins .. record_rules.page(rows, IN_ARRAY[name]) .. ends
    end))
end

return run_folder_page
