// xml.cpp: XML text to Lua tables through pugixml, which expands no entities of the document and
// reads no other file. Document types are refused: no supported format needs one.
#include <algorithm>
#include <pugixml.hpp>
#include <string>
#include <string_view>

#include "guard.h"
#include "modules.h"

namespace limax::host {
namespace {

// Deepest nesting: VoxCad's files have ten levels.
constexpr int deepest = 64;
// Most '<' and most '=', counted before the tree is made, which bounds the elements and attributes:
// VoxCad's files have some hundred. A Lua table takes fifty times the bytes of an empty element.
constexpr int most_marks = 200000;

[[noreturn]] void refuse(const std::string& origin, const std::string& what) {
    throw failure(origin + ": " + what);
}

[[noreturn]] void refuse_size(const std::string& origin) {
    refuse(origin, "too large: at most " + std::to_string(most_marks) + " of '<' and of '=', and " +
                       std::to_string(deepest) + " levels are read");
}

// Pushes { name, text, attributes, children... }.
void push_element(lua_State* L, const pugi::xml_node& element, const std::string& origin,
                  int level) {
    if (level > deepest) refuse_size(origin);
    luaL_checkstack(L, 4, "XML");
    lua_newtable(L);
    set(L, "name", element.name());
    lua_newtable(L);
    for (const pugi::xml_attribute& attribute : element.attributes())
        set(L, attribute.name(), attribute.value());
    lua_setfield(L, -2, "attributes");
    std::string text;
    int count = 0;
    for (const pugi::xml_node& child : element.children()) {
        if (child.type() == pugi::node_element) {
            push_element(L, child, origin, level + 1);
            lua_rawseti(L, -2, ++count);
        } else {
            text += child.value();
        }
    }
    set(L, "text", text);
}

int xml(lua_State* L) {
    const std::string_view text = text_argument(L, 1);
    const std::string origin = luaL_optstring(L, 2, "XML");
    for (const char mark : {'<', '='})
        if (std::count(text.begin(), text.end(), mark) > most_marks) refuse_size(origin);
    pugi::xml_document document;
    const pugi::xml_parse_result result = document.load_buffer(
        text.data(), text.size(), pugi::parse_default | pugi::parse_doctype, pugi::encoding_utf8);
    if (!result) {
        const std::string_view before = text.substr(0, static_cast<std::size_t>(result.offset));
        const auto lines = std::count(before.begin(), before.end(), '\n');
        refuse(origin, "line " + std::to_string(1 + lines) + ": not XML: " + result.description());
    }
    if (document.find_child(
            [](pugi::xml_node child) { return child.type() == pugi::node_doctype; }))
        refuse(origin, "declares a document type, which is refused");
    push_element(L, document.document_element(), origin, 1);
    return 1;
}

}  // namespace

void open_xml(lua_State* L) { add_function<xml>(L, "xml"); }

}  // namespace limax::host
