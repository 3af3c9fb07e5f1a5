// Checks of colliders against their geometric contract, and of motions against their derivatives.
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/base/text.h"
#include "core/geometry/rigid_motion.h"
#include "core/math/elementary.h"
#include "core/particles/collider.h"
#include "core/study/contract/examiner.h"

namespace sim::study::contract {
namespace {

constexpr int kPoints = 400;
constexpr double kSmall = 0x1p-20;  // m or s, of differences
constexpr double kTimes[] = {0, 0.25, 1.5};

// Pseudo-random numbers, the same in every run.
class Numbers {
 public:
  double next(double most) {
    seed_ = std::fmod(997 * seed_ + 0.617, 1.0);
    return (2 * seed_ - 1) * most;
  }
  Vec3 point(double most) {
    const double x = next(most), y = next(most);
    return {x, y, next(most)};
  }

 private:
  double seed_ = 0.5;
};

// The share of points at which a derivative differs from a difference quotient. Edges have none.
class Misses {
 public:
  void compare(double value, double difference) {
    ++all_;
    missed_ += !(std::fabs(value - difference) <= 1e-5 * std::max(1.0, std::fabs(difference)));
  }
  void report(Examiner& examiner, const std::string& name) const {
    constexpr double kEdges = 0.05;
    examiner.check(name, missed_ <= kEdges * all_,
                   missed_ == 0 ? "at " + std::to_string(all_) + " points"
                                : "but at " + std::to_string(missed_) + " of " +
                                      std::to_string(all_) + " points");
  }

 private:
  int all_ = 0, missed_ = 0;
};

// gap(a) - gap(b)| <= |a - b|, |normal| = 1, clearance <= gap: contact detection relies on them.
void check_distance(Collider& collider, Examiner& examiner) {
  constexpr double kRounding = 1e-9;
  Numbers numbers;
  Misses gradient;
  double longest = 0, normal = 0, above = 0;
  std::vector<double> seen;
  bool again = true, plain = true;
  for (const double t : kTimes) {
    if (collider.sampled()) collider.prepare_interval(t, t + kSmall);
    const PrimitiveSurface numbers_of = collider.as_primitive(t);
    for (int k = 0; k < kPoints; ++k) {
      const Vec3 a = numbers.point(3), b = a + numbers.point(1), half = numbers.point(1).cwiseAbs();
      const SurfaceSample at = collider.query(t, a);
      longest = std::max(longest, std::fabs(at.gap - collider.query(t, b).gap) - (a - b).norm());
      normal = std::max(normal, std::fabs(at.normal.norm() - 1));
      gradient.compare(1, (collider.query(t, a + kSmall * at.normal).gap -
                           collider.query(t, a - kSmall * at.normal).gap) /
                              (2 * kSmall));
      above = std::max(above, collider.clearance(t, b, half + (a - b).cwiseAbs()) - at.gap);
      plain = plain && (numbers_of.form == PrimitiveSurface::Form::kNone ||
                        (numbers_of.gap(a) == at.gap && numbers_of.velocity == at.velocity));
      again = again && collider.query(t, a).gap == at.gap;
      for (const double number : {at.gap, at.normal[0], at.normal[1], at.normal[2]})
        seen.push_back(number);
    }
  }
  examiner.check("finite", finite(seen), std::to_string(seen.size()) + " numbers");
  examiner.check("normals have the length 1", normal <= kRounding, "to " + brief(normal, 2));
  examiner.check("its gap changes by at most the way", longest <= kRounding,
                 longest <= kRounding ? "" : "by " + brief(longest, 2) + " m more");
  gradient.report(examiner, "its normal is the gradient of its gap, by differences");
  examiner.check("its clearance is no more than the gap in the box", above <= kRounding,
                 above <= kRounding ? "" : brief(above, 2) + " m more");
  examiner.check("the same bits as numbers", plain, "");
  examiner.check("the same bits again", again, "");
  examiner.hash(seen);
}

// A motion on a closed curve that rotates about the vertical.
class Circling final : public RigidMotion {
 public:
  Pose at(double t, const Vec3& center) const override {
    return {.center = center + Vec3(elementary::sin(t), elementary::cos(2 * t), 0),
            .velocity = {elementary::cos(t), -2 * elementary::sin(2 * t), 0},
            .sine = elementary::sin(0.5 * t),
            .cosine = elementary::cos(0.5 * t),
            .rate = 0.5};
  }
  double max_speed() const override { return 3; }
  double max_angular_speed() const override { return 0.5; }
};

// The example of the plugin, with a motion if it takes one.
Params moving_params(const Plugin<Collider>& plugin) {
  std::map<std::string, Value> given = example_values(plugin);
  for (const Param& param : plugin.params)
    if (param.type == ParamType::kMotion) given[param.name] = std::make_shared<const Circling>();
  return Params(plugin.title(), plugin.params, given, {}, plugin.free_numbers);
}

// Checks the velocity of the surface, and its bound, which limits the search for contact.
void check_motion_of(Collider& collider, Examiner& examiner) {
  if (!collider.moves()) return examiner.skipped("its surface has a velocity", "it does not move");
  Numbers numbers;
  Misses along, carried;
  double faster = 0;
  for (const double t : kTimes) {
    if (collider.sampled()) collider.prepare_interval(t, t + 2 * kSmall);
    const double fastest = collider.max_speed(t, t + 2 * kSmall);
    for (int k = 0; k < kPoints; ++k) {
      const Vec3 x = numbers.point(3);
      const SurfaceSample sample = collider.query(t + kSmall, x);
      const double rate =
          (collider.query(t + 2 * kSmall, x).gap - collider.query(t, x).gap) / (2 * kSmall);
      along.compare(-sample.normal.dot(sample.velocity), rate);
      faster = std::max(faster, std::fabs(rate) - fastest);
      carried.compare(sample.normal.dot(sample.velocity),
                      sample.normal.dot(collider.advect(t, t + 2 * kSmall, x) - x) / (2 * kSmall));
    }
  }
  along.report(examiner, "its velocity is how its gap falls, by differences");
  carried.report(examiner, "carries points with that velocity");
  constexpr double kRounding = 1e-6;
  examiner.check("is nowhere faster than it says", faster <= kRounding,
                 faster <= kRounding ? "" : "by " + brief(faster, 2) + " m/s");
}

void check_surface(const ContactMaterial& surface, Examiner& examiner) {
  examiner.check("restitution is 0 .. 1, friction at least 0",
                 surface.restitution >= 0 && surface.restitution <= 1 && surface.friction >= 0,
                 brief(surface.restitution, 3) + ", " + brief(surface.friction, 3));
}

// Checks the rotation by phi about an axis: d(sine)/dt = rate cosine, d(cosine)/dt = -rate sine.
void check_pose(const RigidMotion& motion, Examiner& examiner) {
  Misses velocity, rate;
  double off = 0, faster = 0;
  std::vector<double> seen;
  bool again = true;
  const Vec3 center(0.5, -1, 2);
  for (int k = 0; k < kPoints; ++k) {
    const double t = 0.01 * k + 0.003;
    const Pose before = motion.at(t - kSmall, center), now = motion.at(t, center),
               after = motion.at(t + kSmall, center);
    for (int axis = 0; axis < 3; ++axis) {
      velocity.compare(now.velocity[axis],
                       (after.center[axis] - before.center[axis]) / (2 * kSmall));
      seen.push_back(now.center[axis]);
    }
    rate.compare(now.rate * now.cosine, (after.sine - before.sine) / (2 * kSmall));
    rate.compare(-now.rate * now.sine, (after.cosine - before.cosine) / (2 * kSmall));
    off = std::max({off, std::fabs(now.axis.norm() - 1),
                    std::fabs(now.sine * now.sine + now.cosine * now.cosine - 1)});
    if (!motion.sampled())
      faster = std::max({faster, now.velocity.norm() - motion.max_speed() * (1 + 1e-12),
                         std::fabs(now.rate) - motion.max_angular_speed() * (1 + 1e-12)});
    again = again && motion.at(t, center).center == now.center;
  }
  examiner.check("finite", finite(seen), std::to_string(seen.size()) + " numbers");
  velocity.report(examiner, "its velocity is that of its center, by differences");
  rate.report(examiner, "its rate is that of its angle, by differences");
  examiner.check("its axis and its angle are proper", off <= 1e-9, "to " + brief(off, 2));
  examiner.check("is never faster than it says", faster <= 0,
                 faster <= 0 ? "" : "by " + brief(faster, 2));
  examiner.check("the same bits again", again, "");
  examiner.hash(seen);
}

}  // namespace

void check_collider(const Plugin<Collider>& plugin, Contract& contract) {
  Examiner examiner(plugin, contract);
  examiner.group("evaluates", [&] {
    const auto collider = made(plugin.make(example_params(plugin)), plugin);
    check_surface(collider->material(), examiner);
    check_distance(*collider, examiner);
    check_motion_of(*made(plugin.make(moving_params(plugin)), plugin), examiner);
    double sum = 0;
    examiner.allocations("a look", [&] { sum += collider->query(0, {1, 2, 3}).gap; });
  });
  examiner.bounds([&](const Params& params) {
    const auto collider = made(plugin.make(params), plugin);
    return std::vector<double>{collider->query(0, {0.5, 1, -2}).gap};
  });
}

void check_motion(const Plugin<RigidMotion>& plugin, Contract& contract) {
  Examiner examiner(plugin, contract);
  examiner.group("evaluates",
                 [&] { check_pose(*made(plugin.make(example_params(plugin)), plugin), examiner); });
  examiner.bounds([&](const Params& params) {
    const Pose pose = made(plugin.make(params), plugin)->at(0.5, {0, 0, 0});
    return std::vector<double>{pose.center[0], pose.sine, pose.rate};
  });
}

// Checks speeds from far below to far above those of scenes, and 0.
void check_law(const Plugin<ContactLaw>& plugin, Contract& contract) {
  constexpr double kSlowest = 1e-9, kFastest = 1e4, kRatio = 1.01;  // m/s
  const auto values_of = [](const ContactLaw& law) {
    std::vector<double> values{law.restitution(0), law.friction(0)};
    for (double speed = kSlowest; speed < kFastest; speed *= kRatio) {
      values.push_back(law.restitution(speed));
      values.push_back(law.friction(speed));
    }
    return values;
  };
  Examiner examiner(plugin, contract);
  examiner.group("evaluates", [&] {
    const auto law = made(plugin.make(example_params(plugin)), plugin);
    const std::vector<double> values = values_of(*law);
    const double rest = values[0], stick = values[1];
    bool bounded = true, changes = false, begins = true;
    double jump = 0;
    for (std::size_t k = 0; k < values.size(); k += 2) {
      const double e = values[k], mu = values[k + 1];
      bounded = bounded && e >= 0 && e <= 1 && mu >= 0;
      changes = changes || e != rest || mu != stick;
      begins = begins && (rest != 0 || e == 0) && (stick != 0 || mu == 0);
      if (k >= 4) {
        jump = std::max(jump, std::fabs(e - values[k - 2]));
        jump = std::max(jump, std::fabs(mu - values[k - 1]) / std::max(1.0, mu));
      }
    }
    examiner.check("finite", finite(values), std::to_string(values.size()) + " numbers");
    examiner.check("restitution is 0 .. 1, friction at least 0", bounded,
                   "at speeds from 0 to 1e4 m/s");
    examiner.check("is 0 at rest only where it is 0 at all speeds", begins, "");
    constexpr double kLargest = 0.05;  // in a hundredth of the speed
    examiner.check("does not jump", jump <= kLargest, "by " + brief(jump, 2));
    examiner.check("says whether it depends on the speed", !law->constant() || !changes, "");
    examiner.check("the same bits again", same(values, values_of(*law)), "");
    double sum = 0;
    examiner.allocations("a look", [&] { sum += law->friction(0.5) + law->restitution(0.5); });
    examiner.hash(values);
  });
  examiner.bounds(
      [&](const Params& params) { return values_of(*made(plugin.make(params), plugin)); });
}

}  // namespace sim::study::contract
