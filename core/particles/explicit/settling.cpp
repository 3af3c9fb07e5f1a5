#include "core/particles/explicit/settling.h"

#include <algorithm>
#include <cmath>

#include "core/particles/axes.h"

namespace sim {
namespace {

constexpr int kWaysAtOnce = 128;

}  // namespace

Settling::Settling(Particles& particles)
    : particles_(&particles), pressed_(static_cast<std::size_t>(particles.layout().n())) {}

void Settling::begin(double t, double t1) {
  particles_->contacts().ledger().begin_step();
  if (particles_->contacts().sampled()) particles_->contacts().look(t, t1);
}

Vec3 Settling::hold(double t, int i, const Vec3& q, const Vec3& v) {
  return particles_->contacts().hold(t, i, particles_->masses()[static_cast<std::size_t>(i)], q, v);
}

// May any of the particles [begin, end) touch something? No way is longer than that of the largest
// numbers of all of them: |p'| is within the hull of its Bezier points.
bool Settling::near(double t, double h, const In* from, const In& v0, const Out& q, const Out& v,
                    int begin, int end) const {
  const Extent extent =
      extent_of_(q.data(), v0.data(), v.data(), from ? from->data() : nullptr, begin, end);
  const double longest =
      h * (std::sqrt(extent.fastest[0]) + (from ? 1 : 2) * std::sqrt(extent.fastest[1])) +
      3 * std::sqrt(extent.farthest);
  Vec3 middle, half;
  for (int axis = 0; axis < 3; ++axis) {
    middle[axis] = 0.5 * extent.least[axis] + 0.5 * extent.most[axis];
    half[axis] = 0.5 * extent.most[axis] - 0.5 * extent.least[axis];
  }
  return particles_->contacts().near(t, h, middle, half, longest);
}

// Mostly nothing is near, which is seen of many particles at once.
template <class WayOf>
void Settling::settle(double t, double h, const In* from, const In& v0, const Out& q, const Out& v,
                      int begin, int end, bool hold_too, const WayOf& way_of) {
  const Contacts& contacts = particles_->contacts();
  if (contacts.accuracy() == Accuracy::kEvent) return;  // steps end where it touches
  std::fill(pressed_.begin() + begin, pressed_.begin() + end, std::uint8_t{0});
  if (end - begin > kWaysAtOnce && !near(t, h, from, v0, q, v, begin, end)) return;
  const std::span<const double> masses = particles_->masses();
  for (int first = begin; first < end; first += kWaysAtOnce) {
    const int last = std::min(first + kWaysAtOnce, end);
    if (!near(t, h, from, v0, q, v, first, last)) continue;
    for (int i = first; i < last; ++i) {
      const double mass = masses[static_cast<std::size_t>(i)];
      if (!(mass < HUGE_VAL)) continue;
      Way way = way_of(i);
      Vec3 place = vector_at(q, i);
      if (!contacts.near(t, h, place, Vec3::Zero(), way.length())) continue;
      Vec3 velocity = vector_at(v, i);
      if (!contacts.settle(t, h, i, mass, hold_too, way, place, velocity)) continue;
      pressed_[static_cast<std::size_t>(i)] = way.pressed;
      put_vector(q, i, place);
      put_vector(v, i, velocity);
    }
  }
}

void Settling::end(double t, double h, const In& q0, const In& v0, const Out& q, const Out& v,
                   int begin, int end) {
  settle(t, h, &q0, v0, q, v, begin, end, true, [&](int i) {
    return Way::between(h, vector_at(q0, i), vector_at(v0, i), vector_at(q, i), vector_at(v, i));
  });
}

void Settling::drifted(double t, double h, const In& q0, const In& v0, const Out& q, const Out& v,
                       int begin, int end) {
  settle(t, h, nullptr, v0, q, v, begin, end, false, [&](int i) {
    const Vec3 x0 = vector_at(q0, i), r0 = h * vector_at(v0, i);
    return Way{{x0, r0, vector_at(q, i) - x0 - r0, Vec3::Zero()}};
  });
}

bool SettledStepper::step(double t, double h, int count, const double* x, double* x_next) {
  if (!stepper_->step(t, h, count, x, x_next)) return false;
  settling_.begin(t, t + h);
  const Layout& layout = particles_->layout();
  particles_->team().run_parts(layout.n(), 16, [&](int begin, int end) {
    settling_.end(t, h, layout.axes(x), layout.axes(x, 3), layout.axes(x_next),
                  layout.axes(x_next, 3), begin, end);
  });
  return settling_.succeeded();
}

}  // namespace sim
