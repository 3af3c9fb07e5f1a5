// The Lua session behind a prompt: sandboxed like a scene, with the scene language and functions
// of the host in it.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/lua/data.h"
#include "core/lua/scene/scene_file.h"

namespace sim {

class Prompt {
 public:
  // A function of the host. Error thrown in it becomes a Lua error and comes out of run() again;
  // any other exception ends all Lua that runs and comes out of run() as it is.
  using Host = std::function<Data(const std::vector<Data>& arguments)>;

  // `print` gets the lines of Lua's print. The settings are not used. Throws Error{kIo} without the
  // scene language.
  Prompt(SceneOptions options, Registry& registry, std::function<void(const std::string&)> print);
  ~Prompt();
  Prompt(const Prompt&) = delete;
  Prompt& operator=(const Prompt&) = delete;

  // sim.NAME(...), and NAME(...) unless the session defines that name itself.
  void define(const std::string& name, Host host);

  // False when `chunk` is the beginning of something longer.
  bool is_complete(const std::string& chunk);

  // Runs an expression, or else statements, and gives its values; the first one is `_` from then
  // on. Tables are cut after `most` entries. `where` and `line` say where the chunk begins, for the
  // errors: Error{kScene} at FILE:LINE, or what a host function threw.
  std::vector<Data> run(const std::string& chunk, const std::string& where, int line,
                        std::size_t most);

  // The expression as a function without arguments, and a call of one. Also inside a host function.
  DataFunction compile(const std::string& expression, const std::string& where, int line);
  Data call(const DataFunction& function);

  // Names that continue "a.b.c" or "a.b:c", with what stands before the last dot, and "(" behind
  // those of functions. Runs nothing.
  std::vector<std::string> completions(const std::string& path);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sim
