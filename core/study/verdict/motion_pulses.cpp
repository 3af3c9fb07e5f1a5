// A motion that is given may jump to and fro between two steps, which then see nothing of it.
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/array.h"
#include "core/base/noise.h"
#include "core/math/median.h"
#include "core/particles/particle_system.h"
#include "core/study/accuracy/error_estimator.h"
#include "core/study/verdict/pulses.h"
#include "core/study/verdict/step_doubling.h"

namespace sim::study {
namespace {

constexpr double kMostLooksAtMotion = 20'000;  // a study has at least so many for one path

// A step, within which paths and surfaces are looked at.
struct Step {
  double begin, end;  // s
  double at(double share) const { return begin + share * (end - begin); }
};

// Prescribed paths: how far they leave the line between the ends of a step.
class Paths {
 public:
  explicit Paths(const ParticleSystem& particles)
      : motion_(&particles.prescribed()), layout_(static_cast<int>(particles.masses().size()), 3) {
    for (Array* array : {&zero_, &begin_, &end_, &here_}) *array = Array(layout_.size());
  }

  double count() const { return static_cast<double>(motion_->ids().size()); }

  double leap(const Step& step, double share) {
    if (motion_->empty()) return 0;
    if (step.begin != last_) {
      place(step.begin, begin_);
      place(step.end, end_);
      last_ = step.begin;
    }
    place(step.at(share), here_);
    const auto begin = layout_.axes(begin_.data()), end = layout_.axes(end_.data()),
               here = layout_.axes(here_.data());
    double most = 0;
    for (const int i : motion_->ids()) {
      Vec3 off;
      for (std::size_t axis = 0; axis < 3; ++axis)
        off[static_cast<int>(axis)] =
            here[axis][i] - std::lerp(begin[axis][i], end[axis][i], share);
      most = std::max(most, off.norm());
    }
    return most;
  }

 private:
  // A chord from 0 within 1 s is the place; a velocity would take more values of the path.
  void place(double t, Array& to) {
    motion_->chords(t - 1, 1, layout_.axes(zero_.data()), layout_.axes(to.data()));
  }

  const PrescribedMotion* motion_;
  Layout layout_;
  Array zero_, begin_, end_, here_;
  double last_ = std::nan("");  // s, the step whose ends are known
};

// Moving colliders: how much deeper than at both ends of a step they are over some particles.
class Surfaces {
 public:
  explicit Surfaces(const ParticleSystem& particles) {
    for (Collider* const each : particles.contacts().all())
      if (each->moves()) colliders_.push_back(each);
    const std::span<const double> masses = particles.masses();
    std::vector<std::size_t> free;
    for (std::size_t i = 0; i < masses.size(); ++i)
      if (std::isfinite(masses[i])) free.push_back(i);
    constexpr std::size_t kMostPlaces = 1000;
    const std::size_t stride = free.size() / kMostPlaces + 1;
    for (std::size_t i = 0; i < free.size(); i += stride) ids_.push_back(free[i]);
  }

  double count() const { return static_cast<double>(colliders_.size() * ids_.size()); }

  // positions: of all particles, three numbers each.
  double leap(const Step& step, double share, std::span<const double> positions) {
    const double t = step.at(share);
    double most = 0;
    for (Collider* const collider : colliders_) {
      const auto gap = [&](double when, std::size_t i) {
        const std::span<const double> x = positions.subspan(3 * i, 3);
        return collider->query(when, Vec3(x[0], x[1], x[2])).gap;
      };
      prepare(*collider, t, step.end);
      deep_.clear();
      for (const std::size_t i : ids_)
        if (const double here = gap(t, i); here < -most) deep_.push_back({i, here});
      if (deep_.empty()) continue;
      prepare(*collider, step.begin, step.end);
      for (const auto& [i, here] : deep_)
        most = std::max(most, std::min({gap(step.begin, i), gap(step.end, i), 0.0}) - here);
    }
    return most;
  }

 private:
  // Inside an interval a function of a scene is known at its ends only.
  static void prepare(Collider& collider, double begin, double end) {
    if (collider.sampled()) collider.prepare_interval(begin, end);
  }

  std::vector<Collider*> colliders_;
  std::vector<std::size_t> ids_;
  std::vector<std::pair<std::size_t, double>> deep_;  // scratch: a particle and its gap
};

}  // namespace

bool has_given_motion(Simulation& run) {
  const ParticleSystem* particles = particles_of(run);
  return particles && (!particles->prescribed().empty() || particles->contacts().move());
}

// A motion that is farthest from going straight on within a step between two frames.
struct StepDoubling::Leap {
  std::size_t frame;  // the first of the two
  double at, length;  // s, m
};

// Looks at given motion at many times between the ends of steps: the farthest leap of each pair of
// frames.
std::vector<StepDoubling::Leap> StepDoubling::leaps_between_frames(Simulation& shadow) const {
  constexpr double kShare = 0.1;  // of the evaluations of the run
  const ParticleSystem& particles = *particles_of(shadow);
  Paths paths(particles);
  Surfaces surfaces(particles);
  const double each = std::max(1.0, paths.count() + surfaces.count());
  const double looks = std::clamp(std::max(kMostLooksAtMotion / std::max(1.0, each / 10),
                                           kShare * static_cast<double>(evaluations_of(*run_))),
                                  1.0, kMostLooksAtMotion);
  const int probes = std::max(4, static_cast<int>(looks / static_cast<double>(frames_.size())));
  std::vector<Leap> leaps;
  std::vector<double> places;
  Noise noise;
  for (std::size_t k = 0; k + 1 < frames_.size(); ++k) {
    const Frame &from = frames_[k], &to = frames_[k + 1];
    leaps.push_back({k, from.at.t, 0});
    Leap& worst = leaps.back();
    for (int i = 0; i < probes; ++i) {
      const double share = (i + noise.next() + 0.5) / probes;
      const double t = from.at.t + share * (to.at.t - from.at.t);
      const double begin = from.at.t + std::floor((t - from.at.t) / run_->h()) * run_->h();
      const Step step{begin, std::min(to.at.t, begin + run_->h())};
      if (!(t > step.begin && t < step.end)) continue;
      const double within = (t - step.begin) / (step.end - step.begin);
      double length = paths.leap(step, within);
      if (surfaces.count() > 0) {
        places.resize(from.seen.x.size());
        for (std::size_t j = 0; j < places.size(); ++j)
          places[j] = std::lerp(from.seen.x[j], to.seen.x[j], share);
        length = std::max(length, surfaces.leap(step, within, places));
      }
      if (length > worst.length) worst = {k, t, length};
    }
  }
  return leaps;
}

// How far the leap moves free particles until the end, m, by what fine steps to the next frame
// change. An impact that comes a moment sooner or later changes velocities at once, but hardly
// places.
double StepDoubling::moved_by(const Leap& leap, std::span<const double> masses) const {
  constexpr double kGone = 4;  // times the way since the leap
  constexpr int kFine = 1000;  // steps between two frames
  const Frame& to = frames_[leap.frame + 1];
  const std::optional<std::vector<double>> fine = resolved(leap.frame, kFine);
  if (!fine) return 0;
  const auto lacking = [&](const StatePart& part, std::size_t i) {
    Vec3 off;
    for (int axis = 0; axis < 3; ++axis) {
      const std::size_t at = part.at(i, static_cast<std::size_t>(axis));
      off[axis] = (*fine)[at] - to.seen.state[at];
    }
    return off.norm();
  };
  const StatePart &place = run_->shape().first(), &velocity = *run_->shape().find("velocity");
  double most = 0;
  for (std::size_t i = 0; i < velocity.count; ++i)
    if (std::isfinite(masses[i]))
      most = std::max(
          most, std::min(lacking(velocity, i), kGone * lacking(place, i) / (to.at.t - leap.at)));
  return most * (frames_.back().at.t - frames_[leap.frame].at.t);
}

// Leaps that are farther than usual are followed, a few of them.
void StepDoubling::look_for_leaps(Simulation& shadow, double allowed, RunDeviation& result) const {
  constexpr double kLeast = 1e-3;  // of the size, of a leap
  constexpr double kFar = 3;       // of the usual one
  constexpr std::size_t kTried = 4;
  std::vector<Leap> leaps = leaps_between_frames(shadow);
  std::vector<double> lengths;
  for (const Leap& leap : leaps) lengths.push_back(leap.length);
  const double usual = median(lengths);
  std::ranges::stable_sort(leaps, std::greater(), &Leap::length);
  leaps.resize(std::min(leaps.size(), kTried));
  for (const Leap& leap : leaps) {
    const double size = size_at(frames_[leap.frame + 1]);
    if (!(leap.length > std::max(kLeast * size, kFar * usual))) return;
    const double wrong = std::min(allowed, RunDeviation::kWrong * size);
    if (!(moved_by(leap, particles_of(shadow)->masses()) > std::max(wrong, result.error))) continue;
    result.missed_at = leap.at;
    result.missed_motion = true;
    return;
  }
}

}  // namespace sim::study
