#include "cli/verbs/minimal.h"

#include <algorithm>
#include <cmath>

#include "cli/run/study_progress.h"
#include "cli/verbs/minimal_parts.h"
#include "core/base/error.h"
#include "core/output/format.h"
#include "core/study/likeness.h"

namespace sim::cli {
namespace {

using study::Likeness;
using study::Look;

struct Row {
  Part part;
  SceneRequest scene;
  std::optional<Look> look;  // nothing: it cannot be loaded, or its run failed
  std::string why;
  Likeness change;
  bool within = false;
};

// The judge of all reductions: what the whole scene does, and how far another is from it.
class Bench {
 public:
  Bench(const MinimalRequest& request, const Environment& environment, Registry& registry,
        const study::Watch& watch)
      : request_(request), environment_(environment), registry_(registry), watch_(watch) {}

  // Nothing when told to end. Throws what load() throws.
  std::optional<Look> look(const SceneRequest& scene, const std::string& what, double done) {
    const LoadedScene loaded = load(scene, environment_, registry_);
    const SystemSpec& spec = loaded.spec.systems.front();
    const study::Problem problem{&spec, &registry_, run_options(scene, spec, registry_)};
    return study::look_at(problem, time_, [&] { return watch_(what, done); });
  }

  bool start() {
    const LoadedScene loaded = load(request_.scene, environment_, registry_);
    if (loaded.spec.world)
      throw Error(ErrorKind::kUsage, {"several systems", request_.scene.scene, "it is a world",
                                      "name the file of one of its scenes"});
    const SystemSpec& spec = loaded.spec.systems.front();
    quantity(spec, request_.of);  // for its error
    time_ = request_.time.value_or(spec.duration);
    for (const ObserverSpec& observer : spec.observers) names_.push_back(observer.name);
    auto whole = look(request_.scene, "the whole scene", 0);
    if (!whole) return false;
    if (!whole->finished)
      throw Error(ErrorKind::kUsage, {"nothing to compare with", request_.scene.scene,
                                      "the scene itself diverges", "see what sim says of it"});
    whole_ = std::move(*whole);
    SceneRequest finer = request_.scene;
    finer.dt = loaded.systems.front().h() / 2;
    const IntegratorInfo info = loaded.systems.front().integrator_info();
    if (info.adaptive && loaded.systems.front().method().params().has("tol"))
      finer.integrator.given["tol"] =
          shortest(loaded.systems.front().method().params().number("tol") / 10);
    const auto fine = look(finer, "the whole scene, finer", 0.05);
    if (!fine) return false;
    own_ = study::likeness(whole_, *fine);
    return true;
  }

  double budget() const {
    if (request_.budget.in_metres) return request_.budget.value;
    return request_.budget.value * (request_.of.empty() ? whole_.size : range());
  }
  double amount(const Likeness& change) const {  // in the unit of the budget
    return request_.of.empty() ? change.places * whole_.size : change.observed[of()];
  }
  void judge(Row& row, const std::string& what, double done) {
    try {
      row.look = look(row.scene, what, done);
      if (!row.look) return;
      if (!row.look->finished) row.why = "diverges";
    } catch (const Error& error) {
      row.look.reset();
      row.why = error.text().why;
      return;
    }
    row.change = study::likeness(whole_, *row.look);
    row.within = row.look->finished && amount(row.change) <= budget();
  }

  const Look& whole() const { return whole_; }
  const Likeness& own() const { return own_; }
  const std::vector<std::string>& names() const { return names_; }
  double time() const { return time_; }
  std::size_t of() const {
    return static_cast<std::size_t>(std::ranges::find(names_, request_.of) - names_.begin());
  }
  double range() const { return whole_.ranges.empty() ? 1 : whole_.ranges[of()]; }

 private:
  const MinimalRequest& request_;
  const Environment& environment_;
  Registry& registry_;
  const study::Watch& watch_;
  double time_ = 0;
  std::vector<std::string> names_;
  Look whole_;
  Likeness own_;
};

std::vector<std::string> cells(const Bench& bench, const std::string& name,
                               const std::optional<Look>& look, const Likeness* change,
                               const std::string& why) {
  std::vector<std::string> row{name};
  if (!look || !why.empty()) {
    row.emplace_back("-");
    return row;
  }
  row.push_back(brief(1e3 * look->seconds, 3));
  row.push_back(std::to_string(look->evaluations));
  row.push_back(change ? percent(change->places, 1, 2) : "");
  row.push_back(change && !std::isnan(change->energy) ? percent(change->energy, 1, 2) : "-");
  constexpr std::size_t kShown = 2;
  for (std::size_t i = 0; i < std::min(kShown, bench.names().size()); ++i)
    row.push_back(change ? brief(change->observed[i], 2) : "");
  return row;
}

std::string table_text(const Bench& bench, const std::vector<Row>& rows,
                       const std::optional<Row>& smallest) {
  std::vector<std::string> head{"", "ms", "evals", "positions", "energy"};
  for (std::size_t i = 0; i < std::min<std::size_t>(2, bench.names().size()); ++i)
    head.push_back(bench.names()[i]);
  std::vector<std::vector<std::string>> table{head};
  table.push_back(cells(bench, "  the whole scene", bench.whole(), nullptr, ""));
  table.push_back(cells(bench, "  its own error", bench.whole(), &bench.own(), ""));
  table.back()[1] = table.back()[2] = "";
  for (const Row& row : rows)
    table.push_back(
        cells(bench, (row.within ? "* " : "  ") + row.part.option, row.look, &row.change, row.why));
  if (smallest)
    table.push_back(cells(bench, "  the smallest", smallest->look, &smallest->change, ""));
  std::string text = aligned(table, "");
  for (const Row& row : rows)
    if (!row.why.empty()) text += "  " + row.part.option + ": " + row.why + '\n';
  return text;
}

std::string observed_json(const Bench& bench, const Likeness& change) {
  JsonObject object;
  for (std::size_t i = 0; i < bench.names().size(); ++i)
    object.number(bench.names()[i], i < change.observed.size() ? change.observed[i] : std::nan(""));
  return object.str();
}

JsonObject row_json(const Bench& bench, const std::optional<Look>& look, const Likeness& change) {
  JsonObject object;
  object.number("seconds", look ? look->seconds : std::nan(""));
  if (look) object.integer("evaluations", look->evaluations);
  return object.number("change", look ? change.places : std::nan(""))
      .number("energy", look ? change.energy : std::nan(""))
      .json("observed", observed_json(bench, change));
}

std::string json_of(const Bench& bench, const std::string& system, const std::vector<Row>& rows,
                    const std::optional<Row>& smallest, const std::string& command, bool complete) {
  std::vector<std::string> parts;
  for (const Row& row : rows) {
    JsonObject object = row_json(bench, row.look, row.change);
    parts.push_back(object.text("what", row.part.what)
                        .text("option", row.part.option)
                        .flag("within", row.within)
                        .str());
  }
  JsonObject whole;
  whole.number("seconds", bench.whole().seconds).integer("evaluations", bench.whole().evaluations);
  return JsonObject()
      .text("system", system)
      .number("time", bench.time())
      .number("budget", bench.budget())
      .number("own_error", bench.own().places)
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
  const auto seconds = [&] { return best ? best->look->seconds : bench.whole().seconds; };
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
  std::ranges::stable_sort(open, {}, [](const Row* row) { return row->look->seconds; });
  for (int round = 0; round < kMost; ++round) {
    std::optional<Row> quickest;
    const Row* made = nullptr;
    for (const Row* row : open) {
      if (made && bench.whole().seconds > kLong) break;  // the first that helps is good enough
      auto next = tried(*row);
      if (!next || next->look->seconds > kGain * seconds()) continue;
      if (quickest && next->look->seconds >= quickest->look->seconds) continue;
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
    if (next && next->look->seconds <= kNoise * seconds()) best = std::move(next);
  }
  return best;
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
  const bool started = bench.start();
  if (started) {
    const std::vector<Part> parts = parts_of(request.scene, loaded, registry);
    progress.announce(2.0 * static_cast<double>(parts.size() + 2) * 3 * bench.whole().seconds);
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
  const std::string& system = loaded.systems.front().name();
  const std::string command = run_command(smallest ? smallest->scene : request.scene, request.time);
  if (request.json) {
    put(console.out, json_of(bench, system, rows, smallest, command, !progress.caught()) + '\n');
  } else {
    const std::string unit = request.of.empty() && !loaded.systems.front().flat() ? " m" : "";
    std::string text =
        label("system", system + " to t = " + brief(bench.time()) + " s") +
        label("budget", brief(bench.budget(), 3) + unit + " of " +
                            (request.of.empty() ? "positions" : request.of)) +
        '\n' + table_text(bench, rows, smallest) +
        "* within the budget. Changes are the largest on the way: of a position as a share\n"
        "of the scene's size, of the energy of that in play, of what the scene observes\n"
        "as numbers. Springs and forces that a step has room for may cost no time.\n\n";
    if (bench.amount(bench.own()) > bench.budget())
      text += "The scene's own error is above the budget: a smaller step first.\n";
    text += smallest ? "smallest scene within the budget\n  " + command + '\n'
                     : "nothing can be left out within the budget\n";
    put(console.out, text);
  }
  flush_or_throw(console.out, "standard output");
  return progress.exit_code();
}

}  // namespace sim::cli
