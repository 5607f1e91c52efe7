--- cairo.lua: a canvas of Cairo: a PNG, pixels for animations, or a PDF page. See canvas.lua for
--- the calls. Opened when something is drawn, not when limax starts.

local bit = require "bit"
local failure = require "limax.base.failure"
local ffi = require "ffi"
local host = require "limax.host"
local source = require "limax.base.source"

ffi.cdef [[
typedef struct { double x_bearing, y_bearing, width, height, x_advance, y_advance; } limax_extents;
void *cairo_image_surface_create(int format, int width, int height);
unsigned char *cairo_image_surface_get_data(void *surface);
int cairo_image_surface_get_stride(void *surface);
void *cairo_pdf_surface_create(const char *path, double width, double height);
void cairo_pdf_surface_set_metadata(void *surface, int kind, const char *text);
int cairo_surface_status(void *surface);
void cairo_surface_flush(void *surface);
int cairo_surface_write_to_png(void *surface, const char *path);
void cairo_surface_finish(void *surface);
void cairo_surface_destroy(void *surface);
void *cairo_create(void *surface);
int cairo_status(void *context);
void cairo_destroy(void *context);
const char *cairo_status_to_string(int status);
void cairo_save(void *context);
void cairo_restore(void *context);
void cairo_translate(void *context, double x, double y);
void cairo_scale(void *context, double x, double y);
void cairo_rotate(void *context, double angle);
void cairo_new_path(void *context);
void cairo_move_to(void *context, double x, double y);
void cairo_line_to(void *context, double x, double y);
void cairo_close_path(void *context);
void cairo_arc(void *context, double x, double y, double radius, double from, double to);
void cairo_rectangle(void *context, double x, double y, double width, double height);
void cairo_clip(void *context);
void cairo_reset_clip(void *context);
void cairo_set_source_rgba(void *context, double red, double green, double blue, double opacity);
void cairo_set_line_width(void *context, double width);
void cairo_set_line_join(void *context, int join);
void cairo_set_dash(void *context, const double *lengths, int count, double offset);
void cairo_fill_preserve(void *context);
void cairo_stroke_preserve(void *context);
void *cairo_font_options_create(void);
void cairo_font_options_set_antialias(void *options, int antialias);
void cairo_font_options_set_hint_style(void *options, int style);
void cairo_font_options_set_hint_metrics(void *options, int metrics);
void cairo_set_font_options(void *context, void *options);
void cairo_select_font_face(void *context, const char *family, int slant, int weight);
void cairo_set_font_size(void *context, double size);
void cairo_text_extents(void *context, const char *text, limax_extents *extents);
void cairo_show_text(void *context, const char *text);
]]

local cairo = {}

local FONT = "DejaVu Sans"
-- values of Cairo's enumerations
local ARGB32, BOLD, JOIN_ROUND, GRAY, UNHINTED = 0, 1, 1, 2, 1
local PDF_TITLE, PDF_CREATED = 0, 5
-- a PDF contains no date, so that equal drawings give equal files
local CREATED = "1970-01-01T00:00:00Z"
local POINTS_PER_PX = 72 / 96

local library
local function open()
  if not library then
    local found, loaded = pcall(ffi.load, "libcairo.so.2")
    if not found then
      failure.raise(1, "Cairo was not found, which draws pictures (on Debian: apt-get install"
        .. " libcairo2 fonts-dejavu-core)")
    end
    library = loaded
  end
  return library
end

---@class limax.draw.cairo : limax.canvas
local Sink = {}
cairo.class = Sink

local function context_of(C, surface)
  local context = ffi.gc(C.cairo_create(surface), C.cairo_destroy)
  local options = C.cairo_font_options_create()
  C.cairo_font_options_set_antialias(options, GRAY)
  -- unhinted: a text is as wide at every scale
  C.cairo_font_options_set_hint_style(options, UNHINTED)
  C.cairo_font_options_set_hint_metrics(options, UNHINTED)
  C.cairo_set_font_options(context, options)
  C.cairo_set_line_join(context, JOIN_ROUND)
  return context
end

local function check(C, status, what)
  if status ~= 0 then
    failure.raise(1, ("%s: %s"):format(what, ffi.string(C.cairo_status_to_string(status))))
  end
end

--- Opens the surface of a new canvas.
function Sink:open()
  local C = open()
  self.C = C
  if self.kind ~= "pixels" then
    local folder, message = host.file.temporary()
    if not folder then failure.raise(1, message) end
    self.folder, self.file = folder, folder .. "/picture." .. self.kind
  end
  if self.kind == "pdf" then
    self.surface = C.cairo_pdf_surface_create(self.file, self.width * POINTS_PER_PX,
      self.height * POINTS_PER_PX)
    C.cairo_pdf_surface_set_metadata(self.surface, PDF_TITLE, self.title)
    C.cairo_pdf_surface_set_metadata(self.surface, PDF_CREATED, CREATED)
  else
    self.surface = C.cairo_image_surface_create(ARGB32, self.width, self.height)
  end
  check(C, C.cairo_surface_status(self.surface), "a picture")
  ffi.gc(self.surface, C.cairo_surface_destroy)
  self.context = context_of(C, self.surface)
  if self.kind == "pdf" then C.cairo_scale(self.context, POINTS_PER_PX, POINTS_PER_PX) end
end

local function set_source(self, hex, opacity)
  local value = tonumber(hex:sub(2), 16)
  self.C.cairo_set_source_rgba(self.context, bit.rshift(value, 16) / 255,
    bit.band(bit.rshift(value, 8), 255) / 255, bit.band(value, 255) / 255, opacity or 1)
end

-- Fills and strokes the current path.
local function paint(self, style)
  local C, context = self.C, self.context
  if style.fill then
    set_source(self, style.fill, style.fill_opacity)
    C.cairo_fill_preserve(context)
  end
  if style.stroke then
    set_source(self, style.stroke, style.opacity)
    C.cairo_set_line_width(context, style.width or 1)
    local dash = style.dash or {}
    C.cairo_set_dash(context, ffi.new("double[?]", math.max(#dash, 1), dash), #dash, 0)
    C.cairo_stroke_preserve(context)
  end
  C.cairo_new_path(context)
end

function Sink:clip(left, top, right, bottom)
  self.C.cairo_reset_clip(self.context)
  if left then
    self.C.cairo_rectangle(self.context, left, top, right - left, bottom - top)
    self.C.cairo_clip(self.context)
  end
end

function Sink:outline(points, closed, style)
  local C, context = self.C, self.context
  for k, p in ipairs(points) do
    if k == 1 then
      C.cairo_move_to(context, p[1], p[2])
    else
      C.cairo_line_to(context, p[1], p[2])
    end
  end
  if closed then C.cairo_close_path(context) end
  paint(self, style)
end

function Sink:circle(center, radius, style)
  self.C.cairo_arc(self.context, center[1], center[2], radius, 0, 2 * math.pi)
  paint(self, style)
end

local function set_font(C, context, style)
  C.cairo_select_font_face(context, FONT, 0, style.bold and BOLD or 0)
  C.cairo_set_font_size(context, style.size)
end

local function advance(C, context, text)
  local extents = ffi.new "limax_extents"
  C.cairo_text_extents(context, text, extents)
  return extents.x_advance
end

function Sink:write(x, y, text, style)
  local C, context = self.C, self.context
  C.cairo_save(context)
  C.cairo_translate(context, x, y)
  if style.upwards then C.cairo_rotate(context, -math.pi / 2) end
  set_font(C, context, style)
  local share = style.anchor == "middle" and 0.5 or style.anchor == "end" and 1 or 0
  C.cairo_move_to(context, share > 0 and -share * advance(C, context, text) or 0, 0)
  set_source(self, style.fill)
  C.cairo_show_text(context, text)
  C.cairo_restore(context)
  C.cairo_new_path(context)
end

-- Four bytes for each pixel: red, green, blue and opacity. Cairo's colours are multiplied by it.
local function pixels_of(C, surface, width, height)
  C.cairo_surface_flush(surface)
  local rows = C.cairo_image_surface_get_data(surface)
  local stride = C.cairo_image_surface_get_stride(surface)
  local out = ffi.new("uint8_t[?]", width * height * 4)
  for y = 0, height - 1 do
    local row = ffi.cast("uint32_t *", rows + y * stride)
    for x = 0, width - 1 do
      local pixel, at = row[x], (y * width + x) * 4
      local a = bit.rshift(pixel, 24)
      if a > 0 then
        out[at] = bit.band(bit.rshift(pixel, 16), 255) * 255 / a + 0.5
        out[at + 1] = bit.band(bit.rshift(pixel, 8), 255) * 255 / a + 0.5
        out[at + 2] = bit.band(pixel, 255) * 255 / a + 0.5
        out[at + 3] = a
      end
    end
  end
  return ffi.string(out, width * height * 4)
end

--- The bytes of the file, or those of the pixels.
function Sink:finish()
  local C = self.C
  check(C, C.cairo_status(self.context), "a picture")
  if self.kind == "pixels" then return pixels_of(C, self.surface, self.width, self.height) end
  if self.kind == "pdf" then
    C.cairo_destroy(ffi.gc(self.context, nil))
    C.cairo_surface_finish(self.surface)
    check(C, C.cairo_surface_status(self.surface), self.file)
  else
    check(C, C.cairo_surface_write_to_png(self.surface, self.file), self.file)
  end
  local bytes, message = source.read(self.file)
  host.file.remove_temporary(self.folder)
  assert(bytes, message)
  return bytes
end

local scratch

--- px that a text takes along its line.
---@param text string UTF-8
function cairo.width(text, style)
  local C = open()
  if not scratch then
    local surface = ffi.gc(C.cairo_image_surface_create(ARGB32, 1, 1), C.cairo_surface_destroy)
    scratch = { surface = surface, context = context_of(C, surface) }
  end
  set_font(C, scratch.context, style)
  return advance(C, scratch.context, text)
end

return cairo
