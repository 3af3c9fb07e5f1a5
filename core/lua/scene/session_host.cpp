// Services of the kernel for the scene language: source locations, errors and parameters.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>

#include "core/base/text.h"
#include "core/lua/lua_read.h"
#include "core/lua/scene/sandbox.h"
#include "core/lua/scene/session.h"

namespace sim {
namespace {

constexpr lua_Integer kLineBits = 32;
constexpr std::size_t kMostArgs = 1000;

std::string type_of(const Value& value) {
  if (std::holds_alternative<bool>(value)) return "true or false";
  return std::holds_alternative<double>(value) ? "a number" : "text";
}

// Values of sim.arg hold no function, so their text tells them apart.
bool same_value(const Value& a, const Value& b) {
  return a.index() == b.index() && to_text(a) == to_text(b);
}

// "scenes/cloth.lua" of "scenes/cloth.lua:12".
std::string file_of(const SourceLocation& place) {
  const std::size_t colon = place.rfind(':');
  return colon == std::string::npos ? place : place.substr(0, colon);
}

bool legal_arg_name(std::string_view name) {
  constexpr std::string_view kLegal =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_";
  return !name.empty() && name.size() <= 64 && !(name[0] >= '0' && name[0] <= '9') &&
         name.find_first_not_of(kLegal) == std::string_view::npos;
}

}  // namespace

lua_Integer SceneSession::place_code(const char* source, int line) {
  std::size_t index = sources_.size();
  while (index > 0 && sources_[index - 1] != source) --index;
  if (index == 0) {
    sources_.emplace_back(source);
    index = sources_.size();
  }
  return static_cast<lua_Integer>(index) << kLineBits | line;
}

SourceLocation SceneSession::place(lua_Integer code) const {
  const auto index = static_cast<std::size_t>(code >> kLineBits);
  if (index == 0 || index > sources_.size()) return file_name_;
  return lua_place(sources_[index - 1].c_str(), static_cast<int>(code & 0x7fffffff));
}

// here() -> the line of the scene that called the language, as a number; and whether the caller
// itself is gone from the stack because it ended in `return sim.something{...}`.
int SceneSession::here(lua_State* L) {
  bool tail = false;
  lua_Debug frame;
  for (int level = 1; level < 200 && lua_getstack(L, level, &frame); ++level) {
    lua_getinfo(L, "Slt", &frame);
    if (std::strcmp(frame.source, kLanguageSource) == 0) {
      tail = frame.istailcall;
    } else if (frame.currentline > 0) {
      lua_pushinteger(L, of(L).place_code(frame.source, frame.currentline));
      lua_pushboolean(L, tail);
      return 2;
    }
  }
  lua_pushinteger(L, 0);
  lua_pushboolean(L, true);
  return 2;
}

// fail(place, what, why, remedy) does not return.
int SceneSession::fail(lua_State* L) {
  ErrorText text;
  text.where = of(L).place(lua_tointeger(L, 1));
  std::string* parts[] = {&text.what, &text.why, &text.remedy};
  for (int i = 0; i < 3; ++i)
    if (lua_type(L, i + 2) == LUA_TSTRING) *parts[i] = one_line_text(lua_tostring(L, i + 2));
  raise(L, ErrorKind::kScene, text);
}

// renamed(place, old, new): notes that the scene uses an old name; each of them once.
int SceneSession::renamed(lua_State* L) {
  SceneSession& session = of(L);
  const std::string old = luaL_checkstring(L, 2), now = luaL_checkstring(L, 3);
  const std::string text =
      "'" + old + "' is called '" + now + "' now; the next release knows no other name";
  const auto same = [&](const std::string& note) { return note.ends_with(text); };
  if (std::ranges::none_of(session.notes_, same))
    session.notes_.push_back(session.place(lua_tointeger(L, 1)) + ": " + text);
  return 0;
}

// suggest(name, {known = anything, ...}) -> "did you mean 'X'?"
int SceneSession::suggest(lua_State* L) {
  lua_settop(L, 2);
  luaL_checktype(L, 2, LUA_TTABLE);
  const std::vector<std::string> known = names_in(L, 2);
  const std::string name = lua_type(L, 1) == LUA_TSTRING ? lua_tostring(L, 1) : show(L, 1);
  lua_pushstring(L, suggestion(one_line_text(name), known).c_str());
  return 1;
}

int SceneSession::show_value(lua_State* L) {
  lua_pushstring(L, show(L, 1).c_str());
  return 1;
}

// cloth.n=16 is nearer than n=16.
Value SceneSession::setting(const SceneArg& arg, const std::string& scope) const {
  auto given = options_.settings.find(scope + "." + arg.name);
  if (given == options_.settings.end()) given = options_.settings.find(arg.name);
  if (given == options_.settings.end()) return arg.default_value;
  const std::string& text = given->second;
  if (std::holds_alternative<std::string>(arg.default_value)) return text;
  if (std::holds_alternative<bool>(arg.default_value)) {
    if (text == "true" || text == "false") return text == "true";
  } else if (const auto number = parse_number(text)) {
    return *number;
  }
  throw Error(ErrorKind::kUsage, {"bad value '" + one_line_text(text) + "'",
                                  "--set " + given->first, "expected " + type_of(arg.default_value),
                                  "its default is " + to_text(arg.default_value)});
}

// plugin(place, file): opens the library beside the file of that place.
int SceneSession::plugin(lua_State* L) {
  SceneSession& self = of(L);
  lua_settop(L, 2);
  const SourceLocation place = self.place(lua_tointeger(L, 1));
  if (self.options_.safe)
    scene_error(place, "no plugin", "--safe opens none that a scene brings, which is native code",
                "leave --safe out if you trust it, or give the library with --load");
  if (lua_type(L, 2) != LUA_TSTRING)
    scene_error(place, "bad file of sim.plugin", "expected text, got " + show(L, 2),
                "write sim.plugin \"wind.so\"");
  const std::filesystem::path name(lua_tostring(L, 2));
  if (name.empty() || name.is_absolute() || std::ranges::count(name, ".."))
    scene_error(place, "bad file of sim.plugin",
                "expected a library beside the scene or below, got " + show(L, 2),
                "for one that lies elsewhere: --load FILE.so");
  const std::filesystem::path file = std::filesystem::path(file_of(place)).parent_path() / name;
  std::error_code failed;
  if (!std::filesystem::is_regular_file(file, failed))
    throw Error(ErrorKind::kPlugin,
                {"no plugin " + show(L, 2), place, "there is no file '" + file.string() + "'",
                 "build it and put it beside the scene"});
  self.registry_.load(file);
  return 0;
}

// arg(place, name, default, doc) -> the value.
int SceneSession::arg(lua_State* L) {
  SceneSession& self = of(L);
  lua_settop(L, 4);
  const SourceLocation place = self.place(lua_tointeger(L, 1));
  if (lua_type(L, 2) != LUA_TSTRING || !legal_arg_name(lua_tostring(L, 2)))
    scene_error(place, "bad name of sim.arg",
                "expected a word of letters, digits and _, got " + show(L, 2));
  SceneArg arg{lua_tostring(L, 2), {}, {}, ""};
  const std::string what = "sim.arg '" + arg.name + "'";

  bool integer = false;
  if (lua_type(L, 3) == LUA_TBOOLEAN) {
    arg.default_value = static_cast<bool>(lua_toboolean(L, 3));
  } else if (lua_type(L, 3) == LUA_TNUMBER) {
    integer = lua_isinteger(L, 3);
    arg.default_value = read_number(L, 3, place, "default of " + what);
  } else if (lua_type(L, 3) == LUA_TSTRING) {
    arg.default_value = std::string(lua_tostring(L, 3), lua_rawlen(L, 3));
  } else {
    scene_error(place, "bad default of " + what,
                "expected a number, text, true or false, got " + show(L, 3),
                "write sim.arg(\"" + arg.name + "\", 1, \"what it is\")");
  }
  if (lua_type(L, 4) == LUA_TSTRING)
    arg.doc = one_line_text(lua_tostring(L, 4));
  else if (!lua_isnil(L, 4))
    scene_error(place, "bad description of " + what, "expected text, got " + show(L, 4));
  const std::string scope = file_stem(place);
  arg.value = self.setting(arg, scope);

  // One file may declare a name again, with the same default.
  const auto before = std::find_if(
      self.declared_.begin(), self.declared_.end(),
      [&](const Declared& other) { return other.arg.name == arg.name && other.scope == scope; });
  if (before == self.declared_.end()) {
    if (self.declared_.size() == kMostArgs)
      scene_error(place, "too many parameters", "a scene has at most " + std::to_string(kMostArgs));
    self.declared_.push_back({arg, place, scope});
  } else if (!same_value(before->arg.default_value, arg.default_value)) {
    scene_error(place, what + " has two defaults",
                to_text(arg.default_value) + " here, " + to_text(before->arg.default_value) +
                    " at " + before->place,
                "use two names, or the same default");
  }

  // A whole number stays one, so that it can count and index.
  if (const auto* flag = std::get_if<bool>(&arg.value)) {
    lua_pushboolean(L, *flag);
  } else if (const auto* number = std::get_if<double>(&arg.value)) {
    lua_Integer whole = 0;
    if (integer && lua_numbertointeger(*number, &whole) && static_cast<double>(whole) == *number)
      lua_pushinteger(L, whole);
    else
      lua_pushnumber(L, *number);
  } else {
    const auto& text = std::get<std::string>(arg.value);
    lua_pushlstring(L, text.data(), text.size());
  }
  return 1;
}

std::vector<SceneArg> SceneSession::args() const {
  std::vector<SceneArg> args;
  for (const Declared& one : declared_) {
    const auto same_name = [&](const Declared& other) { return other.arg.name == one.arg.name; };
    const bool alone = std::all_of(declared_.begin(), declared_.end(), [&](const Declared& other) {
      return !same_name(other) || same_value(other.arg.default_value, one.arg.default_value);
    });
    if (alone && std::find_if(declared_.begin(), declared_.end(), same_name)->scope != one.scope)
      continue;  // shared by name: listed where it was declared first
    args.push_back(one.arg);
    if (!alone) args.back().name = one.scope + "." + one.arg.name;
  }
  return args;
}

void SceneSession::check_settings() const {
  std::vector<std::string> known;
  for (const Declared& one : declared_) {
    known.push_back(one.arg.name);
    known.push_back(one.scope + "." + one.arg.name);
  }
  std::vector<std::string> listed;
  for (const SceneArg& arg : args()) listed.push_back(arg.name);
  for (const auto& [name, value] : options_.settings)
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw Error(ErrorKind::kUsage,
                  {"unknown parameter '" + one_line_text(name) + "'",
                   "--set " + one_line_text(name) + "=" + one_line_text(value),
                   "the scene '" + file_name_ + "' declares no such sim.arg",
                   listed.empty() ? "it has no parameters" : suggestion(name, listed)});
}

}  // namespace sim
