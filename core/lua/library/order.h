// Orders and names that are the same in every process.
#pragma once

#include "core/lua/library/library.h"

namespace sim {

// Puts next, pairs, tostring and string.format in the place of Lua's, which show the addresses of
// objects and the order of a hash table. Called when all other functions are in their places.
void order_library(lua_State* L);

// Pushes a value as text, as luaL_tolstring, but an object without a text of its own as "table:
// 12", after the number of objects that were made before it.
const char* push_text(lua_State* L, int index, std::size_t* size = nullptr);

}  // namespace sim
