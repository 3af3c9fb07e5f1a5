#include "cli/prompt/repl_session.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <fstream>

#include "cli/prompt/repl_commands.h"
#include "cli/prompt/repl_help.h"
#include "cli/terminal/signals.h"
#include "cli/verbs/describe.h"
#include "core/base/error.h"
#include "core/output/format.h"

namespace sim::cli {
namespace {

constexpr std::size_t kShown = 40;  // entries of a table, for people
constexpr int kDeepest = 20;        // files that read files

SceneOptions lua_options(const SessionRequest& request, const Environment& environment) {
  SceneOptions options;
  options.search_path = environment.scene_folders;
  options.seed = request.scene.seed;
  options.interrupted = SessionSignals::any;
  return options;
}

std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t\r");
  if (begin == std::string::npos) return "";
  return text.substr(begin, text.find_last_not_of(" \t\r") + 1 - begin);
}

// "spring?", "sim.grid?", ".step?", "?": whatever may be asked about.
bool is_question(const std::string& line) {
  return line.ends_with('?') && std::all_of(line.begin(), line.end() - 1, [](char c) {
           return std::isalnum(static_cast<unsigned char>(c)) || std::strchr("_.:/-", c) != nullptr;
         });
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
           [this](const std::string& line) { say(line); }) {
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
    for (const Data& value : lua_.run(chunk, where_, begun_, most)) show(value);
  } catch (const Error&) {
    SessionSignals::check();  // an interrupt ends Lua with an error
    throw;
  }
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
          run_command(text);
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
  run_lua(std::exchange(unfinished_, {}));
  tell_position();
  return true;
}

void Session::end() {
  if (!unfinished_.empty()) run_lua(std::exchange(unfinished_, {}));
}

void Session::read(const std::string& name) {
  if (depth_ >= kDeepest)
    throw Error(ErrorKind::kUsage, {"cannot read", name, "the files read each other", ""});
  std::ifstream file(name, std::ios::binary);
  std::error_code failed;
  if (!file || std::filesystem::is_directory(name, failed))
    throw Error(ErrorKind::kIo,
                {"cannot read", name, file ? "it is a folder" : std::strerror(errno), ""});
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

// Where the scene is in time and how it goes on, in a line a system.
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
      const double drift = energy.total() - live_.start_energy(i);
      text += "  energy " + brief(energy.total(), 5) + " J  drift " + brief(drift, 4) + " J";
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

std::string Session::banner() {
  std::string text = "sim " + build_facts().version + ", " + live_.scene().spec.file + "\n";
  std::vector<std::vector<std::string>> rows;
  for (const Simulation& system : live_.scene().systems)
    rows.push_back({system.name(), system_facts(system)});
  told_ = position();
  return text + aligned(rows, "") +
         "Lua, or a command: .help lists them, NAME? explains, Tab completes\n";
}

}  // namespace sim::cli
