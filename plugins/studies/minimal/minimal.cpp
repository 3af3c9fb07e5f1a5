// Leaves out each force, spring family, collider and numeric parameter in turn, takes half the
// particles a side where the scene has a parameter `n`, single precision, twice the step and the
// next simpler method; then all of that together which stays within the budget. A table, and the
// smallest scene as a command.
#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/plugin/plugin.h"
#include "core/study/budget.h"
#include "core/study/study.h"
#include "minimal_parts.h"
#include "run_distance.h"

namespace sim::studies {
namespace {

using study::Look;
using study::RunDistance;

// The looks at all systems of a scene, in their order.
struct Looks {
  std::vector<Look> systems;

  double seconds() const {
    double sum = 0;
    for (const Look& each : systems) sum += each.seconds;
    return sum;
  }
  std::int64_t evaluations() const {
    std::int64_t sum = 0;
    for (const Look& each : systems) sum += each.evaluations;
    return sum;
  }
  bool finished() const { return std::ranges::all_of(systems, &Look::finished); }
};

struct Row {
  Part part;
  SceneVariant scene;
  std::optional<Looks> look;  // nothing: it cannot be loaded, or its run failed
  std::string why;
  std::vector<RunDistance> change;  // of each system
  bool within = false;
};

// The largest change of one kind over all systems; not a number if none has one.
double worst(const std::vector<RunDistance>& changes, double RunDistance::*what) {
  double most = std::nan("");
  for (const RunDistance& each : changes)
    if (!(each.*what <= most) && !std::isnan(each.*what)) most = each.*what;
  return most;
}

// The judge of all reductions: what the whole scene does, and how far another is from it.
class Bench {
 public:
  Bench(const StudyTask& task, const study::Budget& budget) : task_(task), budget_(budget) {}

  // Nothing when told to end. Throws what load() throws.
  std::optional<Looks> look(const SceneVariant& scene, const std::string& what, double done) {
    return look_at_all(scene, task_.scene->load(scene), what, done,
                       [](study::Problem&, const Simulation&) {});
  }

  bool start(const StudiedScene& loaded) {
    const bool world = loaded.spec.world;
    for (std::size_t s = 0; s < loaded.spec.systems.size(); ++s) {
      const SystemSpec& spec = loaded.spec.systems[s];
      of_.push_back(quantity(spec));
      for (std::size_t i = 0; i < spec.observers.size(); ++i)
        observers_.push_back({s, i, (world ? spec.name + "." : "") + spec.observers[i].name});
    }
    auto whole = look(task_.variant, "the whole scene", 0);
    if (!whole) return false;
    if (!whole->finished())
      throw Error(ErrorKind::kUsage, {"nothing to compare with", task_.scene->name(),
                                      "the scene itself diverges", "see what sim says of it"});
    whole_ = std::move(*whole);
    const auto fine = finer(loaded);
    if (!fine) return false;
    own_ = likeness_of(*fine);
    return true;
  }

  // Within what is allowed in every system.
  bool within(const std::vector<RunDistance>& changes) const {
    for (std::size_t s = 0; s < changes.size(); ++s)
      if (!(amount(changes[s], s) <= budget(s))) return false;
    return true;
  }
  double budget(std::size_t s) const {
    const Look& look = whole_.systems[s];
    const double range = !of_[s]               ? look.size
                         : of_[s]->is_period() ? look.figure
                                               : look.ranges[of_[s]->observer()];
    return budget_.of(range);
  }
  void judge(Row& row, const std::string& what, double done) {
    try {
      row.look = look(row.scene, what, done);
      if (!row.look) return;
      if (!row.look->finished()) row.why = "diverges";
    } catch (const Error& error) {
      row.look.reset();
      row.why = error.text().why;
      return;
    }
    row.change = likeness_of(*row.look);
    row.within = row.look->finished() && within(row.change);
  }

  struct Observer {
    std::size_t system, index;
    std::string name;
  };
  const Looks& whole() const { return whole_; }
  const std::vector<RunDistance>& own() const { return own_; }
  const std::vector<Observer>& observers() const { return observers_; }
  double time(const SystemSpec& spec) const { return task_.time.value_or(spec.duration); }
  bool by_figure() const { return of_.front() && of_.front()->is_figure(); }

 private:
  double amount(const RunDistance& change, std::size_t s) const {  // in the unit of the budget
    if (!of_[s]) return change.positions * whole_.systems[s].size;
    return of_[s]->is_figure() ? change.figure : change.observed[of_[s]->observer()];
  }
  std::vector<RunDistance> likeness_of(const Looks& looks) const {
    std::vector<RunDistance> list;
    for (std::size_t s = 0; s < whole_.systems.size() && s < looks.systems.size(); ++s)
      list.push_back(study::run_distance(whole_.systems[s], looks.systems[s]));
    return list;
  }
  // Each system with half its step, or a tenth of its tolerance.
  std::optional<Looks> finer(const StudiedScene& loaded) const {
    return look_at_all(
        task_.variant, loaded, "the whole scene, finer", 0.05,
        [](study::Problem& problem, const Simulation& system) {
          problem.options.dt = system.h() / 2;
          if (system.integrator_info().adaptive && system.method().params().has("tol"))
            problem.options.integrator.given["tol"] = system.method().params().number("tol") / 10;
        });
  }
  // change(problem, system): of each before it is looked at.
  template <class Change>
  std::optional<Looks> look_at_all(const SceneVariant& scene, const StudiedScene& loaded,
                                   const std::string& what, double done,
                                   const Change& change) const {
    Looks looks;
    for (std::size_t s = 0; s < loaded.systems.size(); ++s) {
      const SystemSpec& spec = loaded.spec.systems[s];
      study::Problem problem{&spec, task_.registry, task_.scene->options(scene, spec)};
      problem.of = quantity(spec);
      change(problem, loaded.systems[s]);
      auto found = study::look_at(problem, time(spec), [&] { return task_.watch(what, done); });
      if (!found) return {};
      looks.systems.push_back(std::move(*found));
    }
    return looks;
  }

  std::optional<study::Quantity> quantity(const SystemSpec& spec) const {
    if (task_.of.empty()) return {};
    return study::Quantity(spec, task_.of);
  }

  const StudyTask& task_;
  study::Budget budget_;
  std::vector<std::optional<study::Quantity>> of_;  // of each system
  std::vector<Observer> observers_;
  Looks whole_;
  std::vector<RunDistance> own_;
};

constexpr std::size_t kShown = 2;  // quantities in a table

std::vector<std::string> cells(const Bench& bench, const std::string& name,
                               const std::optional<Looks>& look,
                               const std::vector<RunDistance>* change, const std::string& why) {
  std::vector<std::string> row{name};
  if (!look || !why.empty()) {
    row.emplace_back("-");
    return row;
  }
  const auto share = [&](double RunDistance::*what) -> std::string {
    if (!change) return "";
    const double most = worst(*change, what);
    return std::isnan(most) ? "-" : percent(most, 1, 2);
  };
  row.push_back(brief(1e3 * look->seconds(), 3));
  row.push_back(std::to_string(look->evaluations()));
  row.push_back(share(&RunDistance::positions));
  row.push_back(change ? share(&RunDistance::energy) : "-");
  if (bench.by_figure()) {
    row.push_back(change ? brief(worst(*change, &RunDistance::figure), 2) : "");
    return row;
  }
  for (std::size_t i = 0; i < std::min(kShown, bench.observers().size()); ++i) {
    const Bench::Observer& each = bench.observers()[i];
    row.push_back(change ? brief((*change)[each.system].observed[each.index], 2) : "");
  }
  return row;
}

std::string table_text(const Bench& bench, const StudyTask& task, const std::vector<Row>& rows,
                       const std::optional<Row>& smallest) {
  std::vector<std::string> head{"", "ms", "evals", "positions", "energy"};
  if (bench.by_figure())
    head.push_back(task.of);
  else
    for (std::size_t i = 0; i < std::min(kShown, bench.observers().size()); ++i)
      head.push_back(bench.observers()[i].name);
  std::vector<std::vector<std::string>> table{head};
  const auto add = [&](const std::string& name, const std::optional<Looks>& look,
                       const std::vector<RunDistance>* change, const std::string& why) {
    table.push_back(cells(bench, name, look, change, why));
  };
  add("  the whole scene", bench.whole(), nullptr, "");
  add("  its own error", bench.whole(), &bench.own(), "");
  table.back()[1] = table.back()[2] = "";
  for (const Row& row : rows)
    add((row.within ? "* " : "  ") + row.part.option, row.look, &row.change, row.why);
  if (smallest) add("  the smallest", smallest->look, &smallest->change, "");
  std::string text = aligned(table, "");
  for (const Row& row : rows)
    if (!row.why.empty()) text += "  " + wrapped(row.part.option + ": " + row.why, 4, 2) + '\n';
  return text;
}

std::string observed_json(const Bench& bench, const std::vector<RunDistance>& change) {
  JsonObject object;
  for (const Bench::Observer& each : bench.observers())
    object.number(each.name, each.system < change.size() ? change[each.system].observed[each.index]
                                                         : std::nan(""));
  return object.str();
}

JsonObject row_json(const Bench& bench, const std::optional<Looks>& look,
                    const std::vector<RunDistance>& change) {
  JsonObject object;
  object.number("seconds", look ? look->seconds() : std::nan(""));
  if (look) object.integer("evaluations", look->evaluations());
  object.number("change", worst(change, &RunDistance::positions))
      .number("energy", worst(change, &RunDistance::energy));
  if (bench.by_figure()) object.number("figure", worst(change, &RunDistance::figure));
  return object.json("observed", observed_json(bench, change));
}

std::vector<std::string> names_of(const SceneSpec& scene) {
  std::vector<std::string> names;
  for (const SystemSpec& spec : scene.systems) names.push_back(spec.name);
  return names;
}

std::string json_of(const Bench& bench, const SceneSpec& scene, const std::vector<Row>& rows,
                    const std::optional<Row>& smallest, const std::string& command, bool complete) {
  std::vector<std::string> parts;
  for (const Row& row : rows) {
    JsonObject object = row_json(bench, row.look, row.change);
    parts.push_back(object.text("what", row.part.what)
                        .text("option", row.part.option)
                        .flag("within", row.within)
                        .str());
  }
  JsonObject whole, budgets;
  whole.number("seconds", bench.whole().seconds())
      .integer("evaluations", bench.whole().evaluations());
  double time = 0;
  for (std::size_t s = 0; s < scene.systems.size(); ++s) {
    budgets.number(scene.systems[s].name, bench.budget(s));
    time = std::max(time, bench.time(scene.systems[s]));
  }
  return JsonObject()
      .text("system", join(names_of(scene), ", "))
      .number("time", time)
      .json("budget", scene.world ? budgets.str() : shortest(bench.budget(0)))
      .number("own_error", worst(bench.own(), &RunDistance::positions))
      .flag("complete", complete)
      .json("whole", whole.str())
      .json("parts", json_array(parts))
      .json("smallest", smallest ? row_json(bench, smallest->look, smallest->change).str() : "null")
      .text("command", command)
      .str();
}

// Again and again what saves the most time of all that keeps the budget; at the end what may be
// left out without more of it.
std::optional<Row> together(Bench& bench, const std::vector<Row>& rows, const StudyTask& task) {
  constexpr double kGain = 0.95, kNoise = 1.1, kLong = 0.3;
  constexpr int kMost = 12;
  std::optional<Row> best;
  const auto seconds = [&] { return best ? best->look->seconds() : bench.whole().seconds(); };
  const auto tried = [&](const Row& row) -> std::optional<Row> {
    Row next;
    next.scene = best ? best->scene : task.variant;
    if (!row.part.apply(next.scene) || !task.watch("together", 0.6)) return {};
    bench.judge(next, "together", 0.6);
    if (!next.within) return {};
    return next;
  };
  std::vector<const Row*> open;
  for (const Row& row : rows)
    if (row.within) open.push_back(&row);
  std::ranges::stable_sort(open, {}, [](const Row* row) { return row->look->seconds(); });
  for (int round = 0; round < kMost; ++round) {
    std::optional<Row> quickest;
    const Row* made = nullptr;
    for (const Row* row : open) {
      if (made && bench.whole().seconds() > kLong) break;  // the first that helps is good enough
      auto next = tried(*row);
      if (!next || next->look->seconds() > kGain * seconds()) continue;
      if (quickest && next->look->seconds() >= quickest->look->seconds()) continue;
      quickest = std::move(next);
      made = row;
    }
    if (!made) break;
    best = std::move(quickest);
    if (!made->part.again) std::erase(open, made);
  }
  for (const Row* row : open) {
    if (!row->part.option.starts_with("--without")) continue;
    auto next = tried(*row);
    if (next && next->look->seconds() <= kNoise * seconds()) best = std::move(next);
  }
  return best;
}

std::string text_of(const Bench& bench, const StudyTask& task, const StudiedScene& scene,
                    const std::vector<Row>& rows, const std::optional<Row>& smallest,
                    const std::string& command) {
  std::string text;
  for (std::size_t s = 0; s < scene.systems.size(); ++s) {
    const std::string unit = task.of.empty() && !scene.systems[s].flat() ? " m" : "";
    text += label("system", scene.systems[s].name() +
                                " to t = " + brief(bench.time(scene.spec.systems[s])) + " s") +
            label("budget", brief(bench.budget(s), 3) + unit + " of " +
                                (task.of.empty() ? "positions" : task.of));
  }
  text += '\n' + table_text(bench, task, rows, smallest) +
          wrapped(std::string("* within the budget. Changes are the largest on the way: of a "
                              "position as a share of the scene's size, of the energy of that in "
                              "play, of what the scene observes as numbers") +
                      (scene.spec.world ? "; of several systems that of the worst" : "") +
                      (bench.by_figure() ? "; a figure at the end" : "") +
                      ". Springs and forces that a step has room for may cost no time.",
                  0) +
          "\n\n";
  if (!bench.within(bench.own()))
    text += "The scene's own error is above the budget: a smaller step first.\n";
  return text + (smallest ? "smallest scene within the budget\n  " + command + '\n'
                          : "nothing can be left out within the budget\n");
}

class Minimal final : public Study {
 public:
  explicit Minimal(const Params& params)
      : budget_(study::parse_budget("--budget", params.text("budget"))) {}

  std::string run(const StudyTask& task) override {
    Bench bench(task, budget_);
    const StudiedScene loaded = task.scene->load(task.variant);
    if (!bench.start(loaded)) return "";
    const std::vector<Part> parts = parts_of(task, loaded);
    task.announce(2.0 * static_cast<double>(parts.size() + 2) * 3 * bench.whole().seconds());
    std::vector<Row> rows;
    bool complete = true;
    for (const Part& part : parts) {
      Row row{part, task.variant, {}, "", {}, false};
      if (!row.part.apply(row.scene)) continue;
      const double done = static_cast<double>(rows.size()) / static_cast<double>(parts.size());
      bench.judge(row, part.option, 0.1 + 0.5 * done);
      complete = task.watch(part.option, 0.1 + 0.5 * done);
      if (!complete) break;
      rows.push_back(std::move(row));
    }
    std::optional<Row> smallest;
    if (complete) smallest = together(bench, rows, task);
    complete = complete && task.watch("together", 1);
    const std::string command = run_command(task, smallest ? smallest->scene : task.variant);
    return task.json ? json_of(bench, loaded.spec, rows, smallest, command, complete)
                     : text_of(bench, task, loaded, rows, smallest, command);
  }

 private:
  study::Budget budget_;
};

constexpr const char* kHelp =
    "Keys of --json, one object:\n"
    "  system, time, budget, own_error (of the whole scene), complete,\n"
    "  whole: {seconds, evaluations}, command, parts: [what, option, seconds,\n"
    "  evaluations, change, energy, observed: {NAME: change}, figure, within],\n"
    "  smallest: {seconds, evaluations, change, energy, observed, figure}\n"
    "  change: of positions, as a share of the size, the largest on the way; figure:\n"
    "  of --of \"mean sag\". A world: budget {SYSTEM: number}, observed\n"
    "  {SYSTEM.NAME: ..}; changes are those of the system that changes most.\n";

}  // namespace
}  // namespace sim::studies

SIM_PLUGIN(Study, "minimal") {
  registrar.add(sim::Plugin<sim::Study>{
      {.name = "minimal",
       .summary = "which of its parts does a result need?",
       .formula = "sim minimal SCENE [--budget 5%]",
       .params = {{.name = "budget",
                   .type = sim::ParamType::kText,
                   .default_value = std::string("1%"),
                   .doc = "change allowed: a share of the size (or of the range of --of), or an "
                          "amount, as \"1 mm\""}}},
      [](const sim::Params& params) { return std::make_unique<sim::studies::Minimal>(params); },
      true,
      {"--integrator", "--dt", "--time", "--of"},
      sim::studies::kHelp});
}
