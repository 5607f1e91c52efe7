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

local function cell(tag, attributes, value, is_number)
  return ("<%s%s%s>%s</%s>"):format(tag, attributes, is_number and ' class="number"' or "",
    type(value) == "number" and number_text(value) or html.escaped(value), tag)
end

--- A table with a head; numbers are aligned right. The first column names its row.
function html.table(columns, rows, caption)
  local head, lines, has_number = {}, {}, {}
  for _, row in ipairs(rows) do
    for c = 1, #columns do has_number[c] = has_number[c] or type(row[c]) == "number" end
  end
  for c, name in ipairs(columns) do head[c] = cell("th", ' scope="col"', name, has_number[c]) end
  for k, row in ipairs(rows) do
    local cells = {}
    for c = 1, #columns do
      local value = row[c] == nil and "" or row[c]
      cells[c] = cell(c == 1 and "th" or "td", c == 1 and ' scope="row"' or "", value,
        type(value) == "number")
    end
    lines[k] = "<tr>" .. table.concat(cells) .. "</tr>\n"
  end
  caption = html.escaped(caption)
  return ('<div class="scroll" tabindex="0" role="region" aria-label="%s"><table><caption>%s'
    .. "</caption><thead><tr>%s</tr></thead><tbody>\n%s</tbody></table></div>"):format(caption,
    caption, table.concat(head), table.concat(lines))
end

--- A part of the page that is closed until the reader opens it.
---@param body string HTML
---@param open_id? string the id of one that is open at first
function html.details(summary, body, open_id)
  return ("<details%s><summary>%s</summary>%s</details>\n"):format(
    open_id and (' id="%s" open'):format(open_id) or "", html.escaped(summary), body)
end

--- A chart as a figure: SVG, its numbers as JSON for the script, and as a table.
---@param title string that the chart shows
---@param caption? string more about it
function html.figure(drawn, title, caption)
  local name = html.escaped(title)
  local out = drawn.left_out > 0 and (", %d rows of %d"):format(#drawn.rows,
    #drawn.rows + drawn.left_out) or ""
  return ('<figure class="chart"><div class="scroll" tabindex="0" role="group" aria-label="%s,'
    .. ' arrow keys read its %s">%s</div><output aria-live="polite"></output>%s'
    .. '<script type="application/json">%s</script>%s</figure>\n'):format(name,
    drawn.data.robots and "robots" or "numbers", drawn.svg,
    caption and "<figcaption>" .. html.escaped(caption) .. "</figcaption>" or "",
    html.json(drawn.data),
    html.details("numbers" .. out, html.table(drawn.columns, drawn.rows, title)))
end

-- The source of a script or style in a content policy.
local function hash_source(text)
  local bytes = host.sha256(text):gsub("%x%x", function(two)
    return string.char(tonumber(two, 16))
  end)
  return "'sha256-" .. base64.encode(bytes) .. "'"
end

--- A whole page that loads nothing and runs only its own scripts.
---@param page { title: string, style: string, scripts: string[], body: string } CSS; JavaScript
--- without the end of a script element; HTML
function html.page(page)
  local sources, scripts = {}, {}
  for k, text in ipairs(page.scripts) do
    assert(not text:lower():find("</script", 1, true), "a script contains the end of its element")
    sources[k] = hash_source(text)
    scripts[k] = "<script>" .. text .. "</script>\n"
  end
  local policy = ("default-src 'none'; script-src %s; style-src %s; img-src data:; "
    .. "base-uri 'none'; form-action 'none'"):format(
    #sources > 0 and table.concat(sources, " ") or "'none'", hash_source(page.style))
  return ([[
<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="%s">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="referrer" content="no-referrer">
<title>%s</title>
<style>%s</style></head>
<body>
%s%s</body></html>
]]):format(policy, html.escaped(page.title), page.style, page.body, table.concat(scripts))
end

return html
