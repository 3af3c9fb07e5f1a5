#include "core/report/comparison.h"

#include <algorithm>
#include <cmath>
#include <ranges>

#include "core/base/error.h"
#include "core/base/stopwatch.h"
#include "core/base/text.h"
#include "core/output/format.h"
#include "core/output/make_writer.h"
#include "core/report/study_words.h"
#include "core/study/accuracy/trajectory.h"
#include "core/study/method_text.h"

namespace sim::report {
namespace {

constexpr std::size_t kMostPanels = 16;
constexpr int kPanelWidth = 640, kPanelHeight = 540, kMostWidth = 1920;  // pixels
constexpr double kLost = 0.5;     // sizes of the scene: a run that is off by more shows nothing
constexpr double kInSight = 0.5;  // sizes that a particle of a panel may be off
constexpr double kSame = 0.02;    // sizes that nobody sees
constexpr std::int64_t kStepsInOne = 4096;  // between looks at signals

double largest_of(const std::vector<double>& values) { return *std::ranges::max_element(values); }

// Nothing smaller than what the reference knows.
std::string known_error_text(double error, double known, int digits) {
  return error > known || std::isnan(error) || std::isnan(known) ? brief(error, digits)
                                                                 : "<" + brief(known, 1);
}

std::string method_step_text(const Simulation& system) {
  const Params& params = system.method().params();
  const IntegratorInfo info = system.integrator_info();
  if (info.adaptive && params.has("tol")) return "tol = " + brief(params.number("tol"), 3);
  return "h = " + brief(system.h(), 3) + " s";
}

}  // namespace

// One method on its way through the times of the frames.
struct Comparison::Runner {
  std::string method;
  Simulation system;
  std::vector<Frame> frames{};
  double seconds = 0, rms_end = 0, rms = 0, most = 0;  // error: at the end; largest of the frames
  std::int64_t evaluations = 0, steps = 0;
  std::int64_t looked = 0;            // evaluations for the frames alone
  double diverged_at = std::nan("");  // s: no further step, or further off than kLost sizes
  double judged = std::nan("");  // of the quantity asked for: the figure, or the last value seen
  double off = 0;                // how far that is off, of a quantity the largest of the frames

  bool diverged() const { return !std::isnan(diverged_at); }

  // The last frame in which no particle is further off than this, m; else the first one.
  const Frame& last_within(double error) const {
    for (const Frame& frame : frames | std::views::reverse)
      if (largest_of(frame.values) <= error) return frame;
    return frames.front();
  }
};

Comparison::Comparison(ComparisonTask task)
    : task_(std::move(task)),
      spec_(*task_.problem.spec),
      time_(task_.time.value_or(spec_.duration)),
      of_(quantity(spec_, task_.of)) {
  if (task_.methods.size() > kMostPanels)
    throw Error(ErrorKind::kUsage, {"too many methods", std::to_string(task_.methods.size()),
                                    "a comparison shows 16 at most", "leave some out"});
  if (task_.reference && of_)
    throw Error(ErrorKind::kUsage,
                {"two references", "reference, of",
                 "what a scene observes has a reference of its own", "leave one of the two out"});
  for (const ComparedMethod& method : methods()) runners_.push_back(runner(method));
  model_ = make_model(spec_, runners_.front().system);
}

Comparison::~Comparison() = default;

std::string Comparison::amount(double value) const {
  return brief(value, 2) + (unit().empty() ? "" : " " + unit());
}

// Without a wish: the scene's own method beside the plainest and the most robust one.
std::vector<ComparedMethod> Comparison::methods() const {
  if (!task_.methods.empty()) return task_.methods;
  std::vector<ComparedMethod> methods(1);
  const bool particles = spec_.particles.has_value();
  for (const char* name :
       {particles ? "symplectic_euler" : "euler", particles ? "implicit_euler" : "midpoint"}) {
    MethodChoice choice;
    choice.name = name;
    methods.push_back({choice, 0});
  }
  return methods;
}

Comparison::Runner Comparison::runner(const ComparedMethod& method) const {
  Registry& registry = *task_.problem.registry;
  const MethodChoice& choice = method.integrator;
  RunOptions options{
      .integrator = study::typed(choice, choice.over(spec_.integrator).name, registry),
      .dt = method.dt,
      .threads = task_.problem.options.threads};
  Simulation system(spec_, registry, options);
  std::string label = system.method().label();
  return {std::move(label), std::move(system)};
}

// The stride gives films the pictures that they want in a second, as far as the points of the
// reference allow it.
void Comparison::choose_frames() {
  const double wanted = task_.fps * time_;
  double best = HUGE_VAL;
  const auto intervals = static_cast<std::size_t>(reference_.intervals());
  for (std::size_t stride = 1; stride <= intervals; ++stride) {
    if (intervals % stride != 0) continue;
    const double off =
        std::abs(std::log(static_cast<double>(intervals / stride) / std::max(1.0, wanted)));
    if (off < best) best = off, stride_ = stride;
  }
}

// Whole steps until the next one would pass the end. False when one fails or it is told to end.
bool Comparison::step(Runner& runner, double end, const std::function<bool()>& go_on) const {
  Simulation& system = runner.system;
  const double slack = 1e-9 * system.h();
  while (system.t() + system.h() <= end + slack) {
    const double left = (end + slack - system.t()) / system.h();
    const auto count = static_cast<std::int64_t>(
        std::clamp(std::floor(left), 1.0, static_cast<double>(kStepsInOne)));
    const Stopwatch watch;
    const int taken = system.steps(count);
    runner.seconds += watch.seconds();
    if (taken == 0) {
      if (go_on()) runner.diverged_at = system.t();
      return false;
    }
    if (!go_on()) return false;
  }
  return true;
}

// The state at time t, to which a step of its own leads from the last whole one; the run goes on
// as if nobody had looked.
Frame Comparison::frame_at(Runner& runner, double t) const {
  Simulation& system = runner.system;
  if (t - system.t() <= 1e-9 * system.h()) {
    if (of_) runner.judged = of_->at(system);
    return take_frame(system);
  }
  const Snapshot before = system.snapshot();
  const std::int64_t evaluations = system.integrator().effort().evaluations;
  const bool done = system.step_to(t);
  Frame frame = done ? take_frame(system) : Frame(runner.frames.back());
  if (of_) runner.judged = done ? of_->at(system) : std::nan("");
  runner.looked += system.integrator().effort().evaluations - evaluations;
  system.restore(before);
  frame.t = t;
  return frame;
}

// A run of the method that was asked for, at as many times as other references have; its own error
// is not known.
study::Reference Comparison::reference_run(const study::Watch& watch) const {
  Runner run = runner(*task_.reference);
  Simulation& system = run.system;
  study::Reference reference;
  reference.how = "a run of " + run.method + ", " + method_step_text(system);
  const int intervals = study::reference_intervals(task_.problem, system);
  bool told = false;
  double done = 0;
  const auto go_on = [&] {
    told = told || !watch("reference", done);
    return !told;
  };
  system.stop_when([&] { return !go_on(); });
  for (int k = 0; k <= intervals; ++k) {
    const double t = time_ * k / intervals;
    done = 0.5 * k / intervals;
    const bool stepped = step(run, t, go_on);
    const Snapshot before = system.snapshot();
    const bool there = stepped && (t - system.t() <= 1e-9 * system.h() || system.step_to(t));
    if (told) return {};
    if (!there)
      throw Error(ErrorKind::kUsage,
                  {"no reference", run.method, "it diverged at t = " + brief(system.t(), 3) + " s",
                   "take a smaller step for it, or leave it out"});
    reference.points.push_back(study::coordinates(system));
    system.restore(before);
  }
  reference.error = {std::nan("")};
  return reference;
}

// The error of the frame at each particle, against that point of the reference.
void Comparison::measure(Runner& runner, Frame& frame, std::size_t point) {
  const std::vector<double>& exact = reference_.points[point];
  const std::vector<double>& now = model_.flat ? frame.components : frame.x;
  double sum = 0, most = 0;
  std::size_t next = 0;
  const std::size_t numbers = model_.flat ? now.size() : 3;
  for (int i = 0; i < model_.particles; ++i) {
    double square = 0;
    if (!std::ranges::binary_search(model_.pinned, i))
      for (std::size_t c = 0; c < numbers && next < exact.size(); ++c, ++next) {
        const double d = now[numbers * static_cast<std::size_t>(i) + c] - exact[next];
        square += d * d;
      }
    frame.values.push_back(std::sqrt(square));
    most = std::max(most, frame.values.back());
    sum += square;
  }
  runner.rms_end = next > 0 ? std::sqrt(sum / static_cast<double>(next)) : 0;
  runner.rms = std::max(runner.rms, runner.rms_end);
  runner.most = std::max(runner.most, most);
  frame.note = "t = " + brief(frame.t, 3) + " s   error " + amount(runner.rms_end);
  if (!of_ || of_->is_figure()) return;
  // Both references have 60 2^k intervals.
  const auto of = judged_.points.size() - 1, all = reference_.points.size() - 1;
  const double off = std::abs(runner.judged - judged_.points[point * of / all].front());
  if (!(off <= runner.off)) runner.off = off;
}

// A run of its own, to be seen at each step as any run is. Not a number when it diverges.
double Comparison::figure_of(const Runner& runner, const std::function<bool()>& go_on) const {
  Simulation system(spec_, *task_.problem.registry,
                    {.integrator = runner.system.method().choice(), .dt = runner.system.h()});
  system.stop_when([&] { return !go_on(); });
  study::Course course;
  const double slack = 1e-9 * system.h();
  for (bool good = true; good;) {
    course.look(system.t(), of_->at(system));
    if (system.t() >= time_ - slack) return course.figure(*of_);
    good = go_on() &&
           (system.t() + system.h() <= time_ + slack ? system.step() : system.step_to(time_));
  }
  return std::nan("");
}

// The picture of the reference at a point, for the viewpoint.
Moment Comparison::stage(std::size_t point, const Frame& like) const {
  Frame frame = like;
  if (model_.flat) return {frame};
  std::size_t next = 0;
  const std::vector<double>& x = reference_.points[point];
  for (int i = 0; i < model_.particles; ++i) {
    if (std::ranges::binary_search(model_.pinned, i)) continue;
    for (std::size_t c = 0; c < 3; ++c) frame.x[3 * static_cast<std::size_t>(i) + c] = x[next++];
  }
  return {frame};
}

bool Comparison::run(const study::Watch& watch) {
  study::Problem problem = task_.problem;
  size_ = study::scene_size(runners_.front().system);
  reference_ = task_.reference ? reference_run(watch) : study::reference(problem, time_, watch);
  if (reference_.points.empty()) return false;
  if (of_) {
    problem.of = of_;
    judged_ = study::reference(problem, time_, watch);
    if (judged_.points.empty()) return false;
  }
  choose_frames();
  const std::size_t frames = static_cast<std::size_t>(reference_.intervals()) / stride_;
  for (std::size_t r = 0; r < runners_.size(); ++r) {
    Runner& runner = runners_[r];
    double done = 0;
    const auto go_on = [&] { return watch(runner.method, done); };
    runner.system.stop_when([&] { return !go_on(); });
    for (std::size_t k = 0; k <= frames; ++k) {
      done = (static_cast<double>(r) + static_cast<double>(k) / static_cast<double>(frames + 1)) /
             static_cast<double>(runners_.size());
      const double t = time_ * static_cast<double>(k) / static_cast<double>(frames);
      if (!go_on()) return false;
      if (!runner.diverged() && step(runner, t, go_on)) {
        Frame frame = frame_at(runner, t);
        measure(runner, frame, k * stride_);
        if (model_.second_order) {
          const Energy energy = runner.system.energy();
          frame.kinetic = energy.kinetic, frame.potential = energy.potential;
        }
        if (!(runner.rms_end <= kLost * size_) && k > 0)
          runner.diverged_at = t;
        else
          runner.frames.push_back(std::move(frame));
      } else if (!runner.diverged()) {
        return false;
      }
      if (runner.diverged()) {  // it stands where it was last in sight
        runner.frames.push_back(Frame(runner.last_within(kInSight * size_)));
        runner.frames.back().t = t;
        runner.frames.back().note = "diverged at t = " + brief(runner.diverged_at, 3) + " s";
      }
      if (r == 0) stage_.push_back(stage(k * stride_, runner.frames.back()));
    }
    if (of_ && of_->is_figure() && !runner.diverged()) {
      runner.judged = figure_of(runner, go_on);
      if (!go_on()) return false;
      runner.off = std::abs(runner.judged - judged_.figure);
    }
    runner.system.stop_when({});
    runner.steps = runner.system.step_count();
    runner.evaluations = study::evaluations_of(runner.system) - runner.looked;
  }
  return true;
}

void Comparison::write(const std::vector<std::string>& files, const LookSpec& look,
                       const std::function<bool()>& stop) const {
  WriterTask task;
  task.world = true;
  task.look = make_look(spec_.look, look, names_of_field(spec_));
  if (task.look.colour == "none") task.look.colour = "error";
  // A run that is lost does not make all others look right.
  if (task.look.colour == "error" && task.look.most == 0)
    for (const Runner& runner : runners_)
      if (!runner.diverged()) task.look.most = std::max(task.look.most, round_up(runner.most));
  const auto grid = panel_grid(static_cast<int>(runners_.size()));
  if (spec_.look.size.empty() && look.size.empty()) {
    task.look.width = std::min(kMostWidth, kPanelWidth * grid.columns);
    task.look.height = kPanelHeight * grid.rows;
  }
  task.fps = static_cast<double>(stage_.size() - 1) / time_;
  task.stop = stop;
  task.panels.stage = stage_;
  for (const Runner& runner : runners_) {
    for (const Frame& frame : runner.frames)
      if (const double off = largest_of(frame.values);
          off > kSame * size_ && (off <= kInSight * size_ || !runner.diverged()))
        task.panels.stage.push_back({frame});
    task.models.push_back(model_);
    task.models.back().name = runner.method;
    task.models.back().method = runner.method;
    task.models.back().h = runner.system.h();
    task.panels.captions.push_back({runner.method, method_step_text(runner.system) + "   " +
                                                       brief(1e3 * runner.seconds / time_, 2) +
                                                       " ms a second"});
  }
  for (const std::string& file : files) {
    task.file = file;
    const std::unique_ptr<Writer> writer = make_writer(task, *task_.problem.registry);
    for (std::size_t k = 0; k < stage_.size(); ++k) {
      Moment moment;
      for (const Runner& runner : runners_) moment.push_back(runner.frames[k]);
      writer->add(moment);
    }
    writer->commit();
  }
}

std::string Comparison::table() const {
  const double known = largest_of(reference_.error);
  std::string text =
      label("scene", task_.name + " to t = " + brief(time_) + " s, size " +
                         (unit().empty() ? brief(size_, 4) : brief(size_, 4) + " m")) +
      label("reference",
            wrapped(reference_.how + (std::isnan(known) ? ", whose own error is not known"
                                                        : ", known to " + amount(known)),
                    12, 12));
  if (of_)
    text += label("judged", judged_text(task_.of, judged_.figure, largest_of(judged_.error)));
  std::vector<std::vector<std::string>> rows{
      {"integrator", "step, tol", "steps", "evals", "ms", "error", "most"}};
  if (of_) rows.front().push_back("off");
  for (const Runner& runner : runners_) {
    rows.push_back({runner.method, method_step_text(runner.system), std::to_string(runner.steps),
                    std::to_string(runner.evaluations), brief(1e3 * runner.seconds, 3)});
    if (runner.diverged()) {
      rows.back().push_back("diverged at t = " + brief(runner.diverged_at, 3) + " s");
      continue;
    }
    for (const double error : {runner.rms, runner.most})
      rows.back().push_back(known_error_text(error, known, 2));
    if (of_) rows.back().push_back(known_error_text(runner.off, largest_of(judged_.error), 2));
  }
  return text + '\n' + aligned(rows, "") + "error: rms of positions" +
         (unit().empty() ? "" : " in m") + ", the largest of all frames; most: of one particle.\n" +
         (!of_               ? ""
          : of_->is_figure() ? "off: of " + task_.of + ", as the steps of a run see it.\n"
                             : "off: of " + task_.of + ", the largest of all frames.\n");
}

std::string Comparison::json() const {
  std::vector<std::string> rows;
  for (const Runner& runner : runners_) {
    const bool good = !runner.diverged();
    rows.push_back(JsonObject()
                       .text("integrator", runner.method)
                       .number("dt", runner.system.h())
                       .integer("steps", runner.steps)
                       .integer("evaluations", runner.evaluations)
                       .number("seconds", runner.seconds)
                       .number("error", good ? runner.rms : std::nan(""))
                       .number("error_end", good ? runner.rms_end : std::nan(""))
                       .number("most", good ? runner.most : std::nan(""))
                       .number("judged", good ? runner.judged : std::nan(""))
                       .number("off", good && of_ ? runner.off : std::nan(""))
                       .number("diverged_at", runner.diverged_at)
                       .str());
  }
  return JsonObject()
      .text("system", spec_.name)
      .number("time", time_)
      .number("size", size_)
      .integer("frames", static_cast<std::int64_t>(stage_.size()))
      .json("reference", JsonObject()
                             .text("how", reference_.how)
                             .number("error", largest_of(reference_.error))
                             .str())
      .json("judged", of_ ? JsonObject()
                                .text("of", task_.of)
                                .number("figure", judged_.figure)
                                .number("error", largest_of(judged_.error))
                                .str()
                          : "null")
      .json("methods", json_array(rows))
      .str();
}

}  // namespace sim::report
