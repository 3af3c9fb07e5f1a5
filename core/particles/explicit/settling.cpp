#include "core/particles/explicit/settling.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr int kWaysAtOnce = 512;

}  // namespace

Settling::Settling(Particles& particles)
    : particles_(&particles),
      near_(static_cast<std::size_t>(particles.layout().n())),
      pressed_(near_.size()) {}

template <class WayOf>
bool Settling::settle(double t, double h, const double* x, double* x_next, bool hold,
                      const WayOf& way_of) {
  const Layout& layout = particles_->layout();
  const Contacts& contacts = particles_->contacts();
  const ParticleView before = particles_->view(t, x), after = particles_->view(t + h, x_next);
  const auto q = layout.axes(x_next), v = layout.axes(x_next, 3);
  touched_ = false;
  particles_->team().run_parts(layout.n(), 8, [&](int first, int last) {
    for (int begin = first; begin < last; begin += kWaysAtOnce) {
      const Tile tile{begin, std::min(begin + kWaysAtOnce, last)};
      // The length of any way in this tile is at most |c1| + 2 |c2| + 3 |c3| of the largest.
      double largest[3] = {};
      for (int i = tile.begin; i < tile.end; ++i) {
        const Way way = way_of(i);
        for (int k = 0; k < 3; ++k) largest[k] = std::max(largest[k], way.c[k + 1].squaredNorm());
      }
      const double longest =
          std::sqrt(largest[0]) + 2 * std::sqrt(largest[1]) + 3 * std::sqrt(largest[2]);
      std::uint8_t* const near = near_.data() + begin;
      std::fill_n(near, tile.end - tile.begin, std::uint8_t{0});
      std::fill_n(pressed_.begin() + begin, tile.end - tile.begin, std::uint8_t{0});
      contacts.near(t, h, after, tile, longest, near);
      for (int i = tile.begin; i < tile.end; ++i) {
        if (!near[i - begin] || !before.free(i)) continue;
        Way way = way_of(i);
        contacts.settle(t, h, way);
        if (!way.touched) continue;
        touched_.store(true, std::memory_order_relaxed);
        pressed_[static_cast<std::size_t>(i)] = way.pressed;
        const Vec3 end = after.position(i) + way.moved;
        Vec3 velocity = after.velocity(i) + way.kicked / h;
        if (hold && way.pressed) velocity = contacts.hold(t + h, end, velocity);
        for (int axis = 0; axis < 3; ++axis) {
          q[axis][i] = end[axis];
          v[axis][i] = velocity[axis];
        }
      }
    }
  });
  return touched_;
}

bool Settling::end(double t, double h, const double* x, double* x_next) {
  const ParticleView a = particles_->view(t, x), b = particles_->view(t + h, x_next);
  return settle(t, h, x, x_next, true, [&](int i) {
    const Vec3 x0 = a.position(i), v0 = h * a.velocity(i), v1 = h * b.velocity(i);
    const Vec3 d = b.position(i) - x0;
    return Way{{x0, v0, 3 * d - 2 * v0 - v1, v0 + v1 - 2 * d}};
  });
}

void Settling::drifted(double t, double h, const double* x, double* x_next) {
  const ParticleView a = particles_->view(t, x), b = particles_->view(t + h, x_next);
  settle(t, h, x, x_next, false, [&](int i) {
    const Vec3 x0 = a.position(i), v0 = h * a.velocity(i);
    return Way{{x0, v0, b.position(i) - x0 - v0, Vec3::Zero()}};
  });
}

void Settling::kicked(double t, double* x_next) {
  const Layout& layout = particles_->layout();
  const ParticleView view = particles_->view(t, x_next);
  const auto v = layout.axes(x_next, 3);
  particles_->team().run_parts(layout.n(), 8, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) {
      if (!pressed_[static_cast<std::size_t>(i)]) continue;
      const Vec3 held = particles_->contacts().hold(t, view.position(i), view.velocity(i));
      for (int axis = 0; axis < 3; ++axis) v[axis][i] = held[axis];
    }
  });
}

}  // namespace sim
