#include "tests/hunt/random_scene.h"

#include <algorithm>
#include <cmath>

#include "core/base/text.h"
#include "core/study/limits/spectrum.h"
#include "tests/hunt/random_numbers.h"
#include "tests/support/scenes.h"

namespace sim_test {
namespace {

using sim::Vec3;

struct Ties {
  sim::PartSpec part;
  const std::vector<sim::ParticleSpec>& particles;
  double rest_share;  // of the distance at the start

  void tie(int a, int b, double stiffness) {
    const double length = (particles[static_cast<std::size_t>(a)].position -
                           particles[static_cast<std::size_t>(b)].position)
                              .norm();
    part.elements.add({a, b}, {{"stiffness", stiffness}, {"rest", rest_share * length}});
  }
};

// Particles with springs; returns the words for it.
std::string add_particles(Random& random, sim::SystemSpec& spec) {
  spec.particles.emplace();
  auto& list = spec.particles->list;
  const double mass = random.decade(-3, 3), spread = random.chance(0.4) ? 1.5 : 0;
  const double k = random.decade(-2, 7), k_spread = random.chance(0.4) ? 2 : 0;
  const auto masses = [&] { return mass * random.decade(-spread, spread); };
  const auto stiffness = [&] { return k * random.decade(-k_spread, k_spread); };
  const auto add = [&](const Vec3& x) {
    list.push_back({.position = x, .velocity = Vec3::Zero(), .mass = masses()});
    return static_cast<int>(list.size()) - 1;
  };
  const double rests[] = {1, 1, 1.2, 0.8, 0.5};
  Ties ties{make_springs("tie", k), list, rests[random.integer(0, 4)]};
  std::string words;
  switch (random.integer(0, 5)) {
    case 0: {
      const int n = random.integer(2, 10);
      words = "chain of " + std::to_string(n);
      for (int i = 0; i <= n; ++i) {
        add({0.3 * i, random.uniform(-0.05, 0.05), 0});
        if (i > 0) ties.tie(i - 1, i, stiffness());
      }
      break;
    }
    case 1: {
      const int n = random.integer(3, 6);
      words = "cloth " + std::to_string(n);
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) add({1.0 * j / n, 0, 1.0 * i / n});
      const int offsets[][2] = {{0, 1}, {1, 0}, {1, 1}, {1, -1}, {0, 2}, {2, 0}};
      for (const auto& o : offsets)
        for (int i = 0; i + o[0] < n; ++i)
          for (int j = std::max(0, -o[1]); j + o[1] < n && j < n; ++j)
            ties.tie(i * n + j, (i + o[0]) * n + j + o[1], k);
      break;
    }
    case 2: {
      const int n = random.integer(4, 16);
      words = "net of " + std::to_string(n);
      for (int i = 0; i < n; ++i) {
        add(random.vector(0.5));
        for (int t = 0; t < 2 && i > 0; ++t)
          if (t == 0 || i > 2) {
            const int other = random.integer(0, i - 1);
            ties.tie(other, i, stiffness());
          }
      }
      break;
    }
    case 3: {
      words = "lattice";
      for (int i = 0; i < 8; ++i) add({0.5 * (i & 1), 0.5 * (i >> 1 & 1), 0.5 * (i >> 2 & 1)});
      for (int i = 0; i < 8; ++i)
        for (int j = 0; j < i; ++j) ties.tie(j, i, k);
      break;
    }
    case 4: {
      words = "dumbbell and a light bead";
      add({0, 0, 0});
      add({1, 0, 0});
      add({1, 0.5, 0});
      list[2].mass = 1e-2 * list[0].mass;
      ties.tie(0, 1, k);
      ties.tie(1, 2, 0.1 * k);
      break;
    }
    default: {
      words = "pendulum";
      add({0, 0, 0});
      add({random.uniform(-1, 1), -1, random.uniform(-0.3, 0.3)});
      ties.tie(0, 1, k);
    }
  }
  const int free = static_cast<int>(list.size());
  if (random.chance(0.6)) {
    spec.particles->pinned.push_back(0);
    if (free > 3 && random.chance(0.5)) spec.particles->pinned.push_back(free - 1);
  }
  // Moves of a few percent of the length, kicks of the speed that belongs to them.
  if (random.chance(0.5))
    for (auto& p : list) p.position += random.vector(0.05);
  if (random.chance(0.5))
    for (auto& p : list) p.velocity = random.vector(0.2 * std::sqrt(k / mass));
  words += ", m " + sim::brief(mass, 2) + (spread > 0 ? " spread" : "") + ", k " +
           sim::brief(k, 2) + (k_spread > 0 ? " spread" : "");
  spec.forces.push_back(std::move(ties.part));
  if (random.chance(0.5)) {
    spec.forces.push_back(make_part("gravity", {{"g", Vec3(0, -9.81, 0)}}));
    words += ", gravity";
  }
  if (random.chance(0.4)) {
    spec.forces.push_back(make_drag(mass * std::sqrt(k / mass) * random.decade(-3, -0.5)));
    words += ", drag";
  }
  return words;
}

// A first-order field; returns the words and the time that belongs to it.
std::string add_field(Random& random, sim::SystemSpec& spec, sim::OdeFunction& field, double& time,
                      double& longest) {
  using In = std::span<const double>;
  using Out = std::span<double>;
  std::vector<double> start;
  std::string words;
  const double a = random.uniform(0.5, 2), b = random.decade(0, 1.3);
  time = 10;
  switch (random.integer(0, 8)) {
    case 0:
      words = "van der Pol, mu = " + sim::brief(b, 3);
      start = {random.uniform(-2, 2), random.uniform(-1, 1)};
      time = 20;
      field = [b](double, In x, Out d) {
        d[0] = x[1];
        d[1] = b * (1 - x[0] * x[0]) * x[1] - x[0];
      };
      break;
    case 1:
      words = "Lotka-Volterra";
      start = {10 * a, 5};
      time = 15;
      field = [](double, In x, Out d) {
        d[0] = x[0] * (1 - 0.1 * x[1]);
        d[1] = x[1] * (0.05 * x[0] - 1);
      };
      break;
    case 2:
      words = "Lorenz";
      start = {a, 1, 1};
      time = random.uniform(1, 15);
      field = [](double, In x, Out d) {
        d[0] = 10 * (x[1] - x[0]);
        d[1] = x[0] * (28 - x[2]) - x[1];
        d[2] = x[0] * x[1] - 8.0 / 3 * x[2];
      };
      break;
    case 3:
      words = "Brusselator";
      start = {1.5, 3};
      time = 20;
      field = [](double, In x, Out d) {
        d[0] = 1 + x[0] * x[0] * x[1] - 4 * x[0];
        d[1] = 3 * x[0] - x[0] * x[0] * x[1];
      };
      break;
    case 4:
      words = "pendulum of an angle";
      start = {3.0 * a / 2, 0};
      field = [b](double, In x, Out d) {
        d[0] = x[1];
        d[1] = -b * std::sin(x[0]);
      };
      break;
    case 5: {
      const double width = random.decade(-3, -1), at = random.uniform(1, 5);
      words = "pulse of width " + sim::brief(width, 2) + " at " + sim::brief(at, 4);
      start = {0.1, 0};
      time = 6;
      longest = width / 3;
      field = [width, at](double t, In x, Out d) {
        const double s = (t - at) / width;
        d[0] = x[1];
        d[1] = -x[0] + (s > 0 && s < 1 ? 30 / width * s * s * (1 - s) * (1 - s) : 0);
      };
      break;
    }
    case 6:
      words = "growth";
      start = {a};
      time = 3;
      field = [](double, In x, Out d) { d[0] = x[0]; };
      break;
    case 7: {
      const double drive = random.uniform(0.5, 20);
      words = "driven oscillator";
      start = {0, a};
      time = 15;
      field = [b, drive](double t, In x, Out d) {
        d[0] = x[1];
        d[1] = -b * b * x[0] - 0.1 * x[1] + std::sin(drive * t);
      };
      break;
    }
    default:
      words = "Kepler, eccentricity " + sim::brief(0.4 * a, 2);
      start = {1 - 0.4 * a, 0, 0, std::sqrt((1 + 0.4 * a) / (1 - 0.4 * a))};
      time = 20;
      field = [](double, In x, Out d) {
        const double r = std::sqrt(x[0] * x[0] + x[1] * x[1]), r3 = r * r * r;
        d[0] = x[2];
        d[1] = x[3];
        d[2] = -x[0] / r3;
        d[3] = -x[1] / r3;
      };
  }
  spec.first_order.emplace();
  spec.first_order->dimension = 1;
  spec.first_order->state = start;
  spec.first_order->field = make_part("lua", {{"f", field}});
  return words;
}

}  // namespace

RandomScene random_scene(std::uint64_t seed, sim::Registry& registry) {
  Random random(seed);
  RandomScene scene;
  sim::SystemSpec& spec = scene.spec;
  spec.name = "hunted";
  spec.integrator = "rk4";
  spec.dt = 1;
  double time = 1, fastest = 1;
  if (random.chance(0.7)) {
    scene.words = add_particles(random, spec);
    sim::Simulation system(spec, registry);
    fastest = sim::study::omega_bound(system);
    time = random.decade(0.5, 2.7) / fastest;
  } else {
    scene.words = add_field(random, spec, scene.field, time, scene.longest);
    fastest = 2;
  }
  const std::vector<std::string> methods = methods_for(spec, registry);
  const std::string method =
      methods[static_cast<std::size_t>(random.integer(0, static_cast<int>(methods.size()) - 1))];
  const sim::IntegratorInfo info = info_of(method, registry);
  const auto& plugin = registry.get<sim::Integrator>(method);
  const auto has = [&](const char* name) {
    return std::ranges::any_of(plugin.params,
                               [&](const sim::Param& param) { return param.name == name; });
  };
  sim::RunOptions& options = scene.options;
  options.integrator.name = method;
  double h = 2 / fastest * random.decade(-2.3, 0.18);
  if (info.implicit) h = random.decade(-2, 1.5) / fastest;
  if (info.adaptive || has("rtol") || method == "auto") {
    h = time / random.integer(10, 200);
    if (has("tol")) options.integrator.given["tol"] = random.decade(-6, -1);
  } else if (has("precision") && spec.particles && random.chance(0.15)) {
    options.integrator.given["precision"] = std::string("single");
  }
  h = std::clamp(h, time / 4000, time / 5);
  options.dt = h;
  scene.steps = std::max<std::int64_t>(1, static_cast<std::int64_t>(time / h));
  scene.words += "; " + method;
  for (const auto& [name, value] : options.integrator.given)
    scene.words += ":" + name + "=" + sim::to_text(value);
  scene.words += ", " + std::to_string(scene.steps) + " steps of " + sim::brief(h, 3) + " s";
  return scene;
}

}  // namespace sim_test
