// Lua values to plain data and back.
#pragma once

#include "core/lua/data.h"
#include "core/lua/lua_state.h"

namespace sim {

// The value at `index`; tables cut after `most` entries each. Functions become DataFunction when
// `functions` is given (it makes the reference), words otherwise. Tables with __tostring become
// what that says, cycles and what is nested too deeply words. May raise Lua errors.
Data to_data(lua_State* L, int index, std::size_t most,
             DataFunction (*functions)(lua_State* L, int index) = nullptr);

// Pushes the value; words become text.
void push_data(lua_State* L, const Data& data);

// A chunk of a prompt is named FILE:LINE after where it begins, so that Lua's own FILE:LINE in it
// is FILE:BEGIN:LINE. This makes FILE:LINE of it again, and leaves other places as they are.
SourceLocation chunk_place(const SourceLocation& place);

}  // namespace sim
