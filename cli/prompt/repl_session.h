// A session at a prompt or of a script: lines in, answers out.
#pragma once

#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "cli/prompt/repl_record.h"
#include "cli/prompt/repl_scene.h"
#include "cli/prompt/repl_show.h"
#include "cli/terminal/console.h"
#include "core/lua/prompt/prompt.h"

namespace sim::cli {

struct SessionRequest {
  SceneRequest scene;
  std::size_t history = Timeline::kDefaultBudget;  // bytes, of snapshots to go back to
  bool interactive = false;                        // somebody is there: prompt, words, progress
};

class Session {
 public:
  // Throws the errors of loading the scene.
  Session(const SessionRequest& request, const Environment& environment, Registry& registry,
          Console& console);

  // Takes one line, the `number`-th of `where`. False: it is continued in the next. Throws its
  // errors: Error with its location, Interrupted, ClosedPipe. The state is then as before or, after
  // a stopped run, that of its last whole step.
  bool take(const std::string& line, const std::string& where, int number);

  // The end of the input. Throws Error for an incomplete line.
  void end();

  void forget_unfinished() { unfinished_.clear(); }
  void read(const std::string& file);       // the lines of a file
  void read_init(const std::string& file);  // the same, and no part of script()
  void run_line(const std::string& text);   // a command or Lua, complete

  bool interactive() const { return interactive_; }
  std::optional<int> exit_code;  // once .quit was said
  Mode mode = Mode::kText;

  // Commands that repeat the session from its start.
  std::string script() const { return opening_ + log_; }
  void add_to_script(const std::string& lines) { log_ += lines; }  // for a command that is not
  Records records;

  // The files that the session reads and writes; a command may write none of them. Throws
  // Error{kUsage}.
  FilePlan& files() { return files_; }
  void check_output(const std::string& command, const std::string& file) const;

  LiveScene& live() { return live_; }
  Prompt& lua() { return lua_; }
  Registry& registry() { return registry_; }
  const Environment& environment() const { return environment_; }
  Console& console() { return console_; }
  const std::string& where() const { return where_; }  // of the line being taken
  int line() const { return line_; }

  void say(const std::string& text);   // data
  void tell(const std::string& text);  // words, where somebody is there to read them
  void tell_position();                // ... where the scene is, if that is new
  void show(const Data& value);        // in the present mode
  void say_rows(const CsvText& text);  // the header only where it is new

  std::string prompt() const;
  std::string banner();
  std::string facts();  // of the systems, for people

 private:
  template <class Run>
  void kept(const std::string& text, Run run);
  void run_command(const std::string& line);
  void run_lua(const std::string& chunk);
  void run_unfinished();
  void explain(const std::string& chunk, const std::vector<Data>& values);
  [[noreturn]] void explain_error(const std::string& chunk, const Error& error) const;
  std::string position();

  bool interactive_;
  Console& console_;
  Registry& registry_;
  const Environment& environment_;
  LiveScene live_;
  FilePlan files_;
  Prompt lua_;
  std::string unfinished_, where_, last_header_, told_;
  int line_ = 0, begun_ = 0, depth_ = 0;
  std::string opening_, log_;     // of script()
  int kept_ = 0;                  // lines being taken, one inside the other
  std::set<std::string> locals_;  // names that were local to a line
};

}  // namespace sim::cli
