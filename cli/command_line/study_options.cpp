#include "cli/command_line/study_options.h"

#include "cli/command_line/option_values.h"

namespace sim::cli {
namespace {

constexpr const char* kStabilityFooter =
    "Keys of --json, one object a system ({\"systems\":[..]} for a world):\n"
    "  system, t, omega_max (rad/s; of first order the largest rate, 1/s), damping,\n"
    "  residual, bound, growth (1/s, of the system itself), decay (1/s), particles,\n"
    "  families, integrator, dt, energy_time, complete, integrators: [name, order,\n"
    "  predicted_dt, measured_dt (s; 0: none is stable, null: any is, or not known),\n"
    "  limit (step, none stable, unlimited, own steps, unknown), confirmed,\n"
    "  radius (growth in one step of dt), energy: [fraction, dt, error]]\n";

constexpr const char* kOrderFooter =
    "Keys of --json, one object a system ({\"systems\":[..]} for a world):\n"
    "  system, time, size, reference: {how, error}, complete, integrators: [name,\n"
    "  order, observed (null: no three steps agree), standard_error, constant, keeps,\n"
    "  points: [dt, tol, error, finished, evaluations]]\n"
    "  error: rms over the free coordinates, the largest of all steps.\n";

constexpr const char* kTradeoffFooter =
    "Keys of --json, one object a system ({\"systems\":[..]} for a world):\n"
    "  system, time, of (null: positions), size, budget, comparable (s),\n"
    "  reference: {how, error}, growth, omega_max, complete,\n"
    "  recommended, cheapest: {integrator, dt or tol, error, evaluations, command},\n"
    "  integrators: [name, order, observed, limit, points: [dt, tol, status, error,\n"
    "  relative, error_end, max_end, worst, energy, phi and phi_rate (of constraints),\n"
    "  steps, evaluations, newton, factorisations, linear, cost, seconds, spread,\n  front]]\n"
    "  error: rms over what is compared, the largest of all steps.\n";

constexpr const char* kMinimalFooter =
    "Keys of --json, one object:\n"
    "  system, time, budget, own_error (of the whole scene), complete,\n"
    "  whole: {seconds, evaluations}, command, parts: [what, option, seconds,\n"
    "  evaluations, change, energy, observed: {NAME: change}, within],\n"
    "  smallest: {seconds, evaluations, change, energy, observed}\n"
    "  change: of positions, as a share of the size, the largest on the way.\n";

}  // namespace

void StudyOptions::scene_of(CLI::App* verb) {
  verb->add_option("SCENE", scene_, "Lua file; scenes/cloth.lua if not given")->type_name("");
}

void StudyOptions::budget_of(CLI::App* verb, const std::string& doc) {
  verb->add_option("--budget", budget_, doc)->type_name("E");
  verb->add_option("--of", of_, "judge that quantity the scene observes, not\npositions")
      ->type_name("NAME");
}

CLI::App* StudyOptions::study(CLI::App& app, const std::string& name, const std::string& doc,
                              const std::string& footer, const std::set<std::string>& taken) {
  CLI::App* verb = app.add_subcommand(name, doc);
  verb->fallthrough()->allow_extras();
  std::string own;
  for (const std::string& option : taken)
    if (option != "--progress") own += option + ", ";
  verb->footer("It takes " + own +
               "--progress, --json, --set,\n--seed, --without, --plugin-path and --load, as "
               "in sim --help.\n" +
               footer);
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
  stability_
      ->add_flag("--extremes", extremes_,
                 "no scene, but a spring at all extremes of\nstiffness, mass, dt and offset")
      ->disable_flag_override();

  tradeoff_ = study(app, "tradeoff", "SCENE: speed against accuracy, and which to take",
                    kTradeoffFooter, {"--time", "--progress"});
  scene_of(tradeoff_);
  integrators(tradeoff_);
  budget_of(tradeoff_, "error allowed: 1% of the size (or of the range of\n--of), \"1 mm\", 1e-3");
  tradeoff_->add_option("--csv", csv_, "table of every point, .csv or .jsonl")->type_name("FILE");
  tradeoff_->add_option("--svg", svg_, "plot of error against cost")->type_name("FILE");

  order_ = study(app, "order", "[INTEGRATOR] [SCENE]: observed order of convergence", kOrderFooter,
                 {"--time", "--progress"});
  order_->add_option("INTEGRATOR", words_[0], "as for -i; all that fit if not given")
      ->type_name("");
  order_->add_option("SCENE", words_[1], "Lua file; the two in either order")->type_name("");
  integrators(order_);

  minimal_ = study(app, "minimal", "SCENE: which of its parts does a result need?", kMinimalFooter,
                   {"--integrator", "--dt", "--time", "--progress"});
  scene_of(minimal_);
  budget_of(minimal_, "change allowed: 1% of the size (or of the range of\n--of) if not given");
}

bool StudyOptions::takes(const CLI::App* verb, const std::string& option) const {
  const auto taken = taken_.find(verb);
  return taken != taken_.end() && taken->second.contains(option);
}

StabilityRequest StudyOptions::stability(const StudyBase& base) const {
  StabilityRequest request;
  request.scene = base.scene;
  if (!scene_.empty()) request.scene.scene = scene_;
  request.scene.integrator = parse_integrator(base.integrator);
  if (!base.dt.empty()) request.scene.dt = positive_number("--dt", base.dt);
  request.extremes = extremes_;
  if (extremes_ && !scene_.empty())
    usage_error("two things to study", "--extremes and '" + scene_ + "'",
                "--extremes has a scene of its own", "keep one of them");
  if (!at_.empty()) request.at = non_negative_number("--at", at_);
  request.integrators = parse_integrators("--integrators", integrators_);
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
  if (!base.time.empty()) request.time = positive_number("--time", base.time);
  request.json = base.json;
  request.progress = base.progress;
  return request;
}

TradeoffRequest StudyOptions::tradeoff(const StudyBase& base) const {
  TradeoffRequest request;
  request.scene = base.scene;
  if (!scene_.empty()) request.scene.scene = scene_;
  if (!budget_.empty()) request.budget = budget("--budget", budget_);
  request.of = of_;
  if (!base.time.empty()) request.time = positive_number("--time", base.time);
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

MinimalRequest StudyOptions::minimal(const StudyBase& base) const {
  MinimalRequest request;
  request.scene = base.scene;
  if (!scene_.empty()) request.scene.scene = scene_;
  request.scene.integrator = parse_integrator(base.integrator);
  if (!base.dt.empty()) request.scene.dt = positive_number("--dt", base.dt);
  if (!base.time.empty()) request.time = positive_number("--time", base.time);
  if (!budget_.empty()) request.budget = budget("--budget", budget_);
  request.of = of_;
  request.json = base.json;
  request.progress = base.progress;
  return request;
}

}  // namespace sim::cli
