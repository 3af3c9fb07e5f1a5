#include "cli/prompt/repl_session.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <regex>
#include <sstream>

#include "cli/prompt/repl_commands.h"
#include "cli/prompt/repl_help.h"
#include "cli/terminal/console.h"
#include "cli/terminal/signals.h"
#include "cli/verbs/describe.h"
#include "core/base/error.h"
#include "core/lua/lua_keywords.h"
#include "core/output/format.h"
#include "core/output/read_file.h"

namespace sim::cli {
namespace {

constexpr std::size_t kShown = 40;  // entries of a table, for people
constexpr int kDeepest = 20;        // files that read files

SceneOptions lua_options(const SessionRequest& request, const Environment& environment) {
  SceneOptions options;
  options.search_path = environment.scene_folders;
  options.seed = request.scene.seed;
  options.limits = request.scene.lua;
  options.safe = request.scene.safe;
  options.interrupted = SessionSignals::any;
  options.overrun = end_overrun;
  return options;
}

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(" \t\r") + 1 - begin);
}

// "spring?", "sim.grid?", ".step?", "?": valid questions.
bool is_question(const std::string& line) {
  return line.ends_with('?') && std::all_of(line.begin(), line.end() - 1, [](char c) {
           return std::isalnum(static_cast<unsigned char>(c)) || std::strchr("_.:/-", c) != nullptr;
         });
}

// The opening lines from which such a session can be replayed.
std::string opening_of(const SceneRequest& request, const LiveScene& live) {
  std::string text =
      "-- a session of simrepl, to be run again by simrepl -f FILE\n.open " + request.scene + "\n";
  for (const auto& [name, value] : request.settings) text += ".set " + name + " " + value + "\n";
  const Simulation& system = live.scene().systems[live.current()];
  if (!request.integrator.name.empty() || !request.integrator.given.empty())
    text += ".integrator " + system.method().label() + "\n";
  if (request.dt > 0) text += ".dt " + shortest(request.dt) + "\n";
  return text;
}

// False for commands that have no effect on the state.
bool worth_keeping(const std::string& text) {
  if (text.ends_with('?')) return false;
  for (const char* command : {".save", ".help", ".quit", ".view"})
    if (text.starts_with(command)) return false;
  return true;
}

bool is_command(const std::string& line) {
  return line.size() > 1 && line[0] == '.' && std::isalpha(static_cast<unsigned char>(line[1]));
}

}  // namespace

Session::Session(const SessionRequest& request, const Environment& environment, Registry& registry,
                 Console& console)
    : interactive_(request.interactive),
      console_(console),
      registry_(registry),
      environment_(environment),
      live_(request.scene, environment, registry, request.history, console.err,
            request.interactive && console.err_is_terminal),
      lua_(lua_options(request, environment), registry,
           [this](const std::string& line) { say(line); }),
      opening_(opening_of(request.scene, live_)) {
  for (const Command& command : commands())
    lua_.define(command.lua, [this, &command](const std::vector<Data>& arguments) {
      Call call(*this, command, arguments, false);
      return command.run(call).value;
    });
}

void Session::say(const std::string& text) {
  put(console_.out, text);
  flush_or_throw(console_.out, "standard output");
}

void Session::tell(const std::string& text) {
  if (interactive_) put(console_.err, text);
}

void Session::say_rows(const CsvText& text) {
  if (!text.header.empty() && text.header != last_header_) say(text.header);
  if (!text.header.empty()) last_header_ = text.header;
  say(text.rows);
}

void Session::show(const Data& value) {
  if (mode == Mode::kText) {
    say(lua_text(value) + "\n");
  } else if (mode == Mode::kJson) {
    say(json_text(value) + "\n");
  } else {
    say_rows(csv_text(value));
  }
}

void Session::run_command(const std::string& line) {
  const std::size_t end = std::min(line.find_first_of(" \t"), line.size());
  const Command& command = find_command(line.substr(1, end - 1));
  const std::string rest = trimmed(line.substr(end));
  std::vector<Data> arguments;
  if (!command.whole_line)
    arguments = words_of(rest);
  else if (!rest.empty())
    arguments.emplace_back(rest);
  Call call(*this, command, std::move(arguments), true);
  const Answer answer = command.run(call);
  if (answer.print) {
    if (const auto text = answer.print(mode)) return say(*text);
  }
  if (!answer.value.nil()) show(answer.value);
}

void Session::run_lua(const std::string& chunk) {
  const std::size_t most = mode == Mode::kText ? kShown : static_cast<std::size_t>(-1);
  try {
    const std::vector<Data> values = lua_.run(chunk, where_, begun_, most);
    for (const Data& value : values) show(value);
    explain(trimmed(chunk), values);
  } catch (const Error& error) {
    SessionSignals::check();  // an interrupt ends Lua with an error
    explain_error(trimmed(chunk), error);
  }
}

// Hints on two surprises: a local is gone after its line, and a function is not called without
// parentheses.
void Session::explain(const std::string& chunk, const std::vector<Data>& values) {
  std::smatch match;
  static const std::regex local(R"(^local\s+(?:function\s+)?(\w+(?:\s*,\s*\w+)*))");
  if (std::regex_search(chunk, match, local)) {
    static const std::regex word(R"(\w+)");
    const std::string names = match[1];
    for (std::sregex_iterator it(names.begin(), names.end(), word), end; it != end; ++it)
      locals_.insert(it->str());
  }
  if (!is_lua_name(chunk) || values.size() != 1) return;
  const Command* command = command_called(chunk);
  if (command && std::holds_alternative<DataOpaque>(values[0].value))
    tell(chunk + " is a function: write " + chunk + "() or ." + command->name + "\n");
}

// The remedy for an error that Lua cannot give.
void Session::explain_error(const std::string& chunk, const Error& error) const {
  ErrorText text = error.text();
  constexpr std::string_view kUnknown = "unknown name '";
  if (text.what.starts_with(kUnknown)) {
    const std::string name =
        text.what.substr(kUnknown.size(), text.what.size() - 1 - kUnknown.size());
    if (locals_.contains(name))
      text.remedy = "it was local to the line that made it; leave out 'local'";
    else if (text.remedy == "declare it with local")
      text.remedy = "give it a value first: " + name + " = 1";
  }
  const std::size_t end = std::min(chunk.find_first_of(" \t"), chunk.size());
  const Command* command = command_called(chunk.substr(0, end));
  if (command && text.what == "Lua syntax error" && chunk.find('\n') == std::string::npos) {
    const std::string rest = trimmed(chunk.substr(end));
    text.remedy = std::string("write .") + command->name + (rest.empty() ? "" : " ") + rest;
    if (parse_number(rest)) text.remedy += std::string(" or ") + command->lua + "(" + rest + ")";
  }
  throw Error(error.kind(), text);
}

// Runs a line as one change, and keeps the line for script(); for a line that fails, how far it
// came.
template <class Run>
void Session::kept(const std::string& text, Run run) {
  struct Inside {
    int& depth;
    ~Inside() { --depth; }
  } const inside{++kept_};
  const bool outermost = kept_ == 1;
  if (outermost) live_.part();
  const std::int64_t before = live_.system().step_count();
  try {
    run();
  } catch (...) {
    const std::int64_t taken = live_.system().step_count() - before;
    if (outermost && taken > 0) log_ += ".step " + std::to_string(taken) + "\n";
    throw;
  }
  if (outermost && worth_keeping(text)) log_ += text + "\n";
}

void Session::run_line(const std::string& text) {
  if (is_command(text))
    run_command(text);
  else
    run_lua(text);
}

bool Session::take(const std::string& line, const std::string& where, int number) {
  where_ = where;
  line_ = number;
  if (unfinished_.empty()) {
    begun_ = number;
    const std::string text = trimmed(line);
    if (text.empty() || (number == 1 && text.starts_with("#!"))) return true;
    if (text == "quit" || text == "exit") {
      exit_code = 0;
      return true;
    }
    if (is_command(text) || is_question(text)) {
      try {
        if (is_question(text))
          say(text == "?" ? help_list() : help_on(*this, text.substr(0, text.size() - 1)));
        else
          kept(text, [&] { run_command(text); });
      } catch (const Error& error) {
        if (interactive_) throw;
        ErrorText placed = error.text();
        const std::string here = where + ":" + std::to_string(number);
        if (!placed.where.starts_with(here))
          placed.where = placed.where.empty() ? here : here + ": " + placed.where;
        throw Error(error.kind(), placed);
      }
      tell_position();
      return true;
    }
  }
  unfinished_ += unfinished_.empty() ? line : "\n" + line;
  if (!lua_.is_complete(unfinished_)) return false;
  run_unfinished();
  tell_position();
  return true;
}

void Session::run_unfinished() {
  const std::string chunk = std::exchange(unfinished_, {});
  kept(chunk, [&] { run_lua(chunk); });
}

void Session::end() {
  if (!unfinished_.empty()) run_unfinished();
}

void Session::read_init(const std::string& file) {
  ++kept_;  // so that no line of it is the outermost
  struct Leave {
    int& depth;
    ~Leave() { --depth; }
  } const leave{kept_};
  read(file);
}

void Session::check_output(const std::string& command, const std::string& file) const {
  FilePlan plan = files_;
  plan_inputs(live_.scene().spec, registry_, plan);
  plan.writes(command, file);
  plan.check();
}

void Session::read(const std::string& name) {
  if (depth_ >= kDeepest)
    throw Error(ErrorKind::kUsage, {"cannot read", name, "the files read each other", ""});
  constexpr double kMostBytes = 64e6;
  std::istringstream file(read_input_file(name, kMostBytes, ""));
  files_.reads("the script", name);
  const std::string outer_where = where_;
  const int outer_line = line_;
  const std::string outer_chunk = std::exchange(unfinished_, {});
  ++depth_;
  struct Leave {
    int& depth;
    ~Leave() { --depth; }
  } const leave{depth_};
  int number = 0;
  for (std::string line; !exit_code && std::getline(file, line);) take(line, name, ++number);
  end();
  where_ = outer_where;
  line_ = outer_line;
  unfinished_ = outer_chunk;
}

// The time of the scene and its next steps, in a line a system.
std::string Session::position() {
  if (!interactive_) return "";
  std::string text;
  const auto& systems = live_.scene().systems;
  for (std::size_t i = 0; i < systems.size(); ++i) {
    const Simulation& system = systems[i];
    if (systems.size() > 1) text += system.name() + "  ";
    text += "step " + std::to_string(system.step_count()) + "  t = " + brief(system.t()) + " s";
    if (system.second_order()) {
      const Energy energy = system.energy();
      text += "  energy " + brief(energy.total(), 5) + " J";
      if (const double drift = live_.drift(i, energy); !std::isnan(drift))
        text += "  drift " + brief(drift, 4) + " J";
    }
    text += "  " + system.method().name() + ", dt = " + brief(system.h()) + " s\n";
  }
  return text;
}

void Session::tell_position() {
  if (std::string now = position(); now != told_) tell(told_ = std::move(now));
}

std::string Session::prompt() const {
  if (!unfinished_.empty()) return "... ";
  const LoadedScene& scene = live_.scene();
  std::string text = scene.spec.world ? scene.spec.file : scene.spec.systems.front().name;
  if (scene.spec.world)
    text =
        std::filesystem::path(text).stem().string() + "/" + scene.systems[live_.current()].name();
  if (live_.branch() != "main") text += "@" + live_.branch();
  return text + " " + brief(scene.systems[live_.current()].t(), 4) + " s> ";
}

std::string Session::facts() {
  std::vector<std::vector<std::string>> rows;
  for (const Simulation& system : live_.scene().systems)
    rows.push_back({system.name(), system_facts(system)});
  std::string text = aligned(rows, "");
  for (const std::string& note : live_.loaded().notes()) text += "note: " + note + "\n";
  return text;
}

std::string Session::banner() {
  told_ = position();
  return "sim " + build_facts().version + ", " + live_.scene().spec.file + "\n" + facts() +
         "Lua, or a command: .help lists them, NAME? explains, Tab completes\n";
}

}  // namespace sim::cli
