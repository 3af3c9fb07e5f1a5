#include "cli/verbs/minimal.h"

#include <algorithm>
#include <cmath>

#include "cli/run/study_progress.h"
#include "cli/verbs/minimal_parts.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/study/likeness.h"

namespace sim::cli {
namespace {

using study::Likeness;
using study::Look;

// Of all systems of a scene, in their order.
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
  SceneRequest scene;
  std::optional<Looks> look;  // nothing: it cannot be loaded, or its run failed
  std::string why;
  std::vector<Likeness> change;  // of each system
  bool within = false;
};

// Of that of the system which changes most; not a number where none has one.
double worst(const std::vector<Likeness>& changes, double Likeness::*what) {
  double most = std::nan("");
  for (const Likeness& each : changes)
    if (!(each.*what <= most) && !std::isnan(each.*what)) most = each.*what;
  return most;
}

// The judge of all reductions: what the whole scene does, and how far another is from it.
class Bench {
 public:
  Bench(const MinimalRequest& request, const Environment& environment, Registry& registry,
        const study::Watch& watch)
      : request_(request), environment_(environment), registry_(registry), watch_(watch) {}

  // Nothing when told to end. Throws what load() throws.
  std::optional<Looks> look(const SceneRequest& scene, const std::string& what, double done) {
    return look_at_all(scene, load(scene, environment_, registry_), what, done,
                       [](study::Problem&, const Simulation&) {});
  }

  bool start(const LoadedScene& loaded) {
    const bool world = loaded.spec.world;
    for (std::size_t s = 0; s < loaded.spec.systems.size(); ++s) {
      const SystemSpec& spec = loaded.spec.systems[s];
      of_.push_back(quantity(spec, request_.of));
      for (std::size_t i = 0; i < spec.observers.size(); ++i)
        observers_.push_back({s, i, (world ? spec.name + "." : "") + spec.observers[i].name});
    }
    auto whole = look(request_.scene, "the whole scene", 0);
    if (!whole) return false;
    if (!whole->finished())
      throw Error(ErrorKind::kUsage, {"nothing to compare with", request_.scene.scene,
                                      "the scene itself diverges", "see what sim says of it"});
    whole_ = std::move(*whole);
    const auto fine = finer(loaded);
    if (!fine) return false;
    own_ = likeness_of(*fine);
    return true;
  }

  // Within what is allowed in every system.
  bool within(const std::vector<Likeness>& changes) const {
    for (std::size_t s = 0; s < changes.size(); ++s)
      if (!(amount(changes[s], s) <= budget(s))) return false;
    return true;
  }
  double budget(std::size_t s) const {
    if (request_.budget.in_metres) return request_.budget.value;
    const Look& look = whole_.systems[s];
    const double range = !of_[s]               ? look.size
                         : of_[s]->is_period() ? look.figure
                                               : look.ranges[of_[s]->observer()];
    return request_.budget.value * range;
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
  const std::vector<Likeness>& own() const { return own_; }
  const std::vector<Observer>& observers() const { return observers_; }
  double time(const SystemSpec& spec) const { return request_.time.value_or(spec.duration); }
  bool by_figure() const { return of_.front() && of_.front()->is_figure(); }

 private:
  double amount(const Likeness& change, std::size_t s) const {  // in the unit of the budget
    if (!of_[s]) return change.places * whole_.systems[s].size;
    return of_[s]->is_figure() ? change.figure : change.observed[of_[s]->observer()];
  }
  std::vector<Likeness> likeness_of(const Looks& looks) const {
    std::vector<Likeness> list;
    for (std::size_t s = 0; s < whole_.systems.size() && s < looks.systems.size(); ++s)
      list.push_back(study::likeness(whole_.systems[s], looks.systems[s]));
    return list;
  }
  // Each system with half its step, or a tenth of its tolerance.
  std::optional<Looks> finer(const LoadedScene& loaded) const {
    return look_at_all(
        request_.scene, loaded, "the whole scene, finer", 0.05,
        [](study::Problem& problem, const Simulation& system) {
          problem.options.dt = system.h() / 2;
          if (system.integrator_info().adaptive && system.method().params().has("tol"))
            problem.options.integrator.given["tol"] = system.method().params().number("tol") / 10;
        });
  }
  // change(problem, system): of each before it is looked at.
  template <class Change>
  std::optional<Looks> look_at_all(const SceneRequest& scene, const LoadedScene& loaded,
                                   const std::string& what, double done,
                                   const Change& change) const {
    Looks looks;
    for (std::size_t s = 0; s < loaded.systems.size(); ++s) {
      const SystemSpec& spec = loaded.spec.systems[s];
      study::Problem problem{&spec, &registry_, run_options(scene, spec, registry_)};
      problem.of = quantity(spec, request_.of);
      change(problem, loaded.systems[s]);
      auto found = study::look_at(problem, time(spec), [&] { return watch_(what, done); });
      if (!found) return {};
      looks.systems.push_back(std::move(*found));
    }
    return looks;
  }

  const MinimalRequest& request_;
  const Environment& environment_;
  Registry& registry_;
  const study::Watch& watch_;
  std::vector<std::optional<study::Quantity>> of_;  // of each system
  std::vector<Observer> observers_;
  Looks whole_;
  std::vector<Likeness> own_;
};

constexpr std::size_t kShown = 2;  // quantities in a table

std::vector<std::string> cells(const Bench& bench, const std::string& name,
                               const std::optional<Looks>& look,
                               const std::vector<Likeness>* change, const std::string& why) {
  std::vector<std::string> row{name};
  if (!look || !why.empty()) {
    row.emplace_back("-");
    return row;
  }
  const auto share = [&](double Likeness::*what) -> std::string {
    if (!change) return "";
    const double most = worst(*change, what);
    return std::isnan(most) ? "-" : percent(most, 1, 2);
  };
  row.push_back(brief(1e3 * look->seconds(), 3));
  row.push_back(std::to_string(look->evaluations()));
  row.push_back(share(&Likeness::places));
  row.push_back(change ? share(&Likeness::energy) : "-");
  if (bench.by_figure()) {
    row.push_back(change ? brief(worst(*change, &Likeness::figure), 2) : "");
    return row;
  }
  for (std::size_t i = 0; i < std::min(kShown, bench.observers().size()); ++i) {
    const Bench::Observer& each = bench.observers()[i];
    row.push_back(change ? brief((*change)[each.system].observed[each.index], 2) : "");
  }
  return row;
}

std::string table_text(const Bench& bench, const MinimalRequest& request,
                       const std::vector<Row>& rows, const std::optional<Row>& smallest) {
  std::vector<std::string> head{"", "ms", "evals", "positions", "energy"};
  if (bench.by_figure())
    head.push_back(request.of);
  else
    for (std::size_t i = 0; i < std::min(kShown, bench.observers().size()); ++i)
      head.push_back(bench.observers()[i].name);
  std::vector<std::vector<std::string>> table{head};
  const auto add = [&](const std::string& name, const std::optional<Looks>& look,
                       const std::vector<Likeness>* change, const std::string& why) {
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

std::string observed_json(const Bench& bench, const std::vector<Likeness>& change) {
  JsonObject object;
  for (const Bench::Observer& each : bench.observers())
    object.number(each.name, each.system < change.size() ? change[each.system].observed[each.index]
                                                         : std::nan(""));
  return object.str();
}

JsonObject row_json(const Bench& bench, const std::optional<Looks>& look,
                    const std::vector<Likeness>& change) {
  JsonObject object;
  object.number("seconds", look ? look->seconds() : std::nan(""));
  if (look) object.integer("evaluations", look->evaluations());
  object.number("change", worst(change, &Likeness::places))
      .number("energy", worst(change, &Likeness::energy));
  if (bench.by_figure()) object.number("figure", worst(change, &Likeness::figure));
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
      .number("own_error", worst(bench.own(), &Likeness::places))
      .flag("complete", complete)
      .json("whole", whole.str())
      .json("parts", json_array(parts))
      .json("smallest", smallest ? row_json(bench, smallest->look, smallest->change).str() : "null")
      .text("command", command)
      .str();
}

// Again and again what saves the most time of all that keeps the budget; at the end what may be
// left out without more of it.
std::optional<Row> together(Bench& bench, const std::vector<Row>& rows, const SceneRequest& whole,
                            const study::Watch& watch) {
  constexpr double kGain = 0.95, kNoise = 1.1, kLong = 0.3;
  constexpr int kMost = 12;
  std::optional<Row> best;
  const auto seconds = [&] { return best ? best->look->seconds() : bench.whole().seconds(); };
  const auto tried = [&](const Row& row) -> std::optional<Row> {
    Row next;
    next.scene = best ? best->scene : whole;
    if (!row.part.apply(next.scene) || !watch("together", 0.6)) return {};
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

std::string text_of(const Bench& bench, const MinimalRequest& request, const LoadedScene& scene,
                    const std::vector<Row>& rows, const std::optional<Row>& smallest,
                    const std::string& command) {
  std::string text;
  for (std::size_t s = 0; s < scene.systems.size(); ++s) {
    const std::string unit = request.of.empty() && !scene.systems[s].flat() ? " m" : "";
    text += label("system", scene.systems[s].name() +
                                " to t = " + brief(bench.time(scene.spec.systems[s])) + " s") +
            label("budget", brief(bench.budget(s), 3) + unit + " of " +
                                (request.of.empty() ? "positions" : request.of));
  }
  text += '\n' + table_text(bench, request, rows, smallest) +
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

}  // namespace

int minimal(const MinimalRequest& request, const Environment& environment, Registry& registry,
            Console& console) {
  StudyProgress progress(request.progress, console);
  const study::Watch watch = progress.watch();
  Bench bench(request, environment, registry, watch);
  std::vector<Row> rows;
  std::optional<Row> smallest;
  const LoadedScene loaded = load(request.scene, environment, registry);
  const bool started = bench.start(loaded);
  if (started) {
    const std::vector<Part> parts = parts_of(request.scene, loaded, registry);
    progress.announce(2.0 * static_cast<double>(parts.size() + 2) * 3 * bench.whole().seconds());
    for (const Part& part : parts) {
      Row row{part, request.scene, {}, "", {}, false};
      if (!row.part.apply(row.scene)) continue;
      const double done = static_cast<double>(rows.size()) / static_cast<double>(parts.size());
      bench.judge(row, part.option, 0.1 + 0.5 * done);
      if (progress.caught()) break;
      rows.push_back(std::move(row));
    }
    if (!progress.caught()) smallest = together(bench, rows, request.scene, watch);
  }
  progress.clear();
  if (!started) return progress.exit_code();
  const std::string command = run_command(smallest ? smallest->scene : request.scene, request.time);
  if (request.json)
    put(console.out,
        json_of(bench, loaded.spec, rows, smallest, command, !progress.caught()) + '\n');
  else
    put(console.out, text_of(bench, request, loaded, rows, smallest, command));
  flush_or_throw(console.out, "standard output");
  return progress.exit_code();
}

}  // namespace sim::cli
