// A Lua state with a memory limit, entered only through protect().
#pragma once

#include <lua.hpp>

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/error.h"
#include "core/plugin/params.h"

namespace sim {

// The source name of the scene language itself; errors are placed at the frames that called it.
inline constexpr const char* kLanguageSource = "=sim";
// Why an error was raised when Lua was stopped from outside.
inline constexpr const char* kInterrupted = "interrupted";

class LuaState {
 public:
  // memory_limit in bytes, at most half the machine's. `interrupted`, if any, is asked every
  // thousand instructions; a yes ends what runs with the error "interrupted".
  explicit LuaState(std::size_t memory_limit, bool (*interrupted)() = nullptr);
  ~LuaState();
  LuaState(const LuaState&) = delete;
  LuaState& operator=(const LuaState&) = delete;

  // Calls body(lua_State*) on an empty stack in Lua's protected mode, one thread at a time. A Lua
  // error becomes Error{kScene} at the line it came from, or at `place` when no line is known; what
  // the body throws passes through. Not to be nested.
  template <class Body>
  void protect(const Place& place, Body body) {
    run(
        place, [](void* data, lua_State* L) { (*static_cast<Body*>(data))(L); }, &body);
  }

  void release(int reference);  // of luaL_ref

 private:
  struct Caught {
    ErrorKind kind;
    ErrorText text;
  };
  struct Memory {
    std::size_t used = 0, limit = 0;  // bytes
  };

  static void* allocate(void* memory, void* block, std::size_t old_size, std::size_t new_size);
  static int handle_message(lua_State* L);
  static void check_interrupt(lua_State* L, lua_Debug* event);
  void run(const Place& place, void (*body)(void*, lua_State*), void* data);

  Memory memory_;
  bool (*interrupted_)();
  std::optional<Caught> caught_;
  std::recursive_mutex mutex_;  // functions may be released inside protect()
  lua_State* lua_ = nullptr;
};

// Raises a Lua error that protect() turns into Error{kind, text}.
[[noreturn]] void raise(lua_State* L, ErrorKind kind, const ErrorText& text);

// Wraps a function for Lua so that its C++ exceptions become Lua errors.
template <int (*kFunction)(lua_State*)>
int guarded(lua_State* L) {
  try {
    return kFunction(L);
  } catch (const Error& error) {
    raise(L, error.kind(), error.text());
  } catch (const std::exception& error) {
    raise(L, ErrorKind::kInternal, {"internal error", "", error.what(), ""});
  }
}

// "@scenes/cloth.lua" and 12 as "scenes/cloth.lua:12".
Place lua_place(const char* source, int line);

// Lua puts "short_src:LINE: " before most messages: LINE, and the rest of the message.
std::optional<std::pair<int, std::string_view>> strip_place(std::string_view message,
                                                            const char* short_source);

// Control characters as spaces, long text cut: fit for one line of an error.
std::string one_line_text(std::string_view text);

}  // namespace sim
