#include "cli/command_line/study_options.h"

#include "cli/command_line/option_values.h"
#include "core/output/format.h"

namespace sim::cli {
namespace {

constexpr const char* kStabilityFooter =
    "Keys of --json, one object a system ({\"systems\":[..]} for a world):\n"
    "  system, t, omega_max (rad/s; of first order the largest rate, 1/s), damping,\n"
    "  residual, bound, growth (1/s, of the system itself), decay (1/s), particles:\n"
    "  [particle, share], families: [family, share] (of the fastest mode),\n"
    "  integrator, dt, energy_time, complete, integrators: [name, order,\n"
    "  predicted_dt, measured_dt (s; 0: none is stable, null: any is, or not known),\n"
    "  limit (step, none stable, unlimited, own steps, unknown), radius (growth in\n"
    "  one step of dt), energy: [fraction, dt, error], late (not all were run)]\n";

constexpr const char* kOrderFooter =
    "Keys of --json, one object a system ({\"systems\":[..]} for a world):\n"
    "  system, time, of, figure, size, reference: {how, error}, complete,\n"
    "  integrators: [name, order, observed (null: no three steps agree),\n"
    "  standard_error, constant, keeps,\n"
    "  points: [dt, tol, error, finished, evaluations]]\n"
    "  error: rms over the free coordinates, the largest of all steps; or of --of.\n";

constexpr const char* kTradeoffFooter =
    "Keys of --json, one object a system ({\"systems\":[..]} for a world):\n"
    "  system, time, of (null: positions), figure (of --of), size, budget,\n"
    "  comparable (s), reference: {how, error}, growth, omega_max, complete,\n"
    "  recommended, cheapest: {integrator, dt or tol, error, evaluations, command},\n"
    "  refused: [the same], within the budget, but their runs are suspect or worse;\n"
    "  recommended and refused were run: verdict, reason of each,\n"
    "  integrators: [name, order, observed, limit, points: [dt, tol, status, error,\n"
    "  relative, error_end, max_end, worst, energy, phi, phi_rate (of constraints),\n"
    "  steps, evaluations, newton, factorisations, linear, cost, seconds, spread,\n  front]]\n"
    "  error: rms over what is compared, the largest of all steps; of a figure (--of\n"
    "  \"mean sag\") how far it is off, and off with all finer steps.\n";

constexpr const char* kCompareFooter =
    "Examples:\n"
    "  sim compare scenes/cloth.lua -i rk4 -i verlet -i implicit_euler --out c.mp4\n"
    "  sim compare scenes/cloth.lua -i rk4 -d 0.01 -i rk4 -d 0.005\n"
    "  sim compare scenes/pendulum.lua -T 2 --of \"mean sag\"\n"
    "One --dt holds for all methods, several for one each, in their order. A file of\n"
    "--out has a panel of each at equal times, coloured by its error.\n"
    "Keys of --json, one object:\n"
    "  system, time, size, frames, reference: {how, error}, judged: {of, figure,\n"
    "  error} (of --of, or null), methods: [integrator, dt, steps, evaluations,\n"
    "  seconds, error, error_end, most, judged, off, diverged_at (s)]\n"
    "  error: rms of positions, the largest of all frames; most: of one particle;\n"
    "  off: of what --of says, of a quantity the largest of all frames.\n";

constexpr const char* kSweepFooter =
    "Examples:\n"
    "  sim sweep scenes/cloth.lua --over integrator=rk4,verlet\n"
    "      --over dt=0.001:0.01:log6 --out runs.csv -j 2\n"
    "  sim sweep scenes/gas.lua --over seed=1..20 -T 1 --out gas.csv\n"
    "NAME is integrator, dt, tol, time, steps, seed or an argument of the scene.\n"
    "Several --over are a product, the last one fastest. Cases that are done are kept\n"
    "in OUT.cases, so that a sweep goes on where it was ended, as long as the program\n"
    "and all files that were read for a case are the same; cases that failed are\n"
    "tried again. Rows are the same whatever the order, -j and --part, but for\n"
    "seconds.\n"
    "Columns: case, the names, exit, verdict, reason, steps, evaluations, t, kinetic,\n"
    "  potential, total, drift, energy (drift over that in play), dt_share, strain,\n"
    "  step_error, error (of positions: against the exact solution, or verified),\n"
    "  hash, what the scene observes, seconds. Empty: not known.\n"
    "Many machines: sim sweep .. --part $I/100 on each, then sim sweep .. --collect\n"
    "Exit code 9: a case failed; one that diverged did not.\n";

}  // namespace

void StudyOptions::scene_of(CLI::App* verb) {
  verb->add_option("SCENE", scene_, "Lua file; scenes/cloth.lua if not given")->type_name("");
}

void StudyOptions::budget_of(CLI::App* verb, const std::string& doc) {
  verb->add_option("--budget", budget_, doc)->type_name("E");
}

CLI::App* StudyOptions::study(CLI::App& app, const std::string& name, const std::string& doc,
                              const std::string& footer, const std::set<std::string>& taken) {
  CLI::App* verb = app.add_subcommand(name, doc);
  verb->fallthrough()->allow_extras();
  std::string own;
  for (const std::string& option : taken)
    if (option != "--progress") own += option + ", ";
  own +=
      "--progress, --json, --set, --seed, --without, --plugin-path and --load, as in sim --help.";
  verb->footer(wrapped("It takes " + own, 0) + "\n" + footer);
  verb->get_formatter()->column_width(26);
  taken_[verb] = taken;
  return verb;
}

void StudyOptions::add_to(CLI::App& app) {
  const auto integrators = [&](CLI::App* verb) {
    verb->add_option("--integrators", integrators_,
                     "only these, with parameters as for -i; all that fit\nif not given")
        ->type_name("A,B,..");
  };
  stability_ = study(app, "stability", "SCENE: fastest vibration, largest stable steps",
                     kStabilityFooter, {"--integrator", "--dt", "--progress"});
  scene_of(stability_);
  integrators(stability_);
  stability_->add_option("--at", at_, "look at the state of the run at that time, in s")
      ->type_name("S");
  stability_->add_option("--svg", svg_, "plot of the largest stable steps")->type_name("FILE");
  stability_
      ->add_flag("--extremes", extremes_,
                 "no scene, but a spring at all extremes of\nstiffness, mass, dt and offset")
      ->disable_flag_override();

  tradeoff_ = study(app, "tradeoff", "SCENE: speed against accuracy, and which to take",
                    kTradeoffFooter, {"--time", "--of", "--progress"});
  scene_of(tradeoff_);
  integrators(tradeoff_);
  budget_of(tradeoff_, "error allowed: 1% of the size (or of the range of\n--of), \"1 mm\", 1e-3");
  tradeoff_->add_option("--csv", csv_, "table of every point, .csv or .jsonl")->type_name("FILE");
  tradeoff_->add_option("--svg", svg_, "plot of error against cost")->type_name("FILE");

  order_ = study(app, "order", "[INTEGRATOR] [SCENE]: observed order of convergence", kOrderFooter,
                 {"--time", "--of", "--progress"});
  order_->add_option("INTEGRATOR", words_[0], "as for -i; all that fit if not given")
      ->type_name("");
  order_->add_option("SCENE", words_[1], "Lua file; the two in either order")->type_name("");
  integrators(order_);

  compare_ =
      study(app, "compare", "SCENE: methods side by side, each with its error", kCompareFooter,
            {"--integrator", "--dt", "--time", "--out", "--fps", "--color", "--springs", "--trail",
             "--wireframe", "--surface", "--camera", "--size", "--of", "--progress"});
  scene_of(compare_);

  sweep_ = study(app, "sweep", "SCENE: one scene many times, a row of a table each", kSweepFooter,
                 {"--integrator", "--dt", "--tol", "--time", "--steps", "--of", "--check",
                  "--no-verify", "--out", "--progress"});
  scene_of(sweep_);
  sweep_
      ->add_option(
          "--over", over_,
          "values of a name: NAME=a,b,c, NAME=LO:HI:linN,\nNAME=LO:HI:logN or NAME=LO..HI; "
          "repeatable")
      ->type_name("NAME=VALUES")
      ->allow_extra_args(false);
  sweep_->add_option("--cases", cases_, "or a CSV file: names, then a row a case")
      ->type_name("FILE");
  sweep_->add_option("--part", part_, "only cases I, I + M, I + 2 M ..; no table")
      ->type_name("I/M");
  sweep_->add_option("--timeout", timeout_, "of a case, in s")->type_name("S");
  sweep_->add_flag("--keep-failed", keep_failed_, "do not try again cases that failed")
      ->disable_flag_override();
  sweep_->add_flag("--list", list_, "the cases, without a run")->disable_flag_override();
  sweep_->add_flag("--collect", collect_, "the table of the cases that are done")
      ->disable_flag_override();
}

bool StudyOptions::takes(const CLI::App* verb, const std::string& option) const {
  const auto taken = taken_.find(verb);
  return taken != taken_.end() && taken->second.contains(option);
}

SceneRequest StudyOptions::named_scene(const StudyBase& base) const {
  SceneRequest scene = base.scene;
  if (!scene_.empty()) scene.scene = scene_;
  return scene;
}

SceneRequest StudyOptions::stepped_scene(const StudyBase& base) const {
  SceneRequest scene = named_scene(base);
  scene.integrator = parse_integrator(only("--integrator", base.integrators));
  if (const std::string dt = only("--dt", base.dts); !dt.empty())
    scene.dt = positive_time("--dt", dt);
  return scene;
}

StudyOptions::Request StudyOptions::request(const CLI::App* verb, const StudyBase& base) const {
  if (verb == stability_) return stability(base);
  if (verb == order_) return order(base);
  if (verb == tradeoff_) return tradeoff(base);
  if (verb == compare_) return compare(base);
  return sweep(base);
}

StabilityRequest StudyOptions::stability(const StudyBase& base) const {
  StabilityRequest request;
  request.scene = stepped_scene(base);
  request.extremes = extremes_;
  if (extremes_ && !scene_.empty())
    usage_error("two things to study", "--extremes and '" + scene_ + "'",
                "--extremes has a scene of its own", "keep one of them");
  if (!at_.empty()) request.at = non_negative_time("--at", at_);
  request.integrators = parse_integrators("--integrators", integrators_);
  if (!svg_.empty()) request.svg = svg_;
  if (extremes_ && request.svg)
    usage_error("no plot", "--svg with --extremes", "it is one of a scene",
                "leave out one of them");
  request.json = base.json;
  request.progress = base.progress;
  return request;
}

OrderRequest StudyOptions::order(const StudyBase& base) const {
  OrderRequest request;
  request.scene = base.scene;
  for (const std::string& word : words_)
    if (!word.empty()) request.words.push_back(word);
  request.integrators = parse_integrators("--integrators", integrators_);
  if (!base.time.empty()) request.time = positive_time("--time", base.time);
  request.of = only("--of", base.of);
  request.json = base.json;
  request.progress = base.progress;
  return request;
}

TradeoffRequest StudyOptions::tradeoff(const StudyBase& base) const {
  TradeoffRequest request;
  request.scene = named_scene(base);
  if (!budget_.empty()) request.budget = study::parse_budget("--budget", budget_);
  request.of = only("--of", base.of);
  if (!base.time.empty()) request.time = positive_time("--time", base.time);
  request.integrators = parse_integrators("--integrators", integrators_);
  if (!csv_.empty()) request.csv = parse_target("--csv", csv_);
  if (!svg_.empty()) request.svg = svg_;
  request.json = base.json;
  request.progress = base.progress;
  if (request.csv && request.csv->standard_output() && request.json)
    usage_error("two kinds of data for standard output", "--json with --csv -",
                "the study and the table would mix", "give the table a file");
  return request;
}

CompareRequest StudyOptions::compare(const StudyBase& base) const {
  CompareRequest request;
  request.scene = named_scene(base);
  const std::size_t steps = base.dts.size(), methods = std::max(base.integrators.size(), steps);
  if (steps > 1 && base.integrators.size() > 1 && steps != base.integrators.size())
    usage_error("steps without methods", std::to_string(steps) + " times --dt",
                std::to_string(base.integrators.size()) + " times --integrator",
                "give one --dt for all, or one for each");
  for (std::size_t i = 0; i < methods; ++i) {
    ComparedMethod method;
    if (!base.integrators.empty())
      method.integrator =
          parse_integrator(base.integrators[std::min(i, base.integrators.size() - 1)]);
    if (steps > 0) method.dt = positive_time("--dt", base.dts[steps == 1 ? 0 : i]);
    request.methods.push_back(method);
  }
  if (!base.time.empty()) request.time = positive_time("--time", base.time);
  request.out = out_request(base.out, {});
  request.of = only("--of", base.of);
  request.json = base.json;
  request.progress = base.progress;
  return request;
}

SweepRequest StudyOptions::sweep(const StudyBase& base) const {
  SweepRequest request;
  request.scene = stepped_scene(base);
  add_options(request.scene.integrator, base.tol, "", false);
  if (!base.time.empty() && !base.steps.empty())
    usage_error("two lengths of a run", "--time and --steps", "only one of them can hold",
                "keep one of them");
  if (!base.time.empty()) request.length.time = positive_time("--time", base.time);
  if (!base.steps.empty())
    request.length.steps = integer_between("--steps", base.steps, 0, kMostSteps);
  if (!base.check.empty()) request.checks = parse_checks("--check", base.check);
  request.over = over_;
  request.cases = cases_;
  if (over_.empty() == cases_.empty())
    usage_error("what to sweep over?", "--over and --cases", "it is one of the two",
                "as in --over dt=0.001:0.01:log5");
  request.out = one_file(base.out, ".csv", "a sweep writes .csv");
  if (!part_.empty()) {
    const std::size_t slash = part_.find('/');
    if (slash == std::string::npos || request.out.empty())
      usage_error("bad value", "--part '" + part_ + "'",
                  request.out.empty() ? "its cases are kept beside a table" : "it is I/M",
                  "as in --part 0/4 --out runs.csv");
    request.parts = integer_between("--part", part_.substr(slash + 1), 1, 1'000'000);
    request.part = integer_between("--part", part_.substr(0, slash), 0, request.parts - 1);
  }
  if (!timeout_.empty()) request.timeout = positive_number("--timeout", timeout_);
  request.keep_failed = keep_failed_;
  request.list = list_;
  request.collect = collect_;
  request.verify = base.verify;
  request.of = base.of;
  request.progress = base.progress;
  return request;
}

}  // namespace sim::cli
