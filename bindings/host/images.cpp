// images.cpp: host.image.gif and host.deflate. Pixels are texts of four bytes each: red,
// green, blue, opacity; rows from the top.
#include <gif_lib.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "guard.h"
#include "modules.h"

namespace limax::host {
namespace {

constexpr int palette_size = 256;
constexpr int clear_index = 255;  // of the palette: a transparent pixel
constexpr int bucket_count = 32 * 32 * 32;

// ---- GIF ----

int bucket_of(const unsigned char* pixel) {
    return pixel[0] >> 3 << 10 | pixel[1] >> 3 << 5 | pixel[2] >> 3;
}

struct palette {
    std::array<GifColorType, palette_size> colors{};
    std::vector<unsigned char> nearest = std::vector<unsigned char>(bucket_count);
};

// The 255 most frequent colours, to five bits each; all others become the nearest of them.
palette make_palette(const std::vector<std::string_view>& frames) {
    struct sum {
        std::uint64_t count, color[3];
    };
    std::vector<sum> sums(bucket_count, sum{});
    for (const std::string_view frame : frames)
        for (std::size_t at = 0; at < frame.size(); at += 4) {
            const auto* pixel = reinterpret_cast<const unsigned char*>(frame.data()) + at;
            if (pixel[3] < 128) continue;
            sum& bucket = sums[std::size_t(bucket_of(pixel))];
            ++bucket.count;
            for (int k = 0; k < 3; ++k) bucket.color[k] += pixel[k];
        }
    std::vector<std::size_t> order;
    for (std::size_t k = 0; k < sums.size(); ++k)
        if (sums[k].count > 0) order.push_back(k);
    std::stable_sort(order.begin(), order.end(),
                     [&](std::size_t a, std::size_t b) { return sums[a].count > sums[b].count; });
    palette result;
    const std::size_t used = std::min(order.size(), std::size_t(clear_index));
    for (std::size_t k = 0; k < used; ++k) {
        const auto& [count, color] = sums[order[k]];
        result.colors[k] = {GifByteType(color[0] / count), GifByteType(color[1] / count),
                            GifByteType(color[2] / count)};
    }
    for (const std::size_t bucket : order) {
        const auto away = [bucket](const GifColorType& color) {
            const int red = int(bucket >> 10 << 3) + 4 - color.Red;
            const int green = int((bucket >> 5 & 31) << 3) + 4 - color.Green;
            const int blue = int((bucket & 31) << 3) + 4 - color.Blue;
            return red * red + green * green + blue * blue;
        };
        const auto nearest =
            std::min_element(result.colors.begin(), result.colors.begin() + std::ptrdiff_t(used),
                             [&](const auto& a, const auto& b) { return away(a) < away(b); });
        result.nearest[bucket] = static_cast<unsigned char>(nearest - result.colors.begin());
    }
    return result;
}

int write_gif(GifFileType* file, const GifByteType* bytes, int count) {
    static_cast<std::string*>(file->UserData)
        ->append(reinterpret_cast<const char*>(bytes), std::size_t(count));
    return count;
}

void check_gif(int done, const GifFileType* file) {
    if (done != GIF_ERROR) return;
    const char* const reason = GifErrorString(file->Error);
    throw std::runtime_error(std::string("GIF: ") + (reason != nullptr ? reason : "failed"));
}

// Netscape's application block: the animation repeats forever.
void put_loop(GifFileType* file) {
    const char* const name = "NETSCAPE2.0";
    const unsigned char forever[] = {1, 0, 0};
    check_gif(EGifPutExtensionLeader(file, APPLICATION_EXT_FUNC_CODE), file);
    check_gif(EGifPutExtensionBlock(file, 11, name), file);
    check_gif(EGifPutExtensionBlock(file, 3, forever), file);
    check_gif(EGifPutExtensionTrailer(file), file);
}

int lua_gif(lua_State* L) {
    const int width = luaL_checkint(L, 1), height = luaL_checkint(L, 2);
    luaL_checktype(L, 3, LUA_TTABLE);
    const int delay = luaL_checkint(L, 4);
    luaL_argcheck(L, delay >= 1 && delay <= 65535, 4, "a frame is shown 1 to 65535 hundredths");
    std::vector<std::string_view> frames;
    const int count = int(lua_objlen(L, 3));
    luaL_argcheck(L, count > 0, 3, "an animation needs a frame");
    for (int k = 1; k <= count; ++k) {
        lua_rawgeti(L, 3, k);  // the table keeps the text alive
        frames.push_back(text_argument(L, -1));
        if (frames.back().size() != std::size_t(width) * std::size_t(height) * 4)
            throw std::runtime_error("expected four bytes for each pixel");
        lua_pop(L, 1);
    }
    const palette colors = make_palette(frames);
    const std::unique_ptr<ColorMapObject, decltype(&GifFreeMapObject)> map(
        GifMakeMapObject(palette_size, colors.colors.data()), GifFreeMapObject);
    if (!map) throw std::runtime_error("GIF: out of memory");

    std::string bytes;
    int problem = 0;
    const auto close = [](GifFileType* file) { EGifCloseFile(file, nullptr); };
    std::unique_ptr<GifFileType, decltype(close)> file(EGifOpen(&bytes, write_gif, &problem),
                                                       close);
    if (!file) throw std::runtime_error("GIF: cannot begin");
    EGifSetGifVersion(file.get(), true);
    check_gif(EGifPutScreenDesc(file.get(), width, height, 8, 0, map.get()), file.get());
    put_loop(file.get());
    std::vector<GifPixelType> row(static_cast<std::size_t>(width));
    for (const std::string_view frame : frames) {
        GraphicsControlBlock control{};
        control.DisposalMode = DISPOSE_BACKGROUND;
        control.DelayTime = delay;
        control.TransparentColor = clear_index;
        std::array<GifByteType, 4> extension{};
        EGifGCBToExtension(&control, extension.data());
        check_gif(EGifPutExtension(file.get(), GRAPHICS_EXT_FUNC_CODE, int(extension.size()),
                                   extension.data()),
                  file.get());
        check_gif(EGifPutImageDesc(file.get(), 0, 0, width, height, false, nullptr), file.get());
        const auto* pixel = reinterpret_cast<const unsigned char*>(frame.data());
        for (int y = 0; y < height; ++y) {
            for (GifPixelType& index : row) {
                index = pixel[3] < 128 ? GifPixelType(clear_index)
                                       : colors.nearest[std::size_t(bucket_of(pixel))];
                pixel += 4;
            }
            check_gif(EGifPutLine(file.get(), row.data(), width), file.get());
        }
    }
    // the trailer is written when the file is closed
    file.reset();
    return push(L, bytes);
}

// A zlib stream (RFC 1950), as small as zlib makes it.
int lua_deflate(lua_State* L) {
    const std::string_view bytes = text_argument(L, 1);
    uLongf size = compressBound(uLong(bytes.size()));
    std::string packed(size, '\0');
    if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size,
                  reinterpret_cast<const Bytef*>(bytes.data()), uLong(bytes.size()),
                  Z_BEST_COMPRESSION) != Z_OK)
        throw std::runtime_error("deflate: zlib failed");
    return push(L, packed.substr(0, size));
}

}  // namespace

void open_images(lua_State* L) {
    lua_newtable(L);
    add_function<lua_gif>(L, "gif");
    lua_setfield(L, -2, "image");
    add_function<lua_deflate>(L, "deflate");
}

}  // namespace limax::host
