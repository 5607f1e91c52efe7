// signals.h: Ctrl-C and SIGTERM: a flag for the engine and for waits, a hook for interpreted Lua,
// an alarm for compiled Lua. Includes Lua only.
#pragma once

#include <lua.hpp>

namespace limax::host {

// Installs the handlers. Call on the thread that runs Lua.
void install_signals(lua_State* L);
// Call before the Lua state closes: from here on an interrupt ends the process at once.
void release_signals();
// Sets the exit status of a process that is interrupted after all its work is done. After
// release_signals.
void settle_status(int status);

// The shell's exit status of the signal that came last: 130 after Ctrl-C, 143 after SIGTERM.
int interrupt_status();

// Whether Ctrl-C came and was not acknowledged.
bool interrupted();
// Clears hook and flags, so that clean-up can run. A second Ctrl-C still ends the process at once.
void acknowledge_interrupt();

// Whether Ctrl-C came since the last rearm, acknowledged or not.
bool was_interrupted();

// Sets or removes (nullptr) a Lua hook, unless an interrupt is pending, whose hook stays.
void set_hook(lua_State* L, lua_Hook hook, int mask, int count);

// Pushes the error value of an interrupt.
void push_interrupt(lua_State* L);
// Raises it. Only where no C++ exception is being handled.
int raise_interrupt(lua_State* L);

// Adds interrupt, raise_if_interrupted and signal to the host table on top of the stack.
void open_signals(lua_State* L);

}  // namespace limax::host
