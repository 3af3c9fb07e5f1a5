// A Lua state with a budget, entered only through protect().
#pragma once

#include <locale.h>

#include <lua.hpp>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "core/base/error.h"
#include "core/lua/lua_budget.h"
#include "core/lua/watchdog.h"
#include "core/plugin/params.h"

namespace sim {

// The source name of the scene language itself; errors are placed at the frames that called it.
inline constexpr const char* kLanguageSource = "=sim";
// The reason of an error raised when Lua was stopped from outside.
inline constexpr const char* kInterrupted = "interrupted";

class LuaState {
 public:
  // `interrupted`, if any, is asked every thousand instructions; a yes ends what runs with the
  // error "interrupted". `overrun`, if any, is called where the budget cannot stop Lua.
  explicit LuaState(const LuaLimits& limits, std::function<bool()> interrupted = {},
                    LuaOverrun overrun = nullptr);
  ~LuaState();
  LuaState(const LuaState&) = delete;
  LuaState& operator=(const LuaState&) = delete;

  // Calls body(lua_State*) on an empty stack in Lua's protected mode, one thread at a time. A Lua
  // error becomes Error{kScene} at the line it came from, or at `place` when no line is known; what
  // the body throws passes through; so does the end of the budget. Not to be nested.
  template <class Body>
  void protect(const SourceLocation& place, Body body) {
    run(
        place, [](void* data, lua_State* L) { (*static_cast<Body*>(data))(L); }, &body);
  }

  void release(int reference);  // of luaL_ref
  LuaBudget& budget() { return budget_; }

 private:
  struct Caught {
    ErrorKind kind;
    ErrorText text;
  };

  static int handle_message(lua_State* L);
  void run(const SourceLocation& place, void (*body)(void*, lua_State*), void* data);

  // C's own locale.
  struct FreeLocale {
    void operator()(locale_t locale) const { freelocale(locale); }
  };
  using Locale = std::unique_ptr<std::remove_pointer_t<locale_t>, FreeLocale>;

  LuaBudget budget_;
  Locale locale_;
  std::optional<Caught> caught_;
  std::recursive_mutex mutex_;  // functions may be released inside protect()
  lua_State* lua_ = nullptr;
  std::optional<Watchdog> watchdog_;
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
  } catch (const std::bad_alloc&) {
    raise(L, ErrorKind::kIo,
          {"out of memory", "", "the system has no more for this", "make the scene smaller"});
  } catch (const std::exception& error) {
    raise(L, ErrorKind::kInternal, {"internal error", "", error.what(), ""});
  }
}

// Pushes the text as a function and is true, or else the message of the error. Never accepts
// bytecode. Raises an error of Lua when the budget ends meanwhile.
bool load_chunk(lua_State* L, std::string_view text, const std::string& chunk);

// "@scenes/cloth.lua" and 12 as "scenes/cloth.lua:12".
SourceLocation lua_place(const char* source, int line);

// Lua puts "short_src:LINE: " before most messages: LINE, and the rest of the message.
std::optional<std::pair<int, std::string_view>> strip_place(std::string_view message,
                                                            const char* short_source);

// Line ends and tabs as spaces, long text cut, visible_line of the rest: for one line of an error.
std::string one_line_text(std::string_view text);

}  // namespace sim
