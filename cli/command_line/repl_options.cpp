#include "cli/command_line/repl_options.h"

#include <CLI/CLI.hpp>
#include <limits>

#include "cli/command_line/manual_page.h"
#include "cli/command_line/option_values.h"
#include "cli/command_line/shell_completion.h"
#include "core/base/error.h"
#include "core/base/text.h"

namespace sim::cli {
namespace {

constexpr const char* kAbout =
    "simrepl                                a cloth, and a prompt\n"
    "simrepl scenes/pendulum.lua rk4 0.001  another scene, integrator and step in s\n"
    "simrepl -e .run -e 'energy().total'    two lines, no prompt\n"
    "echo .dump | simrepl                   a script; its data go to stdout\n\n"
    "A scene at a prompt of Lua and commands; .help lists them.";

constexpr const char* kReplFooter =
    "Without a terminal: no prompt, no banner; the first error ends with its code.\n"
    "Lines are kept in $XDG_STATE_HOME/sim/history (~/.local/state if not set).\n"
    "Exit codes, environment: as sim --help says.\n";

constexpr std::int64_t kMostHistory = std::int64_t{1} << 20;  // MB

}  // namespace

ReplCommandLine parse_repl_command_line(int argc, const char* const* argv) {
  std::string scene, integrator_word, dt_word, integrator, dt, tol, precision, seed, threads,
      history, mode, resume, record, init, lua_budget, completion;
  std::vector<std::string> set, off, plugin_path, load, codes, files;
  bool version = false, man = false, safe = false;
  ReplCommandLine line;
  CLI::App app{kAbout, "simrepl"};
  app.set_help_flag("-h,--help", "this text");
  app.get_formatter()->column_width(26);
  app.footer(kReplFooter);
  const auto word = [&](const char* name, std::string& text, const char* doc) {
    app.add_option(name, text, doc)->type_name("");
  };
  const auto value = [&](const char* names, std::string& text, const char* type, const char* doc) {
    app.add_option(names, text, doc)->type_name(type);
  };
  const auto values = [&](const char* names, std::vector<std::string>& texts, const char* type,
                          const char* doc) {
    return app.add_option(names, texts, doc)->type_name(type)->allow_extra_args(false);
  };
  word("SCENE", scene, "Lua file; scenes/cloth.lua if not given");
  word("INTEGRATOR", integrator_word, "as --integrator");
  word("DT", dt_word, "as --dt");
  const CLI::Option* code =
      values("-e,--execute", codes, "CODE", "Lua or a command, then stop; repeatable");
  values("-f,--file", files, "FILE", "the lines of a file, then stop; repeatable");
  value("-i,--integrator", integrator, "NAME[:PARAM=VALUE,...]", "instead of the scene's own");
  value("-d,--dt", dt, "TIME", "step size, in s or like 5ms");
  value("--tol", tol, "T", "tolerance of an adaptive integrator");
  value("--precision", precision, "P", "of a step: double, or single for half the time");
  values("-s,--set", set, "NAME=VALUE", "a parameter of the scene; repeatable");
  values("--off", off, "NAME", "a switch of the scene, off from the start; repeatable");
  value("--resume", resume, "FILE", "goes on from a checkpoint");
  value("--record", record, "FILE", "what is changed, line by line, for sim --replay");
  value("--mode", mode, "MODE", "text, json or csv: how values are printed");
  value("--init", init, "FILE",
        "lines for the start, or none; at a terminal $SIM_INIT\nor ~/.config/sim/init.lua if not "
        "given");
  value("--history", history, "MB", "of snapshots to go back to; 64 if not given");
  value("--seed", seed, "N", "of random numbers in the scene and at the prompt");
  value("-j,--threads", threads, "N",
        "or auto, if not given: as many as pay; the bits do\nnot depend on it");
  value("--lua-budget", lua_budget, "LIMITS",
        "of the scene's Lua and of each line:\ntime=10,memory=1024 (s, MB) if not given; also "
        "steps=N");
  app.add_flag("--safe", safe,
               "for a stranger's scene: no plugin of its own, no file\n"
               "outside its folder, time=2,memory=256")
      ->disable_flag_override();
  values("--plugin-path", plugin_path, "DIR", "folder of plugins; repeatable");
  values("--load", load, "FILE.so", "one plugin library; repeatable");
  app.add_flag("--probe", line.probe,
               "open plugins in a process of its own first, which\nthey may crash")
      ->disable_flag_override();
  app.add_flag("--version", version, "commit, compiler, plugin ABI and instruction set")
      ->disable_flag_override();
  app.add_flag("--man", man, "the manual page")->disable_flag_override();
  value("--completion", completion, "SHELL", "what Tab completes, for bash, zsh or fish");

  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    line.message = app.help();
    return line;
  } catch (const CLI::ParseError& error) {
    throw Error(ErrorKind::kUsage,
                {"bad command line", error.get_name(), error.what(), "see simrepl --help"});
  }
  if (man) {
    line.message = manual_page("simrepl", "a prompt over a scene", {{"DESCRIPTION", app.help()}});
    return line;
  }
  if (version) {
    line.message = version_line() + "\n";
    return line;
  }
  if (!completion.empty()) {
    line.message = shell_completion(command_spec(app), completion);
    return line;
  }
  SceneRequest& request = line.session.scene;
  if (!scene.empty()) request.scene = scene;
  request.settings = settings(set);
  request.off = off;
  request.safe = safe;
  request.lua = lua_limits(lua_budget, safe);
  request.integrator = parse_integrator(once(integrator, integrator_word));
  add_options(request.integrator, tol, precision, false);
  if (const std::string h = once(dt, dt_word); !h.empty()) request.dt = positive_time("--dt", h);
  if (!seed.empty())
    request.seed = static_cast<std::uint64_t>(
        integer_between("--seed", seed, 0, std::numeric_limits<std::int64_t>::max()));
  request.threads = threads_of(threads.empty() ? "auto" : threads);
  if (!history.empty())
    line.session.history =
        static_cast<std::size_t>(integer_between("--history", history, 1, kMostHistory)) << 20;
  for (const Mode known : {Mode::kText, Mode::kJson, Mode::kCsv})
    if (mode == mode_name(known)) line.mode = known;
  if (!mode.empty() && mode != mode_name(line.mode))
    throw Error(ErrorKind::kUsage, {"bad value", "--mode '" + mode + "'", "it is text, json or csv",
                                    "leave it out for text"});

  // Sources in the order of the command line.
  std::size_t next_code = 0, next_file = 0;
  for (const CLI::Option* option : app.parse_order()) {
    if (option == code)
      line.sources.push_back({false, codes[next_code++]});
    else if (option->check_name("--file"))
      line.sources.push_back({true, files[next_file++]});
  }
  line.resume = resume;
  line.record = record;
  if (!record.empty() && !resume.empty())
    throw Error(ErrorKind::kUsage, {"two beginnings", "--record and --resume",
                                    "a recording begins where the scene does", "keep one"});
  line.init = init;
  line.plugin_path.assign(plugin_path.begin(), plugin_path.end());
  line.libraries.assign(load.begin(), load.end());
  request.plugin_path = line.plugin_path;
  request.libraries = line.libraries;
  return line;
}

}  // namespace sim::cli
