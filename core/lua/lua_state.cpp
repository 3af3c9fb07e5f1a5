#include "core/lua/lua_state.h"

#include <locale.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>

#include "core/base/utf8.h"

namespace sim {
namespace {

constexpr const char* kErrorType = "sim.error";
constexpr const char* kMemoryRemedy = "use sim.grid for large regular scenes";
constexpr const char* kFields[] = {"what", "where", "why", "remedy"};

std::string raw_text(lua_State* L, int table, const char* key) {
  lua_pushstring(L, key);
  lua_rawget(L, table);
  std::string text = lua_type(L, -1) == LUA_TSTRING ? lua_tostring(L, -1) : "";
  lua_pop(L, 1);
  return text;
}

bool is_error_table(lua_State* L, int index) {
  if (!lua_istable(L, index) || !lua_getmetatable(L, index)) return false;
  luaL_getmetatable(L, kErrorType);
  const bool same = lua_rawequal(L, -1, -2);
  lua_pop(L, 2);
  return same;
}

// A caught sim.error prints like the message it would have become.
int error_to_string(lua_State* L) {
  std::string line;
  for (const char* field : kFields) {
    const std::string text = raw_text(L, 1, field);
    if (!text.empty()) line += (line.empty() ? "" : ": ") + text;
  }
  lua_pushlstring(L, line.data(), line.size());
  return 1;
}

// The location of a text error: the line it names itself, else the innermost line of a scene. An
// error that crossed a coroutine names one line for each side.
ErrorText locate(lua_State* L, std::string_view message) {
  ErrorText text{"Lua error", "", "", ""};
  lua_Debug frame;
  for (int level = 0; level < 200 && lua_getstack(L, level, &frame); ++level) {
    lua_getinfo(L, "Sl", &frame);
    if (frame.currentline <= 0) continue;
    const bool scene = std::strcmp(frame.source, kLanguageSource) != 0;
    if (scene && text.where.empty()) text.where = lua_place(frame.source, frame.currentline);
    bool named = false;
    while (const auto stripped = strip_place(message, frame.short_src)) {
      message = stripped->second;
      if (scene) text.where = lua_place(frame.source, stripped->first);
      named = scene;
    }
    if (named) break;
  }
  text.why = one_line_text(message);
  if (text.why == "not enough memory") {
    text.what = "out of memory";
    text.remedy = kMemoryRemedy;
  }
  for (const char* missing : {"os", "io", "debug", "package", "load", "dofile", "loadfile"})
    if (text.why.find("(global '" + std::string(missing) + "')") != std::string::npos)
      text.remedy = "a scene has no os, io, debug, package, load, dofile and loadfile";
  return text;
}

}  // namespace

SourceLocation lua_place(const char* source, int line) {
  const std::string file = *source == '@' || *source == '=' ? source + 1 : source;
  return line > 0 ? file + ":" + std::to_string(line) : file;
}

// The compiler gets the text in pieces: no piece takes long.
bool load_chunk(lua_State* L, std::string_view text, const std::string& chunk) {
  constexpr std::size_t kPiece = 4096;
  const auto next = [](lua_State* state, void* data, std::size_t* size) -> const char* {
    std::string_view& rest = *static_cast<std::string_view*>(data);
    const std::string_view piece = rest.substr(0, kPiece);
    LuaBudget::of(state).charge(state, piece.size());
    rest.remove_prefix(piece.size());
    *size = piece.size();
    return piece.data();
  };
  const int status = lua_load(L, next, &text, chunk.c_str(), "t");
  LuaBudget::of(L).check(L);
  return status == LUA_OK;
}

std::string one_line_text(std::string_view text) {
  constexpr std::size_t kLongest = 2000;
  std::string line(utf8_head(text, kLongest));
  for (char& c : line)
    if (c == '\n' || c == '\t' || c == '\r') c = ' ';
  line = visible_line(line);
  return text.size() > kLongest ? line + "..." : line;
}

std::optional<std::pair<int, std::string_view>> strip_place(std::string_view message,
                                                            const char* short_source) {
  if (!message.starts_with(short_source)) return {};
  message.remove_prefix(std::strlen(short_source));
  if (!message.starts_with(':')) return {};
  message.remove_prefix(1);
  int line = 0;
  std::size_t digits = 0;
  while (digits < message.size() && digits < 9 && message[digits] >= '0' && message[digits] <= '9')
    line = 10 * line + (message[digits++] - '0');
  message.remove_prefix(digits);
  if (digits == 0 || !message.starts_with(": ")) return {};
  return std::pair{line, message.substr(2)};
}

void raise(lua_State* L, ErrorKind kind, const ErrorText& text) {
  luaL_checkstack(L, 6, "error");
  lua_createtable(L, 0, 5);
  const std::string* parts[] = {&text.what, &text.where, &text.why, &text.remedy};
  for (int i = 0; i < 4; ++i) {
    lua_pushlstring(L, parts[i]->data(), parts[i]->size());
    lua_setfield(L, -2, kFields[i]);
  }
  lua_pushinteger(L, static_cast<int>(kind));
  lua_setfield(L, -2, "kind");
  luaL_setmetatable(L, kErrorType);
  lua_error(L);
  std::abort();  // lua_error does not return
}

LuaState::LuaState(const LuaLimits& limits, std::function<bool()> interrupted, LuaOverrun overrun)
    : budget_(limits, std::move(interrupted)), locale_(newlocale(LC_ALL_MASK, "C", nullptr)) {
  if (!locale_) throw std::bad_alloc();
  lua_ = lua_newstate(LuaBudget::allocate, &budget_);
  if (!lua_) throw std::bad_alloc();
  *static_cast<LuaState**>(lua_getextraspace(lua_)) = this;
  protect({}, [this](lua_State* L) {
    budget_.measure_userdata(L);
    luaL_newmetatable(L, kErrorType);
    lua_pushcfunction(L, error_to_string);
    lua_setfield(L, -2, "__tostring");
    lua_pushstring(L, kErrorType);
    lua_setfield(L, -2, "__metatable");
  });
  if (overrun) watchdog_.emplace(budget_, overrun);
}

LuaState::~LuaState() {
  watchdog_.reset();
  lua_close(lua_);
}

void LuaState::release(int reference) {
  const std::lock_guard lock(mutex_);
  luaL_unref(lua_, LUA_REGISTRYINDEX, reference);
}

// Runs where the error is raised, while the stack can still be read.
int LuaState::handle_message(lua_State* L) {
  LuaState& self = **static_cast<LuaState**>(lua_getextraspace(L));
  if (self.budget_.ended() != LuaBudget::End::kNone) return 1;
  Caught caught{ErrorKind::kScene, {}};
  if (lua_type(L, 1) == LUA_TSTRING) {
    std::size_t size = 0;
    const char* message = lua_tolstring(L, 1, &size);
    caught.text = locate(L, {message, size});
  } else if (is_error_table(L, 1)) {
    caught.text = {raw_text(L, 1, kFields[0]), raw_text(L, 1, kFields[1]),
                   raw_text(L, 1, kFields[2]), raw_text(L, 1, kFields[3])};
    lua_pushstring(L, "kind");
    lua_rawget(L, 1);
    // The scene may have caught it, changed it and raised it again.
    for (std::string* part :
         {&caught.text.what, &caught.text.where, &caught.text.why, &caught.text.remedy})
      *part = one_line_text(*part);
    if (const lua_Integer kind = lua_tointeger(L, -1);
        kind >= static_cast<int>(ErrorKind::kInternal) &&
        kind <= static_cast<int>(ErrorKind::kCheck))
      caught.kind = static_cast<ErrorKind>(kind);
  } else {
    caught.text = locate(L, std::string("error object is a ") + luaL_typename(L, 1) + " value");
  }
  self.caught_ = std::move(caught);
  lua_settop(L, 1);
  return 1;
}

namespace {

// Numbers are read and written, and texts compared, as in C's own locale, whatever that of the
// program is.
class PlainLocale {
 public:
  explicit PlainLocale(locale_t plain) : before_(uselocale(plain)) {}
  ~PlainLocale() { uselocale(before_); }
  PlainLocale(const PlainLocale&) = delete;
  PlainLocale& operator=(const PlainLocale&) = delete;

 private:
  locale_t before_;
};

}  // namespace

void LuaState::run(const SourceLocation& place, void (*body)(void*, lua_State*), void* data) {
  struct Call {
    void (*body)(void*, lua_State*);
    void* data;
    std::exception_ptr error;
  } call{body, data, nullptr};
  const auto enter = [](lua_State* L) {
    Call& inner = *static_cast<Call*>(lua_touserdata(L, 1));
    lua_settop(L, 0);
    luaL_checkstack(L, 100, "reading a scene");
    try {
      inner.body(inner.data, L);
    } catch (const std::exception&) {
      inner.error = std::current_exception();
    }
    return 0;
  };

  const std::lock_guard lock(mutex_);
  const PlainLocale plain(locale_.get());
  caught_.reset();
  budget_.begin(lua_);
  // Not empty inside a function that Lua has called, as at the prompt.
  const int top = lua_gettop(lua_);
  lua_pushcfunction(lua_, handle_message);
  lua_pushcfunction(lua_, enter);
  lua_pushlightuserdata(lua_, &call);
  const bool used_up = budget_.ended() != LuaBudget::End::kNone;  // by earlier calls
  const int status = used_up ? LUA_ERRRUN : lua_pcall(lua_, 1, 0, top + 1);
  lua_settop(lua_, top);
  budget_.end();

  if (budget_.ended() != LuaBudget::End::kNone)
    throw Error(ErrorKind::kScene, budget_.error(place));
  if (call.error) std::rethrow_exception(call.error);
  if (status == LUA_OK) return;
  if (status == LUA_ERRRUN && caught_) {
    if (caught_->text.where.empty() && caught_->kind == ErrorKind::kScene)
      caught_->text.where = place;
    throw Error(caught_->kind, caught_->text);
  }
  if (status == LUA_ERRERR)
    throw Error(ErrorKind::kScene,
                {"Lua error", place, "the stack overflowed while an error was handled",
                 "look for a function that calls itself without end"});
  throw Error(ErrorKind::kScene, budget_.memory_error(place));
}

}  // namespace sim
