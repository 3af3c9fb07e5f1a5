#include "cli/view/measured.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/base/finite.h"
#include "core/base/text.h"
#include "core/picture/look.h"
#include "core/picture/quantity.h"
#include "core/study/limits/spectrum.h"

namespace sim::cli {
namespace {

constexpr std::int64_t kTelling = 100;  // steps, after which an unstable one shows

}  // namespace

void Measured::ask(std::uint64_t who, const std::string& colour) {
  std::vector<std::string> known = sim::Look::colours();
  known.insert(known.begin(), "plain");
  const std::vector<std::string> names = names_of_fields(scene_.spec);
  known.insert(known.end(), names.begin(), names.end());
  if (std::ranges::find(known, colour) == known.end())
    throw Error(ErrorKind::kUsage, {"unknown colour '" + colour.substr(0, 40) + "'", "",
                                    "there is none of that name", "known: " + join(known, ", ")});
  const std::string before = name();
  leave(who);
  if (colour == "energy" || colour == "error" || colour == "mode") asked_.emplace_back(who, colour);
  if (name() != before) begin_anew();
}

void Measured::leave(std::uint64_t who) {
  std::erase_if(asked_, [&](const auto& each) { return each.first == who; });
}

void Measured::afford(bool errors) {
  if (errors == affords_) return;
  affords_ = errors;
  if (name() != "error") begin_anew();
}

void Measured::begin_anew() {
  ones_.clear();
  for (std::size_t i = 0; i < scene_.systems.size(); ++i) {
    Simulation& system = scene_.systems[i];
    One one{.begin = system.step_count()};
    if (name() == "mode") one.mode = study::fastest_mode(system);
    if (affords_ || name() == "error")
      one.companion =
          std::make_unique<study::ErrorEstimator>(scene_.spec.systems[i], system, registry_);
    ones_.push_back(std::move(one));
    follow(i);
  }
}

void Measured::follow(std::size_t i) {
  One& one = ones_[i];
  one.behind = false;
  if (one.companion) one.companion->follow(scene_.systems[i]);
}

// The companion first follows the run up to now, so that it can follow this change as well.
void Measured::before_touch(std::size_t i) {
  if (i >= ones_.size() || !ones_[i].companion) return;
  if (ones_[i].behind) follow(i);
  ones_[i].companion->advance(scene_.systems[i]);
  ones_[i].behind = true;
}

void Measured::touched(std::size_t i, const Action& action) {
  using What = Action::What;
  if (i >= ones_.size()) return;
  if (action.what == What::kDt || action.what == What::kIntegrator) return begin_anew();
  if (!ones_[i].companion) return;
  const bool jumps = action.what == What::kPosition || action.what == What::kVelocity ||
                     action.what == What::kComponent;
  if (jumps) ones_[i].companion->act(action);
  follow(i);
}

study::RunDeviation Measured::parted(std::size_t i) const {
  return i < ones_.size() ? ones_[i].parted : study::RunDeviation();
}

// The largest error, and its share of the scene's size at that time.
void Measured::judge(One& one, const Frame& frame, const std::vector<double>& errors) {
  double size = 0, most = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (std::size_t i = axis; i < frame.x.size(); i += 3) {
      low = std::min(low, frame.x[i]);
      high = std::max(high, frame.x[i]);
    }
    size = std::max(size, high - low);
  }
  for (const double error : errors) most = larger_error(error, most);
  study::RunDeviation& parted = one.parted;
  if (!std::isfinite(most) || !(size > 0) || frame.step < one.begin + kTelling) return;
  parted.outcome = study::RunDeviation::Outcome::kCompared;
  parted.at_end = most;
  if (!(most <= parted.error)) parted.error = most;
  if (!(most / size <= parted.share)) parted.share = most / size;
}

void Measured::fill(Moment& moment, const std::vector<Model>& models) {
  const std::string what = name();
  for (std::size_t i = 0; i < moment.size(); ++i) {
    if (what == "energy") moment[i].values = quantity(models[i], moment[i], what);
    if (i >= ones_.size()) continue;
    One& one = ones_[i];
    if (what == "mode") moment[i].values = one.mode;
    if (!one.companion) continue;
    if (one.behind) follow(i);
    std::vector<double> errors = one.companion->errors(scene_.systems[i]);
    judge(one, moment[i], errors);
    if (what == "error") moment[i].values = std::move(errors);
  }
}

}  // namespace sim::cli
