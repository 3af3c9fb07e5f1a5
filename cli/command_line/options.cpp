#include "cli/command_line/options.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <limits>
#include <map>
#include <set>
#include <vector>

#include "cli/command_line/help_texts.h"
#include "cli/command_line/manual_page.h"
#include "cli/command_line/option_values.h"
#include "cli/command_line/out_options.h"
#include "cli/command_line/plugin_studies.h"
#include "cli/command_line/shell_completion.h"
#include "cli/command_line/study_options.h"
#include "cli/command_line/texts.h"
#include "cli/command_line/verb_words.h"
#include "cli/verbs/explain.h"
#include "core/base/error.h"
#include "core/base/text.h"

namespace sim::cli {
namespace {

class Parser {
 public:
  explicit Parser(const KnownStudies& studies);

  CommandLine parse(int argc, const char* const* argv);

 private:
  CLI::Option* value(const std::string& names, std::string& text, const std::string& type,
                     const std::string& doc);
  CLI::Option* values(const std::string& names, std::vector<std::string>& texts,
                      const std::string& type, const std::string& doc);
  CLI::App* verb(const std::string& name, const std::string& doc);

  std::vector<std::string> verb_names() const;
  void check_verb(const CLI::App& chosen) const;
  SceneRequest scene_request(const std::string& scene, const std::string& threads = "1") const;
  RunRequest run_request() const;
  AdjacencyRequest adjacency_request() const;
  RestRequest rest_request() const;
  StudyBase study_base() const;
  PlotRequest plot_request() const;
  std::string manual() const;

  CLI::App app_{kExamples, "sim"};
  Texts texts_;
  CLI::App *adjacency_, *list_, *describe_, *doctor_, *explain_, *test_, *plugin_, *scene_, *plot_,
      *view_, *rest_, *export_, *import_;
  StudyOptions studies_;
  PluginStudies plugin_studies_;
  std::vector<std::string> study_names_;
  std::vector<CLI::Option*> run_only_;
  std::map<const CLI::App*, std::set<std::string>> takes_;  // ... that other verbs take, too
};

CLI::Option* Parser::value(const std::string& names, std::string& text, const std::string& type,
                           const std::string& doc) {
  return app_.add_option(names, text, doc)->type_name(type);
}

CLI::Option* Parser::values(const std::string& names, std::vector<std::string>& texts,
                            const std::string& type, const std::string& doc) {
  return app_.add_option(names, texts, doc)->type_name(type)->allow_extra_args(false);
}

CLI::App* Parser::verb(const std::string& name, const std::string& doc) {
  CLI::App* app = app_.add_subcommand(name, doc);
  app->fallthrough()->allow_extras();
  app->footer("It takes --json, --set, --seed, --plugin-path and --load, as in sim --help.\n");
  app->get_formatter()->column_width(26);
  return app;
}

Parser::Parser(const KnownStudies& studies) : study_names_(studies.names) {
  Texts& t = texts_;
  app_.allow_extras()->require_subcommand(0, 1);
  app_.set_help_flag("-h,--help", "this text");
  app_.get_formatter()->column_width(26);
  app_.get_formatter()->label("TEXT", "");
  app_.footer(kFooter);
  run_only_ = {
      app_.add_option("SCENE", t.scene, "Lua file; scenes/cloth.lua if not given")->type_name(""),
      app_.add_option("INTEGRATOR", t.integrator_word, "as --integrator")->type_name(""),
      app_.add_option("DT", t.dt_word, "as --dt")->type_name(""),
      values("-i,--integrator", t.integrator, "NAME",
             "instead of the scene's own; with parameters:\nNAME:PARAM=VALUE,PARAM=VALUE"),
      values("-d,--dt", t.dt, "TIME",
             "step size, in s or like 5ms; if adaptive, time between\nstates"),
      value("--tol", t.tol, "T", "tolerance of an adaptive integrator"),
      value("--precision", t.precision, "P", "of a step: double, or single for half the time"),
      app_.add_flag("--fixed-step", t.fixed_step, "steps of size dt, adaptive or not")
          ->disable_flag_override(),
      value(
          "--error", t.error, "E",
          "instead of a step: \"1 mm\", or 1% of the size. Chooses\nmethod and step that keep it, "
          "within -i and -d; of\n--of, if that is given"),
      app_.add_flag("--until-horizon", t.until_horizon,
                    "... and ends where chaos or contact lets none be kept")
          ->disable_flag_override(),
      value("-T,--time", t.time, "TIME", "simulated time, as --dt; the scene's if not given"),
      value("-n,--steps", t.steps, "N", "or a number of steps; 0 = the initial frame"),
      value("--debug-particle", t.debug_particle, "I",
            "its springs, then stop unless --time or\n--steps is given; NAME:I in a world"),
      value("--energy", t.energy, "[=FILE]",
            "table of energies, or .svg; no FILE = standard output"),
      value("--dump", t.dump, "[=FILE]", "table of states; no FILE = standard output"),
      value("--observe", t.observe, "[=FILE]", "table of what the scene observes"),
      value("--tension", t.tension, "[=FILE]", "table of the forces of constraints"),
      values("--of", t.of, "WHAT",
             "of what the scene observes, for the whole run:\n\"mean sag\", max, min, period; "
             "\"late mean sag\" of\nits second half; judged by studies; repeatable"),
      value("--every", t.every, "N", "frames of the files: each N-th step"),
      value("--snap", t.snap, "FILE",
            "a checkpoint every 15 minutes and at the end; what\nstood there before is FILE.prev"),
      value("--snap-every", t.snap_every, "TIME", "... as often as that: 30s, 5min, 1h"),
      value("--resume", t.resume, "FILE",
            "goes on from one, bit for bit; --time and --steps\n"
            "count from the start of the first run"),
      value("--replay", t.replay, "FILE",
            "repeats what hands did, with the same bits:\na file of sim view --record"),
      app_.add_flag("--from-rest", t.from_rest,
                    "starts where the scene comes to rest, see sim rest")
          ->disable_flag_override(),
      value("--check", t.check, "LIMITS", "exit 8 if not: verified,energy=1%,strain=20%,dt=90%"),
      app_.add_flag("--verify", t.verify,
                    "run it again with half the step to the end, however\n"
                    "long that takes; else where a core is free, or the\n"
                    "run takes less than 1 s")
          ->disable_flag_override(),
      value("--verify-time", t.verify_time, "TIME",
            "... and where no core is free for so long, or such a\n"
            "share of the run's time: 1min, 50%; 1s if not given"),
      app_.add_flag("--no-verify", t.no_verify, "do not, however little it takes")
          ->disable_flag_override(),
      value("--progress", t.progress, "WHEN", "auto, on or off; auto = on a terminal"),
      app_.add_flag("-q,--quiet", t.quiet, "errors, and a verdict other than trusted")
          ->disable_flag_override()};
  for (CLI::Option* option : add_out_options(app_, t.out)) run_only_.push_back(option);
  for (CLI::Option* option : add_engine_options(app_, t.engine)) run_only_.push_back(option);
  values("-s,--set", t.set, "NAME=VALUE", "a parameter of the scene; repeatable");
  values("--off", t.off, "NAME", "a switch of the scene, off from the start; repeatable");
  values("--without", t.without, "NAME",
         "leave out a force, collider or spring family;\nrepeatable");
  value("--seed", t.seed, "N", "of random numbers in the scene");
  value("-j,--threads", t.threads, "N",
        "or auto: as many as pay. auto for a run if not given,\nelse 1; the bits do not depend on "
        "it");
  app_.add_flag("--json", t.json, "the report as JSON on standard output")->disable_flag_override();
  value("--lua-budget", t.lua_budget, "LIMITS",
        "of a scene's Lua in the whole run: time=60,\n"
        "memory=1024 (s, MB), steps=N; not given: 10 s a call");
  app_.add_flag("--safe", t.safe,
                "for a stranger's scene: no plugin of its own, no file\n"
                "outside its folder, time=10,memory=256, 1 MB of print")
      ->disable_flag_override();
  values("--plugin-path", t.plugin_path, "DIR", "folder of plugins; repeatable");
  values("--load", t.load, "FILE.so", "one plugin library; repeatable");
  app_.add_flag("--probe", t.probe,
                "open plugins in a process of its own first, which\nthey may crash")
      ->disable_flag_override();
  app_.add_flag("--version", t.version, "commit, compiler, plugin ABI and instruction set")
      ->disable_flag_override();
  app_.add_flag("--man", t.man, "the manual page")->disable_flag_override();
  value("--completion", t.completion, "SHELL", "what Tab completes, for bash, zsh or fish");

  adjacency_ = verb("adjacency", "SCENE I: the springs attached to particle I");
  adjacency_->add_option("SCENE", t.adjacency_scene, "Lua file")->type_name("");
  adjacency_->add_option("I", t.adjacency_particle, "particle; NAME:I in a world")->type_name("");
  rest_ = verb("rest", "SCENE: where it comes to rest, and what force is left");
  rest_->add_option("SCENE", t.rest_scene, "Lua file; takes --dump[=FILE]")->type_name("");
  list_ = verb("list", "[integrators|forces|..|scenes]: what there is");
  list_
      ->add_option("WHAT", t.list_what,
                   "integrators, forces, fields, colliders, motions,\nlaws, constraints or scenes")
      ->type_name("");
  list_->add_flag("--luacats", t.luacats, "types of all that for editors: LuaCATS")
      ->disable_flag_override();
  list_->add_flag("--names", t.names, "names alone, one a line")->disable_flag_override();
  list_->add_flag("--markdown", t.markdown, "the scene language and every plugin, as a page")
      ->disable_flag_override();
  describe_ = verb("describe", "NAME: a plugin, a scene or a function of scenes");
  describe_->add_option("NAME", t.describe_name, "plugin, scene, or a name like sim.grid")
      ->type_name("");
  doctor_ = verb("doctor", "is everything there that a run needs?");
  explain_ = verb("explain", "verdict: what each clause of it means");
  explain_->add_option("WHAT", t.explained, "verdict")->type_name("");
  test_ = verb("test", "PLUGIN.so: does it keep what the interface promises?");
  test_->add_option("PLUGIN.so", t.test_library, "the library; exit 7 when a check fails")
      ->type_name("");
  plugin_ = verb("plugin", "new KIND NAME: a folder to start a plugin from");
  plugin_->add_option("new", t.plugin_words[0], "the word new; or flags: what g++ needs")
      ->type_name("");
  plugin_
      ->add_option("KIND", t.plugin_words[1],
                   "force, field, integrator, constraint, collider,\nmotion, law or study")
      ->type_name("");
  plugin_->add_option("NAME", t.plugin_words[2], "of the plugin and its folder")->type_name("");
  scene_ = verb("scene", "new NAME: a folder to start a scene from");
  scene_->add_option("new", t.scene_words[0], "the word new")->type_name("");
  scene_->add_option("NAME", t.scene_words[1], "of the scene and its folder")->type_name("");
  studies_.add_to(app_);
  plot_ = verb("plot", "TABLE.csv: one column over another, as .svg");
  plot_->footer("Example: sim plot runs.csv -x dt -y error --by integrator --out runs.svg\n");
  plot_->add_option("TABLE.csv", t.plot.table, "names in its first row")->type_name("");
  plot_->add_option("-x", t.plot.x, "column")->type_name("NAME");
  plot_->add_option("-y", t.plot.y, "column")->type_name("NAME");
  plot_->add_option("--by", t.plot.by, "a curve for each value of this column")->type_name("NAME");
  export_ = add_export(app_, t.engine);
  import_ = add_import(app_, t.engine);
  view_ = add_view_options(app_, t.view);
  takes_ = {{plot_, {"--out"}},
            {export_, {export_takes().begin(), export_takes().end()}},
            {import_, {import_takes().begin(), import_takes().end()}},
            {view_, {"--integrator", "--dt"}},
            {rest_, {"--dump", "--quiet"}}};
  plugin_studies_.add_to(app_, studies.opened);
}

std::vector<std::string> Parser::verb_names() const {
  std::vector<std::string> names;
  for (const CLI::App* each : app_.get_subcommands({})) names.push_back(each->get_name());
  for (const std::string& study : study_names_)
    if (std::ranges::find(names, study) == names.end()) names.push_back(study);
  return names;
}

// Options of a run are refused by the other verbs.
void Parser::check_verb(const CLI::App& chosen) const {
  for (const CLI::Option* option : run_only_) {
    if (option->count() == 0) continue;
    if (studies_.takes(&chosen, option->get_name())) continue;
    if (plugin_studies_.takes(&chosen, option->get_name())) continue;
    const auto own = takes_.find(&chosen);
    if (own != takes_.end() && own->second.contains(option->get_name())) continue;
    const bool positional = option->get_positional();
    usage_error(positional ? "unexpected argument" : "option of a run",
                positional ? "'" + option->results().front() + "'" : option->get_name(),
                "sim " + chosen.get_name() + " does not take it",
                "see sim " + chosen.get_name() + " --help");
  }
}

SceneRequest Parser::scene_request(const std::string& scene, const std::string& threads) const {
  SceneRequest request;
  if (!scene.empty()) request.scene = scene;
  request.settings = settings(texts_.set);
  request.off = texts_.off;
  request.without = texts_.without;
  request.safe = texts_.safe;
  request.plugin_path = {texts_.plugin_path.begin(), texts_.plugin_path.end()};
  request.libraries = {texts_.load.begin(), texts_.load.end()};
  request.lua = lua_limits(texts_.lua_budget, texts_.safe);
  if (!texts_.seed.empty())
    request.seed = static_cast<std::uint64_t>(
        integer_between("--seed", texts_.seed, 0, std::numeric_limits<std::int64_t>::max()));
  request.threads = threads_of(texts_.threads.empty() ? threads : texts_.threads);
  return request;
}

RunRequest Parser::run_request() const {
  const Texts& t = texts_;
  for (const std::string& word : {t.scene, t.integrator_word, t.dt_word})
    if ((!t.energy.empty() || !t.dump.empty() || !t.observe.empty() || !t.tension.empty()) &&
        (word.ends_with(".csv") || word.ends_with(".jsonl")))
      usage_error("unexpected argument", "'" + word + "'", "a table takes its file behind =",
                  "write --dump=" + word + " or --energy=" + word);
  RunRequest request;
  request.scene = scene_request(t.scene, "auto");
  request.scene.integrator =
      parse_integrator(once(only("--integrator", t.integrator), t.integrator_word));
  add_options(request.scene.integrator, t.tol, t.precision, t.fixed_step);
  if (const std::string dt = once(only("--dt", t.dt), t.dt_word); !dt.empty())
    request.scene.dt = positive_time("--dt", dt);
  if (!t.time.empty() && !t.steps.empty())
    usage_error("two lengths of a run", "--time and --steps", "only one of them can hold",
                "keep one of them");
  if (!t.time.empty()) request.time = non_negative_time("--time", t.time);
  if (!t.steps.empty()) request.steps = integer_between("--steps", t.steps, 0, kMostSteps);
  if (!t.every.empty())
    request.every =
        integer_between("--every", t.every, 1, std::numeric_limits<std::int64_t>::max());
  if (!t.debug_particle.empty())
    request.debug_particle = particle_choice("--debug-particle", t.debug_particle);
  if (!t.energy.empty()) request.energy = parse_target("--energy", t.energy, true);
  if (!t.dump.empty()) request.dump = parse_target("--dump", t.dump);
  if (!t.observe.empty()) request.observe = parse_target("--observe", t.observe);
  if (!t.tension.empty()) request.tension = parse_target("--tension", t.tension);
  if (!t.snap.empty()) request.snap = checkpoint_name("--snap", t.snap);
  if (!t.snap_every.empty()) request.snap_every = wall_time("--snap-every", t.snap_every);
  if (!t.resume.empty()) request.resume = t.resume;
  if (!t.replay.empty()) {
    request.replay = t.replay;
    request.scene.scene = t.scene;  // or that of the recording
    if (request.time || request.steps || request.resume || request.debug_particle)
      usage_error("no length of its own", "--replay with --time, --steps, --resume or the like",
                  "a replay is as long as its recording", "leave the other out");
  }
  request.from_rest = t.from_rest;
  if (!t.error.empty()) request.error = study::parse_budget("--error", t.error);
  request.until_horizon = t.until_horizon;
  request.of = t.of;
  if (t.verify && t.no_verify)
    usage_error("two wishes", "--verify and --no-verify", "only one can hold", "keep one");
  request.verify.wish = t.verify      ? study::Verify::kAlways
                        : t.no_verify ? study::Verify::kNever
                                      : study::Verify::kQuick;
  if (!t.verify_time.empty()) allow(request.verify, "--verify-time", t.verify_time);
  request.json = t.json;
  request.quiet = t.quiet;
  if (!t.check.empty()) request.checks = parse_checks("--check", t.check);
  request.progress = show_progress(texts_.progress);
  complete_engine(request, t.engine);
  request.out = out_request(t.out, request.every);
  if (request.out.any() && !request.time && !request.steps && request.debug_particle)
    usage_error("no run to make files of", "--debug-particle with --out",
                "--debug-particle alone stops before the first step", "add --time or --steps");
  return request;
}

StudyBase Parser::study_base() const {
  StudyBase base{scene_request(""), texts_.integrator, texts_.dt, texts_.time, texts_.out};
  base.tol = texts_.tol;
  base.steps = texts_.steps;
  base.check = texts_.check;
  base.of = texts_.of;
  base.verify = !texts_.no_verify;
  base.json = texts_.json;
  base.progress = show_progress(texts_.progress);
  return base;
}

std::string Parser::manual() const {
  std::vector<ManualSection> sections{{"DESCRIPTION", app_.help()}};
  for (const CLI::App* verb : app_.get_subcommands({}))
    sections.push_back({"sim " + verb->get_name(), verb->help("sim")});
  return manual_page("sim", "steps particle systems and says how wrong they are", sections);
}

PlotRequest Parser::plot_request() const {
  PlotRequest request = texts_.plot;
  if (request.table.empty() || request.x.empty() || request.y.empty())
    usage_error("argument missing", "sim plot", "it needs a table and two columns",
                "as in: sim plot runs.csv -x dt -y error");
  request.out = one_file(texts_.out, ".svg", "a chart is .svg");
  return request;
}

AdjacencyRequest Parser::adjacency_request() const {
  if (texts_.adjacency_scene.empty() || texts_.adjacency_particle.empty())
    usage_error("argument missing", "sim adjacency", "it needs a scene and a particle",
                "as in: sim adjacency scenes/cloth.lua 12");
  return {scene_request(texts_.adjacency_scene),
          particle_choice("sim adjacency", texts_.adjacency_particle), texts_.json};
}

RestRequest Parser::rest_request() const {
  RestRequest request{.scene = scene_request(texts_.rest_scene, "auto"),
                      .dump = {},
                      .json = texts_.json,
                      .quiet = texts_.quiet};
  if (!texts_.dump.empty()) request.dump = parse_target("--dump", texts_.dump);
  return request;
}

CommandLine Parser::parse(int argc, const char* const* argv) {
  try {
    app_.parse(command_words(asked_for_help({argv + 1, argv + argc}, verb_names())));
  } catch (const CLI::CallForHelp&) {
    const auto chosen = app_.get_subcommands();
    return {Message{chosen.empty() ? app_.help() : chosen.front()->help("sim")}, {}, {}};
  } catch (const CLI::ParseError& error) {
    usage_error("bad command line", error.get_name(), error.what(), "see sim --help");
  }
  check_words(app_.remaining(true), command_spec(app_),
              nearest_verb(app_, study_names_, texts_.scene));
  for (const CLI::Option* option : app_.get_options())
    for (const std::string& result : option->results())
      if (result.empty())
        usage_error("empty value", option->get_name(), "it was given as ''", "give a value");
  if (texts_.version) return {Message{version_line() + "\n"}, {}, {}};
  if (texts_.man) return {Message{manual()}, {}, {}};
  if (!texts_.completion.empty())
    return {Message{shell_completion(command_spec(app_), texts_.completion)}, {}, {}};

  CommandLine line;
  line.plugin_path.assign(texts_.plugin_path.begin(), texts_.plugin_path.end());
  line.libraries.assign(texts_.load.begin(), texts_.load.end());
  line.probe = texts_.probe;
  const auto chosen = app_.get_subcommands();
  if (chosen.empty()) {
    check_for_verb(texts_.scene, nearest_verb(app_, study_names_, texts_.scene));
    line.request = run_request();
    return line;
  }
  check_verb(*chosen.front());
  if (chosen.front() == adjacency_) {
    line.request = adjacency_request();
  } else if (chosen.front() == rest_) {
    line.request = rest_request();
  } else if (chosen.front() == list_) {
    line.request = ListRequest{.what = texts_.list_what,
                               .json = texts_.json,
                               .luacats = texts_.luacats,
                               .names = texts_.names,
                               .markdown = texts_.markdown};
  } else if (chosen.front() == describe_) {
    if (texts_.describe_name.empty())
      usage_error("argument missing", "sim describe", "it needs a name",
                  "'sim list' shows all names");
    line.request = DescribeRequest{texts_.describe_name, scene_request(""), texts_.json,
                                   argc > 1 && argv[1] == std::string_view("help")
                                       ? verb_names()
                                       : std::vector<std::string>()};
  } else if (chosen.front() == explain_) {
    line.request = Message{explanation(texts_.explained)};
  } else if (chosen.front() == test_) {
    if (texts_.test_library.empty())
      usage_error("argument missing", "sim test", "it needs a plugin library",
                  "as in: sim test wind.so");
    line.request = TestRequest{texts_.test_library, texts_.json};
  } else if (chosen.front() == plugin_) {
    line.request = new_plugin_request(texts_.plugin_words);
  } else if (chosen.front() == scene_) {
    line.request = new_scene_request(texts_.scene_words);
  } else if (chosen.front() == plot_) {
    line.request = plot_request();
  } else if (chosen.front() == import_) {
    if (imports_results(texts_.engine))
      line.request = results_request(texts_.engine, run_request());
    else
      line.request = import_request(texts_.engine, run_request(), texts_.out);
  } else if (chosen.front() == export_) {
    texts_.scene = texts_.engine.scene;
    line.request = export_request(texts_.engine, run_request());
  } else if (chosen.front() == view_) {
    SceneRequest scene = scene_request(texts_.view.scene, "auto");
    if (const std::string dt = only("--dt", texts_.dt); !dt.empty())
      scene.dt = positive_time("--dt", dt);
    line.request = view_request(texts_.view, std::move(scene), texts_.integrator);
  } else if (plugin_studies_.has(chosen.front())) {
    line.request = plugin_studies_.request(chosen.front(), study_base());
  } else if (studies_.has(chosen.front())) {
    std::visit([&](auto&& request) { line.request = std::forward<decltype(request)>(request); },
               studies_.request(chosen.front(), study_base()));
  } else {
    line.request = DoctorRequest{line.libraries, texts_.json};
  }
  return line;
}

}  // namespace

CommandLine parse_command_line(int argc, const char* const* argv, const KnownStudies& studies) {
  return Parser(studies).parse(argc, argv);
}

}  // namespace sim::cli
