// One run of a scene file: the Lua state, the scene language in it, `require`, and the parameters.
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "core/lua/lua_state.h"
#include "core/lua/scene/printer.h"
#include "core/lua/scene/scene_file.h"

namespace sim {

class SceneSession {
 public:
  SceneSession(std::filesystem::path file, SceneOptions options, Registry& registry);

  LuaState& lua() { return lua_; }
  Printer& printer() { return printer_; }
  const std::string& file() const { return file_name_; }
  // Declared parameters in order. Where files differ in the default of one name, each is listed as
  // FILE.NAME; both forms can be set.
  std::vector<SceneArg> args() const;

  // Inside lua().protect(): opens the sandbox and in it the language and `require`.
  void open(lua_State* L);
  // ... opens it, runs the scene file and pushes the one value it returns.
  void run(lua_State* L);

  // Pushes the value of `require "sim"`; set_language pops its new value.
  static void push_language(lua_State* L);
  static void set_language(lua_State* L);

  // Pushes what the scene language recorded for a value made by it ({kind=, place=, ...}) and
  // returns its kind; pushes nil and returns "" for any other value.
  std::string push_record(lua_State* L, int index);

  // Pushes the list of the forces that were tied.
  void push_tied(lua_State* L) const { lua_rawgeti(L, LUA_REGISTRYINDEX, tied_); }

  // A place recorded by the scene language, as FILE:LINE; the scene file for 0.
  SourceLocation place(lua_Integer code) const;

  // Notes so many particles, and ties, triangles or cells, before memory is taken for them. With
  // --safe a scene builds at most a million of the former and ten million of the latter, in all.
  // Throws Error{kScene}.
  void count(double particles, double elements, const SourceLocation& place);

  // The files that were read, and the paths where modules were searched before they were found.
  const std::vector<InputFile>& inputs() const { return inputs_; }

  // Notes for the user on the text of the scene, each once.
  const std::vector<std::string>& notes() const { return notes_; }

  // Steps call functions of the scene.
  void set_called() { called_ = true; }
  bool called() const { return called_; }

  // Throws Error{kUsage} for a setting that no sim.arg declared.
  void check_settings() const;

 private:
  struct Declared {
    SceneArg arg;
    SourceLocation place;
    std::string scope;  // name of the file, without folder and ending
  };

  // Functions of the scene language's `host` table and `require`; upvalue 1 is the session.
  static SceneSession& of(lua_State* L);
  static int here(lua_State* L);
  static int fail(lua_State* L);
  static int suggest(lua_State* L);
  static int show_value(lua_State* L);
  static int arg(lua_State* L);
  static int plugin(lua_State* L);
  static int renamed(lua_State* L);
  static int require(lua_State* L);
  static int print(lua_State* L);

  void open_language(lua_State* L);
  std::string read(const std::string& name, const std::filesystem::path& file,
                   const SourceLocation& asked_at);
  void note_input(const std::string& name, const std::filesystem::path& file, std::uint64_t hash);
  void run_file(lua_State* L, const std::string& input, const std::filesystem::path& file,
                const SourceLocation& asked_at);
  std::filesystem::path find_module(lua_State* L, const std::string& name);
  lua_Integer place_code(const char* source, int line);
  Value setting(const SceneArg& arg, const std::string& scope) const;

  std::filesystem::path file_;
  std::string file_name_;
  SceneOptions options_;
  Registry& registry_;
  std::vector<Declared> declared_;
  std::vector<std::string> sources_;  // of places
  std::vector<InputFile> inputs_;
  std::vector<std::string> notes_;
  double particles_ = 0, elements_ = 0;
  bool called_ = false;
  std::set<std::string> loading_;  // canonical names of the files that are running
  int records_ = LUA_NOREF;        // table: value made by the language -> its record
  int tied_ = LUA_NOREF;           // list of the forces that join something
  Printer printer_;
  LuaState lua_;  // last: closed before the rest goes
};

// "cloth" for the place "scenes/cloth.lua:12".
std::string file_stem(const SourceLocation& place);

// The line of the scene that called into C or the language; empty when there is none.
SourceLocation calling_place(lua_State* L);

}  // namespace sim
