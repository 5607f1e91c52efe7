// signals.h: Ctrl-C. A flag for the engine and for waits, a sticky hook for interpreted Lua, a
// watcher for compiled Lua. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Takes SIGINT for this process. Call on the thread that runs Lua, before any other thread starts.
void install_signals(lua_State* L);
// The Lua state is about to close: an interrupt from here on ends the process at once.
void release_signals();
// All that the process was to do is done and written: an interrupt only hurries its end, which has
// this status. After release_signals.
void settle_status(int status);

// Whether Ctrl-C came in and was not acknowledged. `true` also tells the watcher that somebody has
// noticed.
bool interrupted();
// Ends the interrupt: clears hook and flags, so that clean-up can run. A second Ctrl-C still ends
// the process at once.
void acknowledge_interrupt();

// Whether Ctrl-C came in since the last rearm, acknowledged or not.
bool was_interrupted();

// Sets a hook of Lua, or takes it away (nullptr), unless an interrupt is pending, whose own hook
// stays.
void set_hook(lua_State* L, lua_Hook hook, int mask, int count);

// Pushes the one value that an interrupt raises.
void push_interrupt(lua_State* L);
// Raises it. Only where no C++ exception is being handled.
int raise_interrupt(lua_State* L);

// Adds interrupt, interrupted, raise_if_interrupted and signal to the host table on top of the
// stack.
void open_signals(lua_State* L);

}  // namespace limax::host
