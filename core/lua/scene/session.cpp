#include "core/lua/scene/session.h"

#include <algorithm>
#include <cstring>

#include "core/base/text.h"
#include "core/base/utf8.h"
#include "core/lua/library/library.h"
#include "core/lua/lua_read.h"
#include "core/lua/scene/argument_units.h"
#include "core/lua/scene/sandbox.h"
#include "core/output/read_file.h"

namespace sim {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kSafePrint = 1'000'000, kMostPrint = 64'000'000;  // bytes
constexpr std::size_t kLargestFile = 64'000'000;                        // bytes
constexpr std::uint64_t kFileWork = 10'000;        // of looking for a file, in steps
constexpr const char* kLanguage = "sim.language";  // registry: the value of require "sim"
constexpr const char* kModules = "sim.modules";    // registry: canonical file -> value

std::string read_file(const fs::path& file, const SourceLocation& asked_at) {
  const SourceLocation where = asked_at.empty() ? file.string() : asked_at;
  return read_whole_file(file, {"cannot read '" + file.string() + "'", where, "", ""},
                         kLargestFile);
}

// Pushes the text as a function; never accepts bytecode.
void load_text(lua_State* L, std::string_view text, const std::string& chunk) {
  if (text.starts_with("\xEF\xBB\xBF")) text.remove_prefix(3);
  if (text.starts_with('#')) text.remove_prefix(std::min(text.find('\n'), text.size()));
  if (load_chunk(L, text, chunk)) return;
  if (lua_type(L, -1) != LUA_TSTRING) lua_error(L);
  const std::string message = lua_tostring(L, -1);
  const std::string name = chunk.substr(1);
  const std::string shown =
      name.size() < LUA_IDSIZE ? name : "..." + name.substr(name.size() - (LUA_IDSIZE - 4));
  ErrorText error{"Lua syntax error", name, one_line_text(message), ""};
  if (const auto stripped = strip_place(message, shown.c_str())) {
    error.where = lua_place(chunk.c_str(), stripped->first);
    error.why = one_line_text(stripped->second);
  }
  throw Error(ErrorKind::kScene, error);
}

// The names of the kinds of plugins, as a list.
void push_kinds(lua_State* L) {
  lua_createtable(L, static_cast<int>(kPluginKinds.size()), 0);
  lua_Integer count = 0;
  for (const PluginKind& kind : kPluginKinds) {
    if (!kind.in_scenes) continue;
    lua_pushlstring(L, kind.name.data(), kind.name.size());
    lua_rawseti(L, -2, ++count);
  }
}

// Lua's own `next`, for the language: quicker, where the order of entries decides nothing.
int visit_next(lua_State* L) {
  luaL_checktype(L, 1, LUA_TTABLE);
  lua_settop(L, 2);
  if (lua_next(L, 1)) return 2;
  lua_pushnil(L);
  return 1;
}

bool legal_module_name(const std::string& name) {
  constexpr std::string_view kLegal =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_.-";
  return !name.empty() && name.size() < 256 &&
         name.find_first_not_of(kLegal) == std::string::npos &&
         name.find("..") == std::string::npos && name.front() != '.' && name.back() != '.';
}

std::string module_input(const std::string& name) { return "module '" + name + "'"; }

std::string canonical_name(const fs::path& file) {
  std::error_code failed;
  const fs::path resolved = fs::canonical(file, failed);
  return failed ? file.string() : resolved.string();
}

// A link may lead out of a folder.
void check_below(const fs::path& folder, const fs::path& file, const SourceLocation& place) {
  const fs::path home = canonical_name(folder.empty() ? "." : folder), real = canonical_name(file);
  const auto parted = std::ranges::mismatch(home, real);
  if (parted.in1 != home.end())
    scene_error(place, "no file '" + file.string() + "'",
                "it lies outside the scene's folder, which --safe does not allow");
}

}  // namespace

std::string file_stem(const SourceLocation& place) {
  const std::size_t colon = place.rfind(".lua:");
  const fs::path file(colon == std::string::npos ? place : place.substr(0, colon + 4));
  return std::string(utf8_head(file.stem().string(), 64));
}

SourceLocation calling_place(lua_State* L) {
  lua_Debug frame;
  for (int level = 1; level < 200 && lua_getstack(L, level, &frame); ++level) {
    lua_getinfo(L, "Sl", &frame);
    if (frame.currentline > 0 && std::strcmp(frame.source, kLanguageSource) != 0)
      return lua_place(frame.source, frame.currentline);
  }
  return {};
}

SceneSession::SceneSession(fs::path file, SceneOptions options, Registry& registry)
    : file_(std::move(file)),
      file_name_(file_.string()),
      options_(std::move(options)),
      registry_(registry),
      printer_(options_.safe ? kSafePrint : kMostPrint,
               options_.print ? options_.print : Printer::to_standard_error),
      lua_(options_.limits, options_.interrupted, options_.overrun) {}

void SceneSession::count(double particles, double elements, const SourceLocation& place) {
  constexpr double kMostParticles = 1e6, kMostElements = 1e7;
  particles_ += particles;
  elements_ += elements;
  if (!options_.safe) return;
  const auto refuse = [&](const std::string& what, double count, double most) {
    scene_error(place, "too many " + what,
                shortest(count) + ", and --safe allows " + shortest(most) + " in all",
                "make the scene smaller, or leave --safe out if you trust it");
  };
  if (particles_ > kMostParticles) refuse("particles", particles_, kMostParticles);
  if (elements_ > kMostElements) refuse("ties, triangles and cells", elements_, kMostElements);
}

SceneSession& SceneSession::of(lua_State* L) {
  return *static_cast<SceneSession*>(lua_touserdata(L, lua_upvalueindex(1)));
}

int SceneSession::print(lua_State* L) {
  of(L).printer_.print(L);
  return 0;
}

void SceneSession::open(lua_State* L) {
  open_sandbox(L, options_.seed);
  lua_newtable(L);
  lua_setfield(L, LUA_REGISTRYINDEX, kModules);
  lua_pushlightuserdata(L, this);
  lua_pushcclosure(L, guarded<require>, 1);
  lua_setglobal(L, "require");
  lua_pushlightuserdata(L, this);
  lua_pushcclosure(L, guarded<print>, 1);
  lua_setglobal(L, "print");
  open_language(L);
}

void SceneSession::run(lua_State* L) {
  open(L);
  run_file(L, "scene", file_, {});
}

void SceneSession::push_language(lua_State* L) { lua_getfield(L, LUA_REGISTRYINDEX, kLanguage); }

void SceneSession::set_language(lua_State* L) { lua_setfield(L, LUA_REGISTRYINDEX, kLanguage); }

// The language comes from the search path alone: a scene's folder cannot replace it.
void SceneSession::open_language(lua_State* L) {
  std::string looked;
  for (const fs::path& folder : options_.search_path) {
    const fs::path file = folder / "sim" / "init.lua";
    looked += (looked.empty() ? "" : ", ") + file.string();
    std::error_code failed;
    if (!fs::is_regular_file(file, failed)) continue;

    load_text(L, read("language", file, {}), kLanguageSource);
    constexpr luaL_Reg kHost[] = {{"here", guarded<here>},       {"fail", guarded<fail>},
                                  {"suggest", guarded<suggest>}, {"show", guarded<show_value>},
                                  {"arg", guarded<arg>},         {"plugin", guarded<plugin>},
                                  {"renamed", guarded<renamed>}, {nullptr, nullptr}};
    luaL_newlibtable(L, kHost);
    lua_pushlightuserdata(L, this);
    luaL_setfuncs(L, kHost, 1);
    push_kinds(L);
    lua_setfield(L, -2, "kinds");
    lua_pushcfunction(L, visit_next);
    lua_setfield(L, -2, "next");
    lua_call(L, 1, 3);
    tied_ = luaL_ref(L, LUA_REGISTRYINDEX);
    records_ = luaL_ref(L, LUA_REGISTRYINDEX);
    lua_setfield(L, LUA_REGISTRYINDEX, kLanguage);
    return;
  }
  throw Error(ErrorKind::kIo, {"the scene language is missing", "sim/init.lua",
                               looked.empty() ? "the search path is empty" : "looked at " + looked,
                               "set SIM_PATH to the folder that holds sim/ and scenes/"});
}

void SceneSession::note_input(const std::string& name, const fs::path& file, std::uint64_t hash) {
  InputFile input{name, fs::absolute(file).string(), hash};
  if (std::ranges::find(inputs_, input) == inputs_.end()) inputs_.push_back(std::move(input));
}

std::string SceneSession::read(const std::string& name, const fs::path& file,
                               const SourceLocation& asked_at) {
  const bool given = options_.text && name == "scene";
  std::string text = given ? *options_.text : read_file(file, asked_at);
  note_input(name, file, content_hash(text));
  return text;
}

// Pushes what the file returns.
void SceneSession::run_file(lua_State* L, const std::string& input, const fs::path& file,
                            const SourceLocation& asked_at) {
  struct Loading {
    std::set<std::string>& names;
    std::string name;
    ~Loading() { names.erase(name); }
  };
  const std::string name = canonical_name(file);
  if (!loading_.insert(name).second)
    throw Error(ErrorKind::kScene,
                {"cyclic require", asked_at, "'" + file.string() + "' is still being loaded",
                 "move what both files need into a third"});
  const Loading loading{loading_, name};

  // Every file sees the same random numbers, whoever requires it.
  const RandomScope random(L, options_.seed);
  std::string chunk = "@";
  chunk += file.string();
  const std::string text = read(input, file, asked_at);
  load_text(L, text, chunk);
  lua_call(L, 0, 1);
  check_argument_units(text, file.string(), registry_);
}

// A file that appears at a path that was searched in vain changes the scene: these are inputs, too.
fs::path SceneSession::find_module(lua_State* L, const std::string& name) {
  if (!legal_module_name(name))
    throw Error(ErrorKind::kScene,
                {"bad module name '" + one_line_text(name) + "'", calling_place(L),
                 "only letters, digits, _, - and single dots between names are allowed",
                 "write require \"folder.file\""});
  std::string relative = name, looked;
  for (char& c : relative)
    if (c == '.') c = '/';
  std::vector<fs::path> folders{file_.parent_path()};
  folders.insert(folders.end(), options_.search_path.begin(), options_.search_path.end());
  for (const fs::path& folder : folders)
    for (const char* ending : {".lua", "/init.lua"}) {
      const fs::path candidate = folder / (relative + ending);
      std::error_code failed;
      if (fs::is_regular_file(candidate, failed)) {
        if (options_.safe) check_below(folder, candidate, calling_place(L));
        return candidate;
      }
      looked += (looked.empty() ? "" : ", ") + candidate.string();
      note_input(module_input(name), candidate, 0);
    }
  std::vector<std::string> known{"sim"};
  for (std::string scene : list_scenes(options_.search_path)) {
    scene.resize(scene.size() - 4);
    for (char& c : scene)
      if (c == '/') c = '.';
    known.push_back(scene);
  }
  throw Error(ErrorKind::kScene, {"module '" + name + "' not found", calling_place(L),
                                  "looked at " + looked, suggestion(name, known)});
}

// A library is run once and shared; a scene is run again each time, so that copies are independent.
int SceneSession::require(lua_State* L) {
  SceneSession& self = of(L);
  if (lua_type(L, 1) != LUA_TSTRING)
    scene_error(calling_place(L), "bad module name", "expected text, got " + show(L, 1));
  lua_settop(L, 1);
  const std::string name(lua_tostring(L, 1), lua_rawlen(L, 1));
  if (name == "sim") {
    push_language(L);
    return 1;
  }
  charge(L, kFileWork);
  const fs::path file = self.find_module(L, name);
  const std::string key = canonical_name(file);
  lua_getfield(L, LUA_REGISTRYINDEX, kModules);
  if (lua_getfield(L, 2, key.c_str()) != LUA_TNIL) return 1;
  lua_pop(L, 1);

  self.run_file(L, module_input(name), file, calling_place(L));
  if (lua_isnil(L, -1)) {
    lua_pop(L, 1);
    lua_pushboolean(L, true);
  }
  const std::string kind = self.push_record(L, 3);
  lua_settop(L, 3);
  if (kind != "scene" && kind != "world") {
    lua_pushvalue(L, 3);
    lua_setfield(L, 2, key.c_str());
  }
  return 1;
}

std::string SceneSession::push_record(lua_State* L, int index) {
  StackScope::require_room(L);
  index = lua_absindex(L, index);
  if (!lua_istable(L, index)) {
    lua_pushnil(L);
    return {};
  }
  lua_rawgeti(L, LUA_REGISTRYINDEX, records_);
  lua_pushvalue(L, index);
  lua_rawget(L, -2);
  lua_remove(L, -2);
  if (lua_isnil(L, -1)) return {};
  lua_getfield(L, -1, "kind");
  const std::string kind = lua_tostring(L, -1);
  lua_pop(L, 1);
  return kind;
}

}  // namespace sim
