#include "cli/prompt/repl_commands.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "cli/command_line/option_values.h"
#include "cli/prompt/repl_actions.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"

namespace sim::cli {
namespace {

const std::array kCommands = std::to_array<Command>({
    {"time", "step", "step", "[N]", "N steps, or one", actions::step},
    {"time", "run", "run", "[T]", "T seconds, or the duration of the scene", actions::run},
    {"time", "until", "run_until", "EXPR", "steps until a Lua expression holds: energy().drift > 1",
     actions::until, true},
    {"time", "back", "back", "[N]", "N steps back, or one, bit for bit", actions::back},
    {"time", "goto", "goto_time", "T", "to the step nearest to T s, back or on", actions::go_to},
    {"time", "undo", "undo", "", "takes back the last change by hand; t stays", actions::undo},
    {"time", "rest", "rest", "", "to where the scene comes to rest; t stays", actions::rest},
    {"time", "reset", "reset", "", "to t = 0; integrator, dt and pins stay", actions::reset},
    {"time", "t", "t", "", "the time in s", actions::t},
    {"time", "taken", "taken", "", "the number of steps taken", actions::taken},

    {"branches", "branch", "branch", "[NAME]", "a branch that starts here; or lists them",
     actions::branch},
    {"branches", "switch", "switch", "NAME", "goes to a branch", actions::switch_to},
    {"branches", "diff", "diff", "A [B]", "where two branches, or A and this one, first differ",
     actions::diff},

    {"state", "n", "n", "", "the number of particles, or of components", actions::n},
    {"state", "particles", "particles", "", "as n; position(i), velocity(i) .. tell of one",
     actions::n},
    {"state", "mass", "mass", "I", "of particle I, in kg", actions::mass},
    {"state", "pins", "pins", "", "the particles that are held", actions::pins},
    {"state", "energy", "energy", "", "kinetic, potential, total and drift in J", actions::energy},
    {"state", "position", "position", "I", "of particle I, in m", actions::position},
    {"state", "velocity", "velocity", "I", "of particle I, in m/s", actions::velocity},
    {"state", "component", "component", "I", "of a flat state", actions::component},
    {"state", "set_position", "set_position", "I X Y Z", "moves particle I, in m",
     actions::set_position},
    {"state", "set_velocity", "set_velocity", "I X Y Z", "gives particle I a velocity, in m/s",
     actions::set_velocity},
    {"state", "set_component", "set_component", "I VALUE", "of a flat state",
     actions::set_component},
    {"state", "pin", "pin", "I ...", "holds particles where they are", actions::pin},
    {"state", "unpin", "unpin", "I ...", "lets them go", actions::unpin},
    {"state", "hand", "hand", "ACTION", "grab I; move I X Y Z over STEPS; release I", actions::hand,
     true},
    {"state", "toggle", "toggle", "[NAME [on|off]]", "turns a switch of the scene; or lists them",
     actions::toggle},
    {"state", "springs", "springs", "I", "those at particle I, their strain and force",
     actions::springs},
    {"state", "forces", "forces", "I", "the shares of the force on particle I, in N",
     actions::forces},
    {"state", "dump", "dump", "[FILE]", "the state as a table, .csv or .jsonl", actions::dump},
    {"state", "show", "show", "[FILE]", "draws the scene as it is here, or into a .png, .ply, ..",
     actions::show},
    {"state", "view", "view", "[page|terminal|window]",
     "to touch from here on, until it is closed or Ctrl-C comes", actions::view},
    {"state", "hash", "hash", "", "of the bits of the state", actions::hash},

    {"accuracy", "verdict", "verdict", "", "the verdict on the last run", actions::verdict},
    {"accuracy", "stability", "stability", "[A,B,..]", "largest stable steps of integrators",
     actions::stability},
    {"accuracy", "tradeoff", "tradeoff", "[ERROR]",
     "speed against accuracy, and which to take for an error of 1% or \"1e-3 m\"",
     actions::tradeoff},
    {"accuracy", "error", "keep_error", "ERROR",
     "integrator and dt that keep an error of 1% or \"1 mm\" from the start on", actions::error},
    {"accuracy", "minimal", "minimal", "[ERROR]",
     "which parts of the scene a result needs, within 1% if not given", actions::minimal},
    {"accuracy", "order", "order", "[INTEGRATOR]", "the order of convergence, observed",
     actions::order},
    {"accuracy", "record", "record", "[NAME EXPR ...]",
     "NAME EXPR every N: a Lua expression on all runs, each N-th step; NAME off ends it",
     actions::record, true},
    {"accuracy", "plot", "plot", "NAME [FILE.svg]", "what was recorded, over time", actions::plot},

    {"scene", "open", "open", "SCENE", "another scene, at its start", actions::open},
    {"scene", "args", "args", "", "the parameters of the scene and their values", actions::args},
    {"scene", "integrator", "integrator", "[NAME]", "shows or changes it; NAME:PARAM=VALUE,...",
     actions::integrator},
    {"scene", "dt", "dt", "[H]", "shows or changes the step size, in s", actions::dt},
    {"scene", "set", "set", "[NAME VALUE]", "its parameters; changing one is a reload",
     actions::set},
    {"scene", "reload", "reload", "", "the file anew, run to this time: what is different",
     actions::reload},
    {"scene", "system", "system", "[NAME]", "the system of a world that particles are meant of",
     actions::system},
    {"scene", "snap", "snap", "FILE", "writes a checkpoint", actions::snap},
    {"scene", "resume", "resume", "FILE", "goes on from a checkpoint, bit for bit",
     actions::resume},
    {"scene", "load", "load", "FILE.so", "a plugin library", actions::load},
    {"scene", "plugins", "plugins", "[WHAT]", "integrators, forces, fields and scenes",
     actions::plugins},

    {"session", "mode", "mode", "[text|json|csv]", "how values are printed", actions::mode},
    {"session", "time", "time", "CODE", "how long Lua or a command takes", actions::time, true},
    {"session", "save", "save", "FILE", "this session, as commands that replay it", actions::save},
    {"session", "read", "read", "FILE", "takes the lines of a file as if typed", actions::read},
    {"session", "help", "help", "[NAME]", "this list; or about a name, as NAME? does",
     actions::help},
    {"session", "quit", "quit", "", "ends the session, as Ctrl-D does", actions::quit},
});

std::string usage_of(const Command& command, bool spoken) {
  if (!spoken) return std::string("see sim.help(\"") + command.name + "\")";
  const std::string arguments = command.arguments;
  return std::string("write .") + command.name + (arguments.empty() ? "" : " ") + arguments;
}

std::string shown(const Data& value) { return value.table() ? "a table" : lua_text(value); }

}  // namespace

std::span<const Command> commands() { return kCommands; }

const Command* command_called(const std::string& name) {
  for (const Command& command : kCommands)
    if (name == command.name || name == command.lua) return &command;
  return nullptr;
}

const Command& find_command(const std::string& name) {
  std::vector<std::string> names;
  std::vector<const Command*> found;
  for (const Command& command : kCommands) {
    if (name == command.name) return command;
    names.emplace_back(command.name);
    if (names.back().starts_with(name)) found.push_back(&command);
  }
  if (found.size() == 1) return *found.front();
  ErrorText text{"unknown command '." + name + "'", "", "there is none of that name", ""};
  if (found.empty()) {
    const std::string near = nearest(name, names);
    text.remedy = near.empty() ? ".help lists them" : "did you mean '." + near + "'?";
  } else {
    text.what = "unclear command '." + name + "'";
    text.why = "it is short for more than one";
    for (const Command* one : found)
      text.remedy += (text.remedy.empty() ? "say ." : ", .") + std::string(one->name);
  }
  throw Error(ErrorKind::kUsage, text);
}

Answer words(const std::string& text, Data value) {
  return {std::move(value), [text](Mode mode) -> std::optional<std::string> {
            if (mode != Mode::kText) return {};
            return text;
          }};
}

std::vector<Data> words_of(const std::string& text) {
  std::vector<Data> list;
  for (std::size_t i = 0; i < text.size();) {
    if (std::isspace(static_cast<unsigned char>(text[i]))) {
      ++i;
      continue;
    }
    std::string word;
    bool quoted = false;
    for (; i < text.size(); ++i) {
      if (text[i] == '"') {
        quoted = !quoted;
      } else if (!quoted && std::isspace(static_cast<unsigned char>(text[i]))) {
        break;
      } else {
        word += text[i];
      }
    }
    if (quoted)
      throw Error(ErrorKind::kUsage, {"open quotes", "", "a second \" is missing", "close them"});
    if (const auto integer = parse_integer(word)) {
      list.emplace_back(std::int64_t{*integer});
    } else if (const auto number = parse_number(word)) {
      list.emplace_back(double{*number});
    } else {
      list.emplace_back(std::move(word));
    }
  }
  return list;
}

void Call::wrong(const std::string& why) const {
  const std::string name = spoken ? "." : "sim.";
  throw Error(ErrorKind::kUsage, {"bad use of " + name + (spoken ? command_.name : command_.lua),
                                  "", why, usage_of(command_, spoken)});
}

void Call::take(std::size_t least, std::size_t most) const {
  if (count() < least)
    wrong(count() == 0 ? "an argument is missing" : "not all arguments are there");
  if (count() > most)
    wrong(most == 0 ? "it takes no arguments"
                    : "it takes " + counted(static_cast<long>(most), "argument"));
}

std::int64_t Call::integer(std::size_t i, std::int64_t least, const std::string& what) const {
  const auto refuse = [&] {
    wrong("expected " + what + ", a whole number" +
          (least >= 0 ? " from " + std::to_string(least) + " on" : "") + ", got " +
          (i < count() ? shown(arguments_[i]) : "nothing"));
  };
  if (i >= count()) refuse();
  std::int64_t value = 0;
  if (const auto* whole = std::get_if<std::int64_t>(&arguments_[i].value)) {
    value = *whole;
  } else if (const auto* number = std::get_if<double>(&arguments_[i].value);
             number && std::floor(*number) == *number && std::abs(*number) < 9e15) {
    value = static_cast<std::int64_t>(*number);
  } else {
    refuse();
  }
  if (value < least) refuse();
  return value;
}

double Call::number(std::size_t i, double least, const std::string& what) const {
  const auto refuse = [&] {
    wrong("expected " + what + ", a number" +
          (std::isfinite(least) ? " from " + brief(least) + " on" : "") + ", got " +
          (i < count() ? shown(arguments_[i]) : "nothing"));
  };
  if (i >= count()) refuse();
  double value = 0;
  if (const auto* whole = std::get_if<std::int64_t>(&arguments_[i].value))
    value = static_cast<double>(*whole);
  else if (const auto* number = std::get_if<double>(&arguments_[i].value))
    value = *number;
  else
    refuse();
  if (!std::isfinite(value) || value < least) refuse();
  return value;
}

double Call::seconds(std::size_t i, double least, const std::string& what) const {
  const auto* text = i < count() ? std::get_if<std::string>(&arguments_[i].value) : nullptr;
  const std::optional<double> value = text ? seconds_of(*text) : std::nullopt;
  if (!value) return number(i, least, what);
  if (*value < least) wrong("expected " + what + " from " + brief(least) + " on, got " + *text);
  return *value;
}

std::optional<std::string> plain_text(const Data& value) {
  if (const auto* text = std::get_if<std::string>(&value.value)) return *text;
  if (const auto* number = std::get_if<double>(&value.value)) return shortest(*number);
  if (std::holds_alternative<std::int64_t>(value.value) ||
      std::holds_alternative<bool>(value.value))
    return lua_text(value);
  return {};
}

std::string Call::text(std::size_t i, const std::string& what) const {
  if (i < count())
    if (auto text = plain_text(arguments_[i])) return *text;
  wrong("expected " + what + ", got " + (i < count() ? shown(arguments_[i]) : "nothing"));
}

Vec3 Call::vector(std::size_t i, const std::string& what) const {
  const DataTable* table = i < count() ? arguments_[i].table() : nullptr;
  if (table) {
    if (count() != i + 1 || table->list.size() != 3 || !table->fields.empty())
      wrong("expected " + what + " {x, y, z}");
    const Call inner(session, command_, table->list, spoken);
    return {inner.number(0, -INFINITY, what), inner.number(1, -INFINITY, what),
            inner.number(2, -INFINITY, what)};
  }
  take(i + 3, i + 3);
  return {number(i, -INFINITY, what), number(i + 1, -INFINITY, what),
          number(i + 2, -INFINITY, what)};
}

int Call::particle(std::size_t i) const {
  const std::int64_t id = integer(i, 0, "a particle");
  const int n = session.live().system().particles();
  if (id >= n)
    wrong(n == 0 ? "a flat state has components, not particles"
                 : "there is no particle " + std::to_string(id) + ": ids run from 0 to " +
                       std::to_string(n - 1));
  return static_cast<int>(id);
}

}  // namespace sim::cli
