--- html.lua: pieces of a page as text. Whatever comes from a run passes through `escaped` or
--- `json`; the page's content policy allows scripts and style by their hashes only, so that nothing
--- else can run.

local base64 = require "limax.base.base64"
local host = require "limax.host"
local source = require "limax.base.source"

local html = {}

local ENTITIES = { ["&"] = "&amp;", ["<"] = "&lt;", [">"] = "&gt;", ['"'] = "&quot;",
  ["'"] = "&#39;" }

--- A file of this folder.
function html.read(name)
  return assert(source.read(("%s/scripts/lib/tools/report/%s"):format(host.home, name)))
end

--- A value as text of a page; what HTML cannot hold becomes a question mark.
function html.escaped(value)
  return (tostring(value):gsub("[&<>\"']", ENTITIES):gsub("[%z\1-\8\11\12\14-\31\127]", "?"))
end

--- A value as JSON within a script element, without a "<" that could end the element.
function html.json(value) return (host.json.encode(value):gsub("<", "\\u003c")) end

local function number_text(value)
  if value ~= value or math.abs(value) == math.huge then return tostring(value) end
  if value == math.floor(value) and math.abs(value) < 1e9 then return ("%d"):format(value) end
  return ("%.4g"):format(value)
end

--- A table with a head; numbers are aligned right. The first column names its row.
---@param columns string[]
---@param rows any[][]
---@param caption? string
function html.table(columns, rows, caption)
  local parts = { '<div class="scroll" tabindex="0" role="region" aria-label="',
    html.escaped(caption or "table"), '"><table>' }
  if caption then parts[#parts + 1] = "<caption>" .. html.escaped(caption) .. "</caption>" end
  parts[#parts + 1] = "<thead><tr>"
  for c, name in ipairs(columns) do
    local first = rows[1] and rows[1][c]
    parts[#parts + 1] = ('<th scope="col"%s>%s</th>'):format(
      type(first) == "number" and ' class="number"' or "", html.escaped(name))
  end
  parts[#parts + 1] = "</tr></thead><tbody>\n"
  for _, row in ipairs(rows) do
    parts[#parts + 1] = "<tr>"
    for c = 1, #columns do
      local value = row[c]
      if value == nil then value = "" end
      local tag = c == 1 and 'th scope="row"' or "td"
      if type(value) == "number" then
        parts[#parts + 1] = ('<%s class="number">%s</%s>'):format(tag, number_text(value),
          tag:match "^%a+")
      else
        parts[#parts + 1] = ("<%s>%s</%s>"):format(tag, html.escaped(value), tag:match "^%a+")
      end
    end
    parts[#parts + 1] = "</tr>\n"
  end
  parts[#parts + 1] = "</tbody></table></div>"
  return table.concat(parts)
end

--- Something that is folded away until it is opened.
---@param body string HTML
---@param open? boolean
function html.details(summary, body, open)
  return ("<details%s><summary>%s</summary>%s</details>\n"):format(open and " open" or "",
    html.escaped(summary), body)
end

--- A chart as a figure: SVG, its numbers as JSON for the script, and as a table.
---@param drawn limax.chart.inline
function html.figure(drawn, caption)
  local rows = html.table(drawn.columns, drawn.rows, caption)
  return table.concat {
    '<figure class="chart"><div class="scroll" tabindex="0" role="group" aria-label="',
    html.escaped(caption), ', arrow keys read its numbers">', drawn.svg, "</div>",
    '<output aria-live="polite"></output>', "<figcaption>", html.escaped(caption),
    '</figcaption><script type="application/json">', html.json(drawn.data), "</script>",
    html.details(drawn.left_out == 0 and "numbers" or ("numbers, %d rows of %d"):format(#drawn.rows,
      #drawn.rows + drawn.left_out), rows), "</figure>\n",
  }
end

-- The source of a script or style in a content policy.
local function hash_source(text)
  local bytes = host.sha256(text):gsub("%x%x", function(two)
    return string.char(tonumber(two, 16))
  end)
  return "'sha256-" .. base64.encode(bytes) .. "'"
end

---@class limax.report.page
---@field title string
---@field style string CSS
---@field scripts string[] JavaScript without the end of a script element
---@field body string HTML

--- A whole page that loads nothing and runs only its own scripts.
function html.page(page)
  local sources, scripts = {}, {}
  for k, text in ipairs(page.scripts) do
    assert(not text:lower():find("</script", 1, true), "a script contains the end of its element")
    sources[k] = hash_source(text)
    scripts[k] = "<script>" .. text .. "</script>\n"
  end
  local policy = ("default-src 'none'; script-src %s; style-src %s; base-uri 'none'; "
    .. "form-action 'none'"):format(#sources > 0 and table.concat(sources, " ") or "'none'",
    hash_source(page.style))
  return table.concat {
    "<!DOCTYPE html>\n", '<html lang="en"><head><meta charset="utf-8">\n',
    '<meta http-equiv="Content-Security-Policy" content="', policy, '">\n',
    '<meta name="viewport" content="width=device-width, initial-scale=1">\n',
    '<meta name="referrer" content="no-referrer">\n', "<title>", html.escaped(page.title),
    "</title>\n<style>", page.style, "</style></head>\n<body>\n", page.body,
    table.concat(scripts), "</body></html>\n",
  }
end

return html
