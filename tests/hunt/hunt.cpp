#include "tests/hunt/hunt.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <memory>
#include <ostream>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/scene/simulation.h"
#include "core/study/limits/spectrum.h"
#include "core/study/run/track.h"
#include "tests/hunt/random_scene.h"
#include "tests/hunt/reference.h"
#include "tests/support/reference_model.h"

namespace sim_test {
namespace {

using sim::study::Trust;

constexpr double kWrong = 0.05, kWrongEnergy = 0.02;
constexpr double kDisturbance = 1e-7, kChaos = 1e5;
constexpr long kMostEvaluations = 400'000, kMostOfFields = 10'000'000;
constexpr int kLooks = 20;

using State = std::vector<double>;

// The numbers of a run in the order of the reference: x y z vx vy vz a particle, or a flat state.
State numbers_of(const sim::Simulation& system) {
  if (!system.second_order()) return {system.state().begin(), system.state().end()};
  State numbers;
  for (int i = 0; i < system.particles(); ++i) {
    const sim::Vec3 x = system.position(i), v = system.velocity(i);
    numbers.insert(numbers.end(), {x[0], x[1], x[2], v[0], v[1], v[2]});
  }
  return numbers;
}

// The space in which both are compared: points, or single numbers.
struct Geometry {
  bool particles;
  std::size_t stride() const { return particles ? 6 : 1; }
  std::size_t width() const { return particles ? 3 : 1; }

  double distance(const State& a, const State& b) const {
    double most = 0;
    for (std::size_t i = 0; i < a.size(); i += stride()) {
      double squared = 0;
      for (std::size_t k = i; k < i + width(); ++k) squared += (a[k] - b[k]) * (a[k] - b[k]);
      most = std::max(most, std::sqrt(squared));
    }
    return most;
  }

  double extent(const State& a) const {
    double size = 0;
    if (!particles) {
      for (const double value : a) size = std::max(size, std::abs(value));
      return size;
    }
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double low = HUGE_VAL, high = -HUGE_VAL;
      for (std::size_t i = axis; i < a.size(); i += 6) {
        low = std::min(low, a[i]);
        high = std::max(high, a[i]);
      }
      size = std::max(size, high - low);
    }
    return size;
  }
};

struct Frame {
  double t;
  State numbers;
  double energy;
};

}  // namespace

Case hunt_one(std::uint64_t seed, sim::Registry& registry) {
  RandomScene scene = random_scene(seed, registry);
  Case found;
  found.seed = seed;
  found.words = scene.words;
  std::unique_ptr<sim::Simulation> system;
  try {
    system = std::make_unique<sim::Simulation>(scene.spec, registry, scene.options);
  } catch (const sim::Error& error) {
    found.reason = error.what();
    return found;
  }
  sim::study::Track track(scene.spec, *system, scene.steps, sim::study::Track::kNever,
                          std::max<std::int64_t>(1, scene.steps / kLooks), &registry);
  std::vector<Frame> frames;
  const auto look = [&](bool last) {
    track.sample();
    if (track.take_row(last))
      frames.push_back(
          {system->t(), numbers_of(*system), system->second_order() ? track.energy().total() : 0});
  };
  look(false);
  bool whole = true;
  while (!track.finished() && (whole = system->steps(track.due()) > 0)) look(false);
  if (!whole) track.mark_diverged();
  if (whole) track.verify([] { return false; });
  const sim::study::Verdict verdict = track.verdict();
  found.verdict = verdict.trust;
  found.reason = verdict.reason;
  if (!whole) {
    found.truth = Truth::kWrong;  // it never got to the end
    return found;
  }

  const Geometry geometry{scene.spec.particles.has_value()};
  std::unique_ptr<ReferenceModel> model;
  if (geometry.particles) model = std::make_unique<ReferenceModel>(scene.spec);
  const Rhs f = [&](double t, const State& x) {
    if (model) return model->derivative(x);
    State dxdt(x.size());
    scene.field(t, x, dxdt);
    return dxdt;
  };
  std::vector<double> times;
  for (std::size_t k = 1; k < frames.size(); ++k) times.push_back(frames[k].t);
  const State start = model ? model->state() : scene.spec.first_order->state;
  const long most = model ? kMostEvaluations : kMostOfFields;
  const auto exact = extrapolated(f, start, times, 1e-13, scene.longest, most);
  State moved = start;
  const double size = std::max(geometry.extent(start), 1e-12);
  for (std::size_t i = 0; i < moved.size(); ++i)
    if (i % geometry.stride() < geometry.width() && f(0, start)[i] == f(0, start)[i])
      moved[i] += kDisturbance * size * std::sin(1.0 + double(i));
  if (model)
    for (const int pin : scene.spec.particles->pinned)
      for (std::size_t k = 0; k < 3; ++k) {
        const std::size_t i = 6 * static_cast<std::size_t>(pin) + k;
        moved[i] = start[i];
      }
  const auto near = extrapolated(f, moved, times, 1e-13, scene.longest, most);
  if (exact.empty() || near.empty()) return found;

  const auto energy = [&](const State& x) {
    return model ? model->kinetic(x) + model->potential(x) : 0.0;
  };
  double in_play = 0;
  for (const State& x : exact)
    if (model)
      in_play = std::max(
          in_play, model->kinetic(x) + std::abs(model->potential(x) - model->potential(start)));
  const double apart = std::max(geometry.distance(start, moved), 1e-300);
  for (std::size_t k = 0; k < exact.size(); ++k) {
    const double at = std::max({size, geometry.extent(exact[k]), 1e-300});
    const double off = geometry.distance(frames[k + 1].numbers, exact[k]) / at;
    if (!(off <= found.off)) found.off = off;
    if (in_play > 0)
      found.energy =
          std::max(found.energy, std::abs(frames[k + 1].energy - energy(exact[k])) / in_play);
    found.growth = std::max(found.growth, geometry.distance(near[k], exact[k]) / apart);
  }
  // Beyond this the reference itself is not known.
  if (found.growth > 1e11) return found;
  const bool chaotic = found.growth > kChaos;
  if (!(found.off <= kWrong) || !(found.energy <= kWrongEnergy))
    found.truth = chaotic ? Truth::kWrongAndChaotic : Truth::kWrong;
  else
    found.truth = found.off < kRight && found.energy < kRight ? Truth::kRight : Truth::kBetween;
  return found;
}

void Tally::add(const Case& found) {
  failed += !found.failed.empty();
  set_aside += found.set_aside;
  if (found.set_aside || !found.failed.empty()) return;
  mesh += found.mesh && found.truth == Truth::kRight;
  ++count[static_cast<std::size_t>(found.verdict)][static_cast<std::size_t>(found.truth)];
  if (found.verdict == Trust::kTrusted && !std::isnan(found.told)) {
    ++told;
    told_short += found.told < 2.0 / 3;
  }
  if (found.verdict == Trust::kChaotic && found.truth != Truth::kUnknown) {
    ++chaotic;
    late += found.late;
  }
}

bool Tally::good() const {
  return 1000 * trusted_but_wrong() <= 3 * judged() && 100 * right_but_doubted() <= 3 * right();
}

int Tally::judged() const {
  int sum = 0;
  for (const auto& row : count)
    for (std::size_t truth = 0; truth < 4; ++truth) sum += row[truth];
  return sum;
}

int Tally::trusted_but_wrong() const { return count[0][2] + count[0][3]; }
int Tally::right() const {
  int sum = 0;
  for (const auto& row : count) sum += row[0];
  return sum;
}
int Tally::right_but_doubted() const {
  return count[static_cast<std::size_t>(Trust::kSuspect)][0] +
         count[static_cast<std::size_t>(Trust::kDiverged)][0] - mesh;
}

namespace {

std::string share_of(int part, int whole) {
  return std::to_string(part) + " of " + std::to_string(whole) +
         (whole > 0 ? " (" + sim::brief(100.0 * part / whole, 2) + " %)" : "");
}

}  // namespace

std::ostream& operator<<(std::ostream& out, const Tally& tally) {
  const std::string right = "right <" + sim::brief(100 * tally.right_share, 2) + " %";
  out << "verdict     " << std::setw(13) << right
      << "   between   wrong   wrong, chaotic   not known\n";
  int runs = tally.failed + tally.set_aside;
  for (std::size_t verdict = 0; verdict < tally.count.size(); ++verdict) {
    const auto& row = tally.count[verdict];
    for (const int each : row) runs += each;
    out << std::left << std::setw(12) << sim::study::trust_name(static_cast<Trust>(verdict))
        << std::right << std::setw(13) << row[0] << std::setw(10) << row[1] << std::setw(8)
        << row[2] << std::setw(17) << row[3] << std::setw(12) << row[4] << '\n';
  }
  return out << runs << " runs, " << tally.judged() << " judged: trusted and wrong "
             << tally.trusted_but_wrong() << ", right and doubted "
             << share_of(tally.right_but_doubted(), tally.right())
             << (tally.mesh > 0 ? ", and " + std::to_string(tally.mesh) + " for their mesh" : "")
             << ", claims below 2/3 " << share_of(tally.told_short, tally.told)
             << ", horizons too late " << share_of(tally.late, tally.chaotic) << "; set aside "
             << tally.set_aside << ", failed " << tally.failed;
}

std::ostream& operator<<(std::ostream& out, const Case& found) {
  return out << "seed " << found.seed << ": " << found.words << "\n  "
             << sim::study::trust_name(found.verdict) << ": " << found.reason
             << "\n  truth: off by " << sim::brief(100 * found.off, 3)
             << " % of the size, energy by " << sim::brief(100 * found.energy, 3)
             << " %, a disturbance grows " << sim::brief(found.growth, 3) << " times"
             << (std::isnan(found.told) ? "" : ", told " + sim::brief(found.told, 2) + " of it")
             << (found.late ? ", wrong before the time told" : "") << '\n';
}

}  // namespace sim_test
