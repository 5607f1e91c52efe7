// images.h: pictures as files: PNG and GIF of pixels, and zlib's compression. libpng, giflib, zlib.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Adds `image` and `deflate` to the table on top of the stack.
void open_images(lua_State* L);

}  // namespace limax::host
