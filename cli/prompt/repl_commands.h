// The commands of a session: one table, from which help, abbreviations, suggestions, completion and
// the functions of Lua come.
#pragma once

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "cli/prompt/repl_session.h"

namespace sim::cli {

struct Command;

// One call, as `.NAME ARGUMENTS` or as sim.NAME(ARGUMENTS). A missing argument, or one of another
// kind, throws Error{kUsage} with the usage of the command.
class Call {
 public:
  Call(Session& in, const Command& command, std::vector<Data> arguments, bool as_dot_command)
      : session(in), spoken(as_dot_command), command_(command), arguments_(std::move(arguments)) {}

  void take(std::size_t least, std::size_t most) const;  // so many arguments
  std::size_t count() const { return arguments_.size(); }
  const Data& operator[](std::size_t i) const { return arguments_[i]; }
  std::int64_t integer(std::size_t i, std::int64_t least, const std::string& what) const;
  double number(std::size_t i, double least, const std::string& what) const;
  double seconds(std::size_t i, double least, const std::string& what) const;  // 0.005 or "5ms"
  std::string text(std::size_t i, const std::string& what) const;
  Vec3 vector(std::size_t i, const std::string& what) const;  // a table of three, or three
  int particle(std::size_t i) const;                          // one that the system has
  [[noreturn]] void wrong(const std::string& why) const;

  Session& session;
  bool spoken;  // as a dot command, whose answer is printed

 private:
  const Command& command_;
  std::vector<Data> arguments_;
};

// Text, a number, true or false as text; nothing for anything else.
std::optional<std::string> plain_text(const Data& value);

// The value, for Lua; and the output of a dot command in a mode, empty = the value.
struct Answer {
  Data value = {};
  std::function<std::optional<std::string>(Mode)> print = {};
};

Answer words(const std::string& text, Data value = {});  // mode text prints the text

struct Command {
  const char* section;
  const char* name;
  const char* lua;        // the name in Lua, which has until and goto as words of its own
  const char* arguments;  // for people
  const char* help;       // one line
  Answer (*run)(Call&);
  bool whole_line = false;  // all that follows is one argument
};

std::span<const Command> commands();

// The command of that name, or of which it is the only beginning. Throws Error{kUsage} naming the
// candidates, or the nearest.
const Command& find_command(const std::string& name);

// Commands that may be written with a dot or called in Lua.
const Command* command_called(const std::string& name);

// Splits the text after a command into words; "..." keeps spaces. Numbers become numbers.
std::vector<Data> words_of(const std::string& text);

}  // namespace sim::cli
