// stack_room.h: whether a Lua stack has room for the hook that limits a function. Includes Lua
// only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// LuaJIT calls no hook on a stack that is almost full, so that a recursion which catches its own
// overflow (`function f() pcall(f) return f() end`) would stay there unseen. A hook that asks here
// every few dozen instructions sees it before.
class stack_room {
public:
    // May raise "stack overflow" in the place of saying no, as LuaJIT 2.1.0-beta3 does; the next
    // call says no then.
    bool is_there(lua_State* L) {
        if (gone_) return false;
        gone_ = true;
        if (lua_checkstack(L, slots) == 0) return false;
        gone_ = false;
        return true;
    }
    bool is_gone() const { return gone_; }

private:
    // Of 65500: more than a hundred instructions take, short of calls with thousands of arguments.
    static constexpr int slots = 7900;
    bool gone_ = false;
};

}  // namespace limax::host
