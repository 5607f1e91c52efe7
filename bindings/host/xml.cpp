// xml.cpp: XML text to Lua tables through pugixml, which expands no entities of the document and
// reads no other file. Document types are refused: no supported format needs one.
#include <algorithm>
#include <pugixml.hpp>
#include <string>

#include "guard.h"
#include "modules.h"

namespace limax::host {
namespace {

// Deepest nesting: VoxCad's files have ten levels.
constexpr int deepest = 64;
// Most elements and attributes together: VoxCad's files have some hundred. A Lua table takes fifty
// times the bytes of an empty element.
constexpr int most_elements = 100000;
// Most '<' and most '=': a document with more is refused before its tree is made.
constexpr int most_marks = 4 * most_elements;

// Line of an offset in bytes.
std::size_t line_of(const char* text, std::size_t length, std::ptrdiff_t offset) {
    const auto end = static_cast<std::size_t>(std::max<std::ptrdiff_t>(offset, 0));
    return 1 + static_cast<std::size_t>(std::count(text, text + std::min(length, end), '\n'));
}

bool has_too_many_marks(const char* text, std::size_t length) {
    return std::count(text, text + length, '<') > most_marks ||
           std::count(text, text + length, '=') > most_marks;
}

// Pushes { name, text, attributes, children... }. False, and nothing is pushed, if elements are
// nested too deeply or `left`, the elements and attributes that are still allowed, is used up.
bool push_element(lua_State* L, const pugi::xml_node& element, int level, int& left) {
    if (level > deepest || --left < 0) return false;
    luaL_checkstack(L, 4, "XML");
    lua_newtable(L);
    lua_pushstring(L, element.name());
    lua_setfield(L, -2, "name");
    lua_newtable(L);
    for (const pugi::xml_attribute& attribute : element.attributes()) {
        if (--left < 0) {
            lua_pop(L, 2);
            return false;
        }
        lua_pushstring(L, attribute.value());
        lua_setfield(L, -2, attribute.name());
    }
    lua_setfield(L, -2, "attributes");
    std::string text;
    int count = 0;
    for (const pugi::xml_node& child : element.children()) {
        if (child.type() == pugi::node_element) {
            if (!push_element(L, child, level + 1, left)) {
                lua_pop(L, 1);
                return false;
            }
            lua_rawseti(L, -2, ++count);
        } else {
            text += child.value();
        }
    }
    lua_pushlstring(L, text.data(), text.size());
    lua_setfield(L, -2, "text");
    return true;
}

// xml(text, origin) -> { name, text, attributes, children... } of the root | nil, message
int xml(lua_State* L) {
    std::size_t length = 0;
    const char* const text = luaL_checklstring(L, 1, &length);
    const std::string origin = luaL_optstring(L, 2, "XML");
    const auto refuse_size = [&] {
        return push_failure(L, origin + ": more than " + std::to_string(most_elements) +
                                   " elements and attributes, or nested deeper than " +
                                   std::to_string(deepest));
    };
    if (has_too_many_marks(text, length)) return refuse_size();
    pugi::xml_document document;
    const pugi::xml_parse_result result = document.load_buffer(
        text, length, pugi::parse_default | pugi::parse_doctype, pugi::encoding_utf8);
    if (!result) {
        const std::size_t line = line_of(text, length, result.offset);
        return push_failure(
            L, origin + ": line " + std::to_string(line) + ": not XML: " + result.description());
    }
    for (const pugi::xml_node& child : document.children())
        if (child.type() == pugi::node_doctype)
            return push_failure(L, origin + ": declares a document type, which is refused");
    int left = most_elements;
    if (!push_element(L, document.document_element(), 1, left)) return refuse_size();
    return 1;
}

}  // namespace

void open_xml(lua_State* L) { add_function<xml>(L, "xml"); }

}  // namespace limax::host
