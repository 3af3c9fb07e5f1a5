// Commands about the scene, its settings and the session.
#include <cmath>

#include "cli/prompt/repl_actions.h"
#include "cli/prompt/repl_help.h"
#include "cli/verbs/list.h"
#include "core/base/error.h"
#include "core/base/stopwatch.h"
#include "core/base/text.h"
#include "core/output/format.h"

namespace sim::cli::actions {
namespace {

// NAME or NAME:PARAM=VALUE,..., then PARAM=VALUE or a table of Lua.
MethodChoice choice_of(const Call& call) {
  MethodChoice choice = parse_integrator(call.text(0, "a name"));
  for (std::size_t i = 1; i < call.count(); ++i) {
    if (const DataTable* table = call[i].table()) {
      for (const auto& [key, value] : table->fields) {
        const auto name = plain_text(key), setting = plain_text(value);
        if (!name || !setting) call.wrong("a parameter is a number, text, true or false");
        choice.given[*name] = *setting;
      }
      continue;
    }
    const std::string word = call.text(i, "PARAM=VALUE");
    const std::size_t equals = word.find('=');
    if (equals == std::string::npos || equals == 0)
      call.wrong("expected PARAM=VALUE, got " + lua_text(word));
    choice.given[word.substr(0, equals)] = word.substr(equals + 1);
  }
  return choice;
}

Data to_value(const Value& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return *flag;
  if (const auto* number = std::get_if<double>(&value)) return *number;
  return to_text(value);
}

Answer list_parameters(Session& session) {
  const std::vector<SceneArg>& args = session.live().scene().spec.args;
  std::vector<Data> list;
  std::vector<std::vector<std::string>> rows{{"name", "value", "default", "meaning"}};
  for (const SceneArg& arg : args) {
    list.emplace_back(std::vector<std::pair<Data, Data>>{{"name", arg.name},
                                                         {"value", to_value(arg.value)},
                                                         {"default", to_value(arg.default_value)},
                                                         {"meaning", arg.doc}});
    rows.push_back({arg.name, to_text(arg.value), to_text(arg.default_value), arg.doc});
  }
  return words(args.empty() ? "no parameters\n" : aligned(rows, ""), list);
}

Answer changed(Session& session, const std::vector<Change>& changes) {
  std::vector<Data> list;
  std::vector<std::vector<std::string>> rows;
  for (const Change& change : changes) {
    list.emplace_back(std::vector<std::pair<Data, Data>>{
        {"what", change.what}, {"before", change.before}, {"after", change.after}});
    rows.push_back({change.what, change.before + " -> " + change.after});
  }
  const std::string text = aligned(rows, "");
  return words(
      text.empty()
          ? "nothing changed: the same bits at t = " + brief(session.live().system().t()) + " s\n"
          : text,
      list);
}

}  // namespace

Answer integrator(Call& call) {
  LiveScene& live = call.session.live();
  if (call.count() > 0) {
    live.set_integrator(choice_of(call));
    put(call.session.console().err, limit_warning(live.system()));
    return {};
  }
  const MethodChoice& choice = live.system().method().choice();
  std::string text = choice.name;
  std::vector<std::pair<Data, Data>> fields{{"name", choice.name}};
  for (const auto& [name, value] : choice.given) {
    text += " " + name + "=" + to_text(value);
    fields.emplace_back(name, to_value(value));
  }
  return words(text + "\n", fields);
}

Answer dt(Call& call) {
  call.take(0, 1);
  LiveScene& live = call.session.live();
  if (call.count() == 0) return {live.system().h()};
  live.set_dt(call.seconds(0, -INFINITY, "a step size in s"));
  put(call.session.console().err, limit_warning(live.system()));
  return {};
}

Answer set(Call& call) {
  if (call.count() == 0) return list_parameters(call.session);
  call.take(2, 2);
  return changed(call.session, call.session.live().reload(std::pair{call.text(0, "a parameter"),
                                                                    call.text(1, "a value")}));
}

Answer reload(Call& call) {
  call.take(0, 0);
  return changed(call.session, call.session.live().reload({}));
}

Answer system(Call& call) {
  call.take(0, 1);
  LiveScene& live = call.session.live();
  const std::vector<std::string> names = live.scene().names();
  if (call.count() > 0) {
    const std::string name = call.text(0, "a system");
    for (std::size_t i = 0; i < names.size(); ++i)
      if (names[i] == name) {
        live.choose(i);
        return {};
      }
    throw Error(ErrorKind::kUsage, {"unknown system '" + name + "'", "",
                                    "the scene has no such system", suggestion(name, names)});
  }
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i)
    text += (i == live.current() ? "* " : "  ") + names[i] + "\n";
  return words(text, live.system().name());
}

Answer snap(Call& call) {
  call.take(1, 1);
  const std::string file = call.text(0, "a file");
  if (file == "-") call.wrong("a checkpoint needs a file");
  call.session.check_output(".snap", file);
  call.session.live().save(file);
  return {};
}

Answer resume(Call& call) {
  call.take(1, 1);
  call.session.live().resume(call.text(0, "a file"));
  return {};
}

Answer plugins(Call& call) {
  call.take(0, 1);
  Session& session = call.session;
  const std::string what = call.count() ? call.text(0, "a kind of plugins") : "";
  if (call.spoken) {
    list({what, session.mode == Mode::kJson}, session.environment(), session.registry(),
         session.console());
    return {};
  }
  std::vector<std::pair<Data, Data>> fields;
  for (const PluginKind& kind : kPluginKinds) {
    std::vector<Data> names;
    for (const std::string& plugin : session.registry().names(kind)) names.emplace_back(plugin);
    if (what == kind.folder) return {names};
    fields.emplace_back(std::string(kind.folder), names);
  }
  if (!what.empty()) call.wrong("there are " + plural_kinds());
  return {fields};
}

Answer mode(Call& call) {
  call.take(0, 1);
  Session& session = call.session;
  if (call.count() == 0)
    return words(std::string(mode_name(session.mode)) + "\n", mode_name(session.mode));
  const std::string name = call.text(0, "text, json or csv");
  for (const Mode known : {Mode::kText, Mode::kJson, Mode::kCsv})
    if (name == mode_name(known)) {
      session.mode = known;
      return {};
    }
  call.wrong("expected text, json or csv, got " + lua_text(name));
}

// The duration of a dot command is reported in words, for the output of CODE is the data.
Answer time(Call& call) {
  call.take(1, 1);
  Session& session = call.session;
  const auto steps = [&] {
    std::int64_t sum = 0;
    for (const Simulation& system : session.live().scene().systems) sum += system.step_count();
    return sum;
  };
  const double t = session.live().system().t();
  const std::int64_t before = steps();
  const Stopwatch watch;
  if (const auto* function = std::get_if<DataFunction>(&call[0].value)) {
    session.lua().call(*function);
  } else {
    session.run_line(call.text(0, "Lua code or a command"));
  }
  const double seconds = watch.seconds();
  if (!call.spoken) return {seconds};
  std::string text = brief(seconds, 3) + " s";
  if (const std::int64_t taken = steps() - before; taken > 0)
    text += ": " + counted(taken, "step") + ", " +
            brief(1e6 * seconds / static_cast<double>(taken), 3) + " us a step, " +
            brief((session.live().system().t() - t) / seconds, 3) + " x real time";
  put(session.console().err, text + "\n");
  return {};
}

Answer read(Call& call) {
  call.take(1, 1);
  call.session.read(call.text(0, "a file"));
  return {};
}

Answer help(Call& call) {
  call.take(0, 1);
  call.session.say(call.count() ? help_on(call.session, call.text(0, "a name")) : help_list());
  return {};
}

Answer quit(Call& call) {
  call.take(0, 0);
  call.session.exit_code = 0;
  return {};
}

}  // namespace sim::cli::actions
