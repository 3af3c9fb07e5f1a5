#include "core/lua/prompt/prompt.h"

#include <algorithm>
#include <cctype>
#include <deque>
#include <exception>
#include <optional>
#include <set>

#include "core/base/text.h"
#include "core/base/utf8.h"
#include "core/lua/lua_keywords.h"
#include "core/lua/lua_read.h"
#include "core/lua/prompt/lua_data.h"
#include "core/lua/scene/session.h"

namespace sim {
namespace {

// Each chunk may print as much.
struct FinishPrinting {
  Printer& printer;
  ~FinishPrinting() {
    try {
      printer.finish();
    } catch (const std::exception&) {  // the reader of a pipe has gone, as the chunk was told
    }
  }
};

std::string chunk_name(const std::string& where, int line) {
  return "=" + where + ":" + std::to_string(line);
}

// Lua's message for a text that is correct as far as it goes.
bool ends_too_early(lua_State* L) {
  const std::string_view message(lua_tostring(L, -1), lua_rawlen(L, -1));
  return message.ends_with("<eof>");
}

}  // namespace

struct Prompt::Impl {
  std::shared_ptr<SceneSession> session;
  std::deque<Host> hosts;
  std::vector<std::string> names;
  lua_State* inside = nullptr;  // while a host function runs
  std::exception_ptr pending;   // thrown by one, not an Error
  int sim = LUA_NOREF, language = LUA_NOREF;

  static Impl& of(lua_State* L) {
    return *static_cast<Impl*>(lua_touserdata(L, lua_upvalueindex(1)));
  }
  static int call_host(lua_State* L);
  static int print_line(lua_State* L);
  static int index_sim(lua_State* L);
  static DataFunction reference(lua_State* L, int index);
  void open(lua_State* L);
  int push_of_language(lua_State* L, const std::string& name) const;
  static void push_both(lua_State* L);
  void load_chunk(lua_State* L, const std::string& chunk, const std::string& name);

  // Lua, entered from outside or from a host function.
  template <class Body>
  void enter(const SourceLocation& place, Body body) {
    if (inside) {
      session->lua().budget().fresh();
      StackScope::require_room(inside);
      return body(inside);
    }
    pending = nullptr;
    try {
      session->lua().protect(place, body);
    } catch (const Error& error) {
      if (pending) std::rethrow_exception(std::exchange(pending, nullptr));
      ErrorText text = error.text();
      text.where = chunk_place(text.where);
      throw Error(error.kind(), text);
    }
    if (pending) std::rethrow_exception(std::exchange(pending, nullptr));
  }
};

// Upvalues: the prompt, the host function.
int Prompt::Impl::call_host(lua_State* L) {
  Impl& self = of(L);
  const Host& host = *static_cast<const Host*>(lua_touserdata(L, lua_upvalueindex(2)));
  std::vector<Data> arguments;
  for (int i = 1; i <= lua_gettop(L); ++i)
    arguments.push_back(to_data(L, i, static_cast<std::size_t>(-1), &Impl::reference));
  struct Inside {
    lua_State*& slot;
    lua_State* before;
    ~Inside() { slot = before; }
  };
  std::optional<ErrorText> failed;
  ErrorKind kind = ErrorKind::kInternal;
  Data result;
  {
    const Inside inside{self.inside, std::exchange(self.inside, L)};
    const LuaBudget::Aside aside(self.session->lua().budget());
    try {
      result = host(arguments);
    } catch (const Error& error) {
      kind = error.kind();
      failed = error.text();
    } catch (const std::exception&) {
      self.pending = std::current_exception();
      failed = ErrorText{"stopped", "", "", ""};
    }
  }
  self.session->lua().budget().check(L);
  if (failed) {
    const SourceLocation caller = chunk_place(calling_place(L));
    failed->where = failed->where.empty() ? caller : caller + ": " + failed->where;
    raise(L, kind, *failed);
  }
  if (result.nil()) return 0;
  push_data(L, result);
  return 1;
}

// An exception of the writer ends all Lua that runs.
int Prompt::Impl::print_line(lua_State* L) {
  Impl& self = of(L);
  try {
    self.session->printer().print(L);
    return 0;
  } catch (const std::exception&) {
    self.pending = std::current_exception();
  }
  return luaL_error(L, "stopped");
}

// Keys missing in the prompt's table `sim` are looked up in the scene language.
int Prompt::Impl::index_sim(lua_State* L) {
  Impl& self = of(L);
  lua_settop(L, 2);
  lua_rawgeti(L, LUA_REGISTRYINDEX, self.language);
  lua_pushvalue(L, 2);
  const auto get = [](lua_State* state) {
    lua_gettable(state, 1);
    return 1;
  };
  lua_pushcfunction(L, get);
  lua_insert(L, 3);
  if (lua_pcall(L, 2, 1, 0) == LUA_OK) return 1;
  const std::string name = lua_type(L, 2) == LUA_TSTRING ? lua_tostring(L, 2) : "";
  const std::string near = nearest(name, self.names);
  if (near.empty()) return lua_error(L);
  raise(L, ErrorKind::kScene,
        {"unknown name 'sim." + one_line_text(name) + "'", calling_place(L),
         "neither the scene language nor the prompt has it", "did you mean 'sim." + near + "'?"});
}

// The type of that name in the language; pushes it if it is a table.
int Prompt::Impl::push_of_language(lua_State* L, const std::string& name) const {
  lua_pushcfunction(L, [](lua_State* state) {
    lua_gettable(state, 1);
    return 1;
  });
  lua_rawgeti(L, LUA_REGISTRYINDEX, language);
  lua_pushstring(L, name.c_str());
  const int type = lua_pcall(L, 2, 1, 0) == LUA_OK ? lua_type(L, -1) : LUA_TNIL;
  if (type != LUA_TTABLE) lua_pop(L, 1);
  return type;
}

// Makes one table that behaves like the function when called and like the table when indexed.
void Prompt::Impl::push_both(lua_State* L) {
  lua_newtable(L);
  lua_newtable(L);
  lua_rotate(L, -4, 2);  // the new tables come first: table, metatable, function, language
  lua_setfield(L, -3, "__index");
  lua_pushcclosure(
      L,
      [](lua_State* state) {  // without the table that is called
        lua_pushvalue(state, lua_upvalueindex(1));
        lua_replace(state, 1);
        lua_call(state, lua_gettop(state) - 1, LUA_MULTRET);
        return lua_gettop(state);
      },
      1);
  lua_setfield(L, -2, "__call");
  lua_setmetatable(L, -2);
}

DataFunction Prompt::Impl::reference(lua_State* L, int index) {
  lua_getfield(L, LUA_REGISTRYINDEX, "sim.prompt");
  const std::weak_ptr<SceneSession> session = static_cast<Impl*>(lua_touserdata(L, -1))->session;
  lua_pop(L, 1);
  lua_pushvalue(L, index);
  const int id = luaL_ref(L, LUA_REGISTRYINDEX);
  return {{new int(id), [session](const int* held) {
             if (const auto alive = session.lock()) alive->lua().release(*held);
             delete held;
           }}};
}

void Prompt::Impl::open(lua_State* L) {
  session->open(L);
  lua_pushlightuserdata(L, this);
  lua_setfield(L, LUA_REGISTRYINDEX, "sim.prompt");
  SceneSession::push_language(L);
  language = luaL_ref(L, LUA_REGISTRYINDEX);

  lua_pushlightuserdata(L, this);
  lua_pushcclosure(L, print_line, 1);
  lua_setglobal(L, "print");

  lua_newtable(L);  // sim
  lua_newtable(L);  // its metatable
  lua_pushlightuserdata(L, this);
  lua_pushcclosure(L, guarded<index_sim>, 1);
  lua_setfield(L, -2, "__index");
  lua_pushliteral(L, "sim");
  lua_setfield(L, -2, "__metatable");
  lua_setmetatable(L, -2);
  lua_pushvalue(L, -1);
  sim = luaL_ref(L, LUA_REGISTRYINDEX);
  lua_pushvalue(L, -1);
  lua_setglobal(L, "sim");
  SceneSession::set_language(L);
}

void Prompt::Impl::load_chunk(lua_State* L, const std::string& chunk, const std::string& name) {
  if (sim::load_chunk(L, "return " + chunk, name)) return;
  lua_pop(L, 1);
  if (sim::load_chunk(L, chunk, name)) return;
  if (lua_type(L, -1) != LUA_TSTRING) lua_error(L);
  const std::string message(lua_tostring(L, -1), lua_rawlen(L, -1));
  lua_Debug info;  // of a function of the same name, for the short form of it in the message
  luaL_loadbufferx(L, "", 0, name.c_str(), "t");
  lua_getinfo(L, ">S", &info);
  ErrorText text{"Lua syntax error", name.substr(1), one_line_text(message), ""};
  if (const auto stripped = strip_place(message, info.short_src)) {
    text.where = lua_place(name.c_str(), stripped->first);
    text.why = one_line_text(stripped->second);
  }
  throw Error(ErrorKind::kScene, text);
}

Prompt::Prompt(SceneOptions options, Registry& registry,
               std::function<void(const std::string&)> print)
    : impl_(std::make_unique<Impl>()) {
  options.print = std::move(print);
  options.limits.seconds_in_all = options.limits.steps_in_all = false;  // they are of each line
  impl_->session = std::make_shared<SceneSession>("prompt", std::move(options), registry);
  impl_->enter({}, [&](lua_State* L) { impl_->open(L); });
}

Prompt::~Prompt() = default;

// A name that the scene language has too stands for both: sim.integrator("rk4") calls the host,
// sim.integrator.rk4 {} is of the language.
void Prompt::define(const std::string& name, Host host) {
  Impl& self = *impl_;
  self.hosts.push_back(std::move(host));
  self.names.push_back(name);
  self.enter({}, [&](lua_State* L) {
    lua_rawgeti(L, LUA_REGISTRYINDEX, self.sim);
    lua_pushstring(L, name.c_str());
    lua_pushlightuserdata(L, &self);
    lua_pushlightuserdata(L, &self.hosts.back());
    lua_pushcclosure(L, Impl::call_host, 2);
    lua_pushvalue(L, -1);
    lua_setglobal(L, name.c_str());
    // A function of the language keeps its name there: particles() counts, sim.particles makes.
    const int type = self.push_of_language(L, name);
    if (type == LUA_TTABLE) self.push_both(L);
    if (type == LUA_TFUNCTION)
      lua_pop(L, 2);
    else
      lua_rawset(L, -3);
    lua_pop(L, 1);
  });
}

bool Prompt::is_complete(const std::string& chunk) {
  bool complete = true;
  impl_->enter({}, [&](lua_State* L) {
    for (const char* prefix : {"return ", ""}) {
      // The newline keeps an open "text" from looking like one that goes on.
      if (load_chunk(L, prefix + chunk + "\n", "=prompt")) {
        complete = true;
        return;
      }
      complete = complete && !ends_too_early(L);
      lua_pop(L, 1);
    }
  });
  return complete;
}

std::vector<Data> Prompt::run(const std::string& chunk, const std::string& where, int line,
                              std::size_t most) {
  std::vector<Data> values;
  const std::string name = chunk_name(where, line);
  const FinishPrinting finish{impl_->session->printer()};
  impl_->enter(name.substr(1), [&](lua_State* L) {
    const int base = lua_gettop(L);
    impl_->load_chunk(L, chunk, name);
    lua_call(L, 0, LUA_MULTRET);
    StackScope::require_room(L);  // a call that returned many values left none
    const int end = lua_gettop(L);
    if (end > base) {
      lua_pushvalue(L, base + 1);
      lua_setglobal(L, "_");
    }
    for (int i = base + 1; i <= end; ++i) values.push_back(to_data(L, i, most));
    lua_settop(L, base);
  });
  return values;
}

DataFunction Prompt::compile(const std::string& expression, const std::string& where, int line) {
  DataFunction function;
  const std::string name = chunk_name(where, line);
  impl_->enter(name.substr(1), [&](lua_State* L) {
    impl_->load_chunk(L, expression, name);
    function = Impl::reference(L, -1);
    lua_pop(L, 1);
  });
  return function;
}

Data Prompt::call(const DataFunction& function) {
  Data result;
  impl_->enter({}, [&](lua_State* L) {
    lua_rawgeti(L, LUA_REGISTRYINDEX, *function.reference);
    lua_call(L, 0, 1);
    result = to_data(L, -1, static_cast<std::size_t>(-1));
    lua_pop(L, 1);
  });
  return result;
}

std::vector<std::string> Prompt::completions(const std::string& path) {
  const std::size_t dot = path.find_last_of(".:");
  const std::size_t last = dot == std::string::npos ? 0 : dot + 1;
  const std::string stem = path.substr(last);
  std::set<std::string> found;
  impl_->enter({}, [&](lua_State* L) {
    lua_pushglobaltable(L);
    for (std::size_t begin = 0; begin < last;) {
      const std::size_t end = path.find_first_of(".:", begin);
      if (!lua_istable(L, -1)) return;
      lua_pushlstring(L, path.data() + begin, end - begin);
      lua_rawget(L, -2);
      begin = end + 1;
    }
    // Methods stand in the metatable's __index.
    for (int depth = 0; depth < 4 && (lua_istable(L, -1) || depth == 0); ++depth) {
      if (lua_istable(L, -1))
        for (lua_pushnil(L); lua_next(L, -2); lua_pop(L, 1))
          if (lua_type(L, -2) == LUA_TSTRING)
            found.insert(lua_tostring(L, -2) + std::string(lua_isfunction(L, -1) ? "(" : ""));
      if (!lua_getmetatable(L, -1)) break;
      lua_pushliteral(L, "__index");
      lua_rawget(L, -2);
    }
  });
  if (last == 0) found.insert(std::begin(kLuaKeywords), std::end(kLuaKeywords));
  std::vector<std::string> names;
  for (const std::string& name : found)
    if (name.starts_with(stem) && !name.starts_with("__") && is_visible(name))
      names.push_back(path.substr(0, last) + name);
  return names;
}

}  // namespace sim
