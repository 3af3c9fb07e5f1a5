// Scenes whose states are computed here by plain loops, to be compared with what writers write.
#pragma once

#include <array>
#include <cmath>
#include <vector>

namespace sim_test {

inline constexpr int kStripParticles = 6, kStripFrames = 5;
inline constexpr double kStripStep = 0.01;

// Six particles of different masses, springs of two families, three triangles, all of it oblique.
inline constexpr const char* kStrip = R"lua(
local sim = require "sim"
local p = sim.particles { mass = 1 }
for i = 0, 5 do
  p:add({ i % 3 + 0.1 * i, 0.3 * i, 0.05 * i * i },
    { mass = 0.5 + 0.25 * i, velocity = { 0.1 * i, -0.2 * i, 0.3 * i - 0.1 * i * i } })
end
p:pin(0)
local along = sim.force.spring { family = "along", stiffness = 20 }
for _, i in ipairs { 0, 1, 3, 4 } do along:tie(i, i + 1, { rest = 0.9 + 0.1 * i }) end
local across = sim.force.spring { family = "across", stiffness = 35 }
for i = 0, 2 do across:tie(i, i + 3, { rest = 0.8 }) end
local skin = sim.surface { particles = p, triangles = { { 0, 1, 4 }, { 0, 4, 3 }, { 1, 2, 5 } } }
return sim.scene { name = "strip", particles = p, surfaces = { skin }, integrator = "euler",
  dt = 0.01, duration = 0.04,
  observe = { high = function(s) return s:position(5)[2] end,
    fast = function(s) return s:velocity(2)[1] end },
  forces = { sim.force.gravity { g = { 0.5, -9.81, 0.2 } }, sim.force.drag { k = 0.3 }, along,
    across } }
)lua";

// Two points of first order.
inline constexpr const char* kFlow = R"lua(
local sim = require "sim"
return sim.scene { name = "flow", state = { x = { { 1, 0.5, 2 }, { -3, 0.25, 4 } } },
  field = sim.field.rotation { omega = 3 }, integrator = "euler", dt = 0.01, duration = 0.04 }
)lua";

// Four numbers.
inline constexpr const char* kFlat = R"lua(
local sim = require "sim"
return sim.scene { name = "flat", state = { 1, 0.5, -2, 8 }, integrator = "euler", dt = 0.01,
  duration = 0.04,
  field = sim.field.lua { function(t, x) return { x[2], -x[1], t, x[4] } end } }
)lua";

inline constexpr const char* kWorld = R"lua(
local sim = require "sim"
return sim.world { strip = require "strip", flow = require "flow", flat = require "flat" }
)lua";

using Triple = std::array<double, 3>;

struct StripFrame {
  double t = 0, kinetic = 0, potential = 0, drag_power = 0;
  std::array<Triple, kStripParticles> x{}, v{};

  double total() const { return kinetic + potential; }
};

struct StripSpring {
  int a, b, family;
  double k, rest;

  double length(const StripFrame& frame) const {
    const Triple &p = frame.x[static_cast<std::size_t>(a)],
                 &q = frame.x[static_cast<std::size_t>(b)];
    return std::hypot(q[0] - p[0], q[1] - p[1], q[2] - p[2]);
  }
};

inline const std::vector<StripSpring> kStripSprings{
    {0, 1, 0, 20, 0.9}, {1, 2, 0, 20, 1.0}, {3, 4, 0, 20, 1.2}, {4, 5, 0, 20, 1.3},
    {0, 3, 1, 35, 0.8}, {1, 4, 1, 35, 0.8}, {2, 5, 1, 35, 0.8}};
inline const std::vector<std::array<int, 3>> kStripTriangles{{0, 1, 4}, {0, 4, 3}, {1, 2, 5}};

inline double strip_mass(int i) { return 0.5 + 0.25 * i; }

// Euler's method, particle by particle and spring by spring.
inline std::vector<StripFrame> strip_frames() {
  constexpr Triple kG{0.5, -9.81, 0.2};
  constexpr double kDrag = 0.3;
  StripFrame now;
  for (int i = 0; i < kStripParticles; ++i) {
    const auto at = static_cast<std::size_t>(i);
    now.x[at] = {i % 3 + 0.1 * i, 0.3 * i, 0.05 * i * i};
    now.v[at] = {0.1 * i, -0.2 * i, 0.3 * i - 0.1 * i * i};
  }
  std::vector<StripFrame> frames;
  for (int step = 0; step < kStripFrames; ++step) {
    now.t = kStripStep * step;
    now.kinetic = now.potential = now.drag_power = 0;
    std::array<Triple, kStripParticles> force{};
    for (std::size_t i = 1; i < kStripParticles; ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        const double mass = strip_mass(static_cast<int>(i));
        force[i][c] = mass * kG[c] - kDrag * now.v[i][c];
        now.kinetic += mass * now.v[i][c] * now.v[i][c] / 2;
        now.potential -= mass * kG[c] * now.x[i][c];
        now.drag_power += kDrag * now.v[i][c] * now.v[i][c];
      }
    for (const StripSpring& spring : kStripSprings) {
      const double length = spring.length(now), stretch = length - spring.rest;
      now.potential += spring.k * stretch * stretch / 2;
      const auto a = static_cast<std::size_t>(spring.a), b = static_cast<std::size_t>(spring.b);
      for (std::size_t c = 0; c < 3; ++c) {
        const double f = spring.k * stretch * (now.x[b][c] - now.x[a][c]) / length;
        force[a][c] += f;
        force[b][c] -= f;
      }
    }
    frames.push_back(now);
    for (std::size_t i = 1; i < kStripParticles; ++i)
      for (std::size_t c = 0; c < 3; ++c) {
        now.x[i][c] += kStripStep * now.v[i][c];
        now.v[i][c] += kStripStep * force[i][c] / strip_mass(static_cast<int>(i));
      }
  }
  return frames;
}

// The states of the two first-order scenes, frame by frame.
inline std::vector<std::array<Triple, 2>> flow_frames() {
  std::vector<std::array<Triple, 2>> frames{{{{1, 0.5, 2}, {-3, 0.25, 4}}}};
  for (int step = 1; step < kStripFrames; ++step) {
    auto next = frames.back();
    for (Triple& p : next) p = {p[0] - 0.03 * p[1], p[1] + 0.03 * p[0], p[2]};
    frames.push_back(next);
  }
  return frames;
}

inline std::vector<std::array<double, 4>> flat_frames() {
  std::vector<std::array<double, 4>> frames{{1, 0.5, -2, 8}};
  for (int step = 1; step < kStripFrames; ++step) {
    const auto [a, b, c, d] = frames.back();
    frames.push_back({a + 0.01 * b, b - 0.01 * a, c + 0.01 * (0.01 * (step - 1)), d + 0.01 * d});
  }
  return frames;
}

}  // namespace sim_test
