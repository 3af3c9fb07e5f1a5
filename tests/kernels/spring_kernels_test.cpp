// Kernels of springs and dashpots, compared with plain loops.
#include <limits>

#include "core/base/bits.h"
#include "core/particles/springs/dashpots.h"
#include "core/particles/springs/energy.h"
#include "core/particles/springs/net_forces.h"
#include "core/particles/springs/stiffness.h"
#include "tests/support/kernel_cases.h"

using namespace sim_test;
using sim::SpringSense;
using sim::Vec3;

namespace {

constexpr int kStride = 3;
// Coordinates of the extreme particle.
constexpr double kExtremes[] = {40, 1e-3, 1e160, 1e-160, std::numeric_limits<double>::quiet_NaN()};

// Positions and velocities of particles, one of which is far away, or alone near the origin.
struct Points {
  Axes q, v;

  Points(int items, int extreme, double value) : q(items), v(items) {
    scatter(q, 0);
    scatter(v, 1);
    for (int k = 0; k < 3; ++k) {
      q[k][extreme] = value * (k + 1);
      v[k][extreme] = 20 - 3 * k;
    }
  }
  Vec3 at(int i) const { return {q[0][i], q[1][i], q[2][i]}; }
  Vec3 velocity(int i) const { return {v[0][i], v[1][i], v[2][i]}; }
  sim::ParticleView view() const {
    return {.n = q[0].items(),
            .x = q[0].data(),
            .y = q[1].data(),
            .z = q[2].data(),
            .vx = v[0].data(),
            .vy = v[1].data(),
            .vz = v[2].data()};
  }
};

// Springs between a and a + stride for the particles that own one; all alike or each its own.
sim::SpringRun run_of(int items, int stride, bool uniform, SpringSense sense = SpringSense::kBoth) {
  sim::SpringRun run;
  run.stride = stride;
  run.uniform = uniform;
  run.sense = sense;
  run.k = 30;
  run.rest = 0.7;
  run.owners = bits_where(items, [&](int a) { return a + stride < items && a % 5 != 2; });
  if (!uniform) {
    run.ks = sim::Array(static_cast<std::size_t>(items + 2 * sim::SpringRun::kPad));
    run.rests = sim::Array(static_cast<std::size_t>(items + 2 * sim::SpringRun::kPad));
    for (int a = 0; a < items; ++a) {
      run.ks[static_cast<std::size_t>(a + sim::SpringRun::kPad)] = 20 + 3 * a;
      run.rests[static_cast<std::size_t>(a + sim::SpringRun::kPad)] = a % 3 ? 0.1 * a : 0;
    }
  }
  return run;
}

// Calls check(run) for runs of several strides, uniform and not, and of springs of one sense.
template <class Check>
void for_each_run(int items, const Check& check) {
  for (const int stride : {1, kStride, 9}) {
    for (const bool uniform : {true, false}) {
      CAPTURE(stride, uniform);
      check(run_of(items, stride, uniform));
    }
    for (const SpringSense sense : {SpringSense::kTension, SpringSense::kCompression}) {
      CAPTURE(stride, static_cast<int>(sense));
      check(run_of(items, stride, false, sense));
    }
  }
}

// True if a spring with this d pulls or pushes, independently of the code under test.
bool acts(SpringSense sense, const Vec3& d, double rest) {
  const double length = std::hypot(d[0], d[1], d[2]);
  if (sense == SpringSense::kTension) return !(length < rest);
  if (sense == SpringSense::kCompression) return !(length > rest);
  return true;
}

// The larger of the results of a plain loop, by which errors are measured.
double size_of(const Axes& axes) {
  double most = 0;
  for (int k = 0; k < 3; ++k)
    for (const double value : axes[k].span()) most = std::fmax(most, std::fabs(value));
  return most;
}

bool near(const Axes& got, const Axes& want, double tolerance) {
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < want[k].items(); ++i)
      if (!agree(got[k][i], want[k][i], tolerance * (std::fabs(want[k][i]) + 1e-3))) return false;
  return true;
}

sim::ForceSink sink_of(Axes& to) { return {to[0].data(), to[1].data(), to[2].data()}; }

}  // namespace

TEST_CASE("energies of runs are those of a plain loop", "[energy_kernel]") {
  for_each_lane([](int items, int extreme) {
    for_each_run(items, [&](const sim::SpringRun& run) {
      for (const double value : {40.0, 1e-3, 1e150, 1e-160}) {
        const Points points(items, extreme, value);
        double plain = 0;
        for (int a = 0; a < items; ++a) {
          if (!run.owns(a)) continue;
          const Vec3 d = points.at(a) - points.at(a + run.stride);
          const double strain = std::hypot(d[0], d[1], d[2]) - run.rest_of(a);
          if (!acts(run.sense, d, run.rest_of(a))) continue;
          plain += 0.5 * run.k_of(a) * strain * strain;
        }
        CAPTURE(value);
        CHECK(sim::run_energy(run, points.view(), 0, items) == Approx(plain).epsilon(1e-13));
      }
    });
  });
}

TEST_CASE("forces of dashpots are those of a plain loop", "[dashpot_kernel]") {
  for_each_lane([](int items, int extreme) {
    for (const int stride : {1, kStride, 9})
      for (const double value : kExtremes)
        for (const SpringSense sense :
             {SpringSense::kBoth, SpringSense::kTension, SpringSense::kCompression}) {
          const Points points(items, extreme, value);
          Column c(items, 0), rest(items, 0);
          for (int a = 0; a + stride < items; ++a) c[a] = a % 5 == 2 ? 0 : 1 + 0.1 * a;
          for (int a = 0; a + stride < items; ++a) rest[a] = 0.3 * (a % 7);
          Axes forces(items), plain(items);
          for (int k = 0; k < 3; ++k)
            for (int i = 0; i < items; ++i) forces[k][i] = plain[k][i] = k;
          for (int a = 0; a + stride < items; ++a) {
            if (c[a] == 0) continue;
            const int b = a + stride;
            const Vec3 d = points.at(a) - points.at(b);
            if (!acts(sense, d, rest[a])) continue;
            const Vec3 u = d / std::hypot(d[0], d[1], d[2]);
            const Vec3 f = -c[a] * (points.velocity(a) - points.velocity(b)).dot(u) * u;
            for (int k = 0; k < 3; ++k) {
              plain[k][a] += f[k];
              plain[k][b] -= f[k];
            }
          }
          const sim::DashpotRun runs[] = {{c.data(), stride, sense, rest.data()}};
          sim::dashpot_forces()({runs, 1}, points.view(), 0, items, sink_of(forces));
          CAPTURE(stride, value);
          CHECK(near(forces, plain, 1e-12));
          CHECK(forces[0][items] == 7777);
        }
  });
}

TEST_CASE("forces of nets are those of a plain loop", "[net_kernel]") {
  for_each_lane([](int items, int extreme) {
    for (const bool uniform : {true, false})
      for (const double value : kExtremes)
        for (const SpringSense sense :
             {SpringSense::kBoth, SpringSense::kTension, SpringSense::kCompression}) {
          std::vector<sim::Net::Spring> springs;
          for (int a = 0; a < items; ++a)
            for (const int step : {1, 4, 7})
              if (const int b = (a * step + step + 2) % items; a < b)
                springs.push_back({a, b, uniform ? 30.0 : 20.0 + a, uniform ? 0.7 : 0.05 * b});
          if (springs.empty()) continue;
          const Points points(items, extreme, value);
          const sim::Net net(items, springs, sense);
          Axes forces(items), plain(items);
          for (const auto& [a, b, k, rest] : springs) {
            if (!acts(sense, points.at(a) - points.at(b), rest)) continue;
            const Vec3 f = sim::spring_force(points.at(a) - points.at(b), k, k * rest);
            for (int axis = 0; axis < 3; ++axis) {
              plain[axis][a] += f[axis];
              plain[axis][b] -= f[axis];
            }
          }
          std::vector<double> packed(static_cast<std::size_t>(4 * items + 64));
          for (int i = 0; i < items; ++i)
            for (int k = 0; k < 3; ++k)
              packed[static_cast<std::size_t>(4 * i + k)] = points.q[k][i];
          const auto q = inputs(points.q);
          sim::net_kernels().add(net, q, packed.data(), 0, items, sink_of(forces));
          CAPTURE(uniform, value);
          CHECK(near(forces, plain, 1e-12));
          CHECK((size_of(forces) > 0 || std::isnan(value) || sense != SpringSense::kBoth));
        }
  });
}

namespace {

// A run with room for its stiffness, in columns that are zero outside of it as those of a layout.
struct StiffCase {
  Column along, across;
  sim::StiffRun run;

  StiffCase(int items, const sim::SpringRun& springs)
      : along(items, 0),
        across(items, 0),
        run{sim::RunColumns(springs), along.data(), across.data()} {}
  void fill(int items) {
    for (int a = 0; a < items; ++a)
      if (sim::bit(run.owners, a)) {
        along[a] = 10 + a - (a % 3 == 1 ? 30 : 0);
        across[a] = 2 + 0.1 * a;
      }
  }
};

Vec3 apply(double along, double across, const Vec3& d, const Vec3& e) {
  return along * e + across * d.dot(e) * d;
}

}  // namespace

TEST_CASE("the stiffness of springs is that of a plain loop", "[stiffness_kernel]") {
  for_each_lane([](int items, int extreme) {
    for_each_run(items, [&](const sim::SpringRun& springs) {
      for (const double value : {40.0, 1e-3, 1e160, 1e-160})
        for (const bool clamped : {false, true})
          for (const bool predicted : {false, true}) {
            const Points points(items, extreme, value), before(items, (extreme + 1) % items, 3);
            StiffCase stiff(items, springs);
            const auto q = inputs(points.q), q0 = inputs(before.q);
            const sim::SpringModel model{clamped, predicted ? q0.axis : nullptr};
            sim::stiff_kernels().linearise(stiff.run, q, model, 0, items);
            Column along(items), across(items);
            for (int a = 0; a < items; ++a) {
              if (!springs.owns(a)) continue;
              const int b = a + springs.stride;
              const Vec3 d = points.at(a) - points.at(b);
              const double k = springs.k_of(a), rest = springs.rest_of(a);
              if (!acts(springs.sense, d, rest)) continue;
              const auto plain = predicted ? sim::predicted_stiffness(
                                                 d, before.at(a) - before.at(b), k, rest, clamped)
                                           : sim::spring_stiffness(d, k, rest, clamped);
              along[a] = plain.along;
              across[a] = plain.across;
            }
            CAPTURE(value, clamped, predicted);
            for (int a = 0; a < items; ++a) {
              const double scale = std::fabs(along[a]) + springs.k_of(a);
              if (!agree(stiff.along[a], along[a], 1e-11 * scale) ||
                  !agree(stiff.across[a], across[a], 1e-11 * (std::fabs(across[a]) + 1e-9)))
                FAIL_CHECK("spring " << a << ": " << stiff.along[a] << " " << along[a] << ", "
                                     << stiff.across[a] << " " << across[a]);
            }
          }
    });
  });
}

TEST_CASE("springs that push are softened as by a plain loop", "[stiffness_kernel]") {
  for_each_lane([](int items, int extreme) {
    for_each_run(items, [&](const sim::SpringRun& springs) {
      StiffCase stiff(items, springs);
      stiff.fill(items);
      if (springs.owns(extreme)) stiff.along[extreme] = -1e6;
      Column sums(items), plain(items), shares(items);
      for (int i = 0; i < items; ++i) {
        sums[i] = plain[i] = i;
        shares[i] = i % 4 ? 1 : 0.25 + 0.01 * i;
      }
      shares[extreme] = 1e-3;
      for (int a = 0; a < items; ++a)
        if (springs.owns(a) && stiff.along[a] < 0) {
          plain[a] -= stiff.along[a];
          plain[a + springs.stride] -= stiff.along[a];
        }
      const sim::StiffRun runs[] = {stiff.run};
      sim::stiff_kernels().pushes({runs, 1}, sums.data(), 0, items);
      CHECK(first_difference(sums, plain, 1e-9) == -1);

      Column along = stiff.along, across = stiff.across;
      for (int a = 0; a < items; ++a) {
        if (!springs.owns(a) || along[a] >= 0) continue;
        const double k = springs.k_of(a), old = along[a];
        along[a] *= std::fmin(shares[a], shares[a + springs.stride]);
        across[a] *= (k - along[a]) / (k - old);
      }
      sim::stiff_kernels().soften(stiff.run, shares.data(), 0, items);
      CHECK(first_difference(stiff.along, along, 1e-9) == -1);
      CHECK(first_difference(stiff.across, across, 1e-9) == -1);
    });
  });
}

TEST_CASE("products with the stiffness of springs are those of a plain loop",
          "[stiffness_kernel]") {
  for_each_lane([](int items, int extreme) {
    for_each_run(items, [&](const sim::SpringRun& springs) {
      for (const bool before : {false, true}) {
        const Points points(items, extreme, 40);
        StiffCase stiff(items, springs);
        stiff.fill(items);
        Axes out(items), plain(items);
        Column shift(items);
        const auto free = bits_where(items, [](int i) { return i % 7 != 4; });
        scatter(out, 3);
        for (int i = 0; i < items; ++i) shift[i] = 2 + i;
        const double scale = 0.3;
        for (int k = 0; k < 3; ++k)
          for (int i = 0; i < items; ++i) plain[k][i] = before ? out[k][i] : 0;
        double blocks[6][kMostItems] = {};
        for (int a = 0; a < items; ++a) {
          if (!springs.owns(a)) continue;
          const int b = a + springs.stride;
          const Vec3 d = points.at(a) - points.at(b);
          const Vec3 f =
              apply(stiff.along[a], stiff.across[a], d, points.velocity(a) - points.velocity(b));
          for (int k = 0; k < 3; ++k) {
            plain[k][a] += f[k];
            plain[k][b] -= f[k];
          }
          for (int row = 0, entry = 0; row < 3; ++row)
            for (int column = row; column < 3; ++column, ++entry)
              for (const int at : {a, b})
                blocks[entry][at] +=
                    (row == column ? stiff.along[a] : 0) + stiff.across[a] * d[row] * d[column];
        }
        double sum = 0;
        for (int i = 0; i < items; ++i)
          for (int k = 0; k < 3; ++k) {
            const double p = points.v[k][i];
            plain[k][i] = sim::bit(free.data(), i) ? scale * plain[k][i] + shift[i] * p : 0;
            sum += p * plain[k][i];
          }
        const sim::StiffRun runs[] = {stiff.run};
        sim::StiffProduct product{};
        product.shift = shift.data();
        product.scale = scale;
        product.free = free.data();
        product.before = before;
        for (int k = 0; k < 3; ++k) {
          product.q[k] = points.q[k].data();
          product.p[k] = points.v[k].data();
          product.out[k] = out[k].data();
        }
        double sums[8] = {};
        sim::stiff_kernels().product({runs, 1}, product, 0, items, sums);
        double total = 0;
        for (const double lane : sums) total += lane;
        CAPTURE(before);
        CHECK(near(out, plain, 1e-10));
        CHECK(total == Approx(sum).epsilon(1e-10).margin(1e-9));

        Column diagonal[6];
        double* to[6];
        for (int entry = 0; entry < 6; ++entry) {
          diagonal[entry] = Column(items);
          to[entry] = diagonal[entry].data();
        }
        sim::stiff_kernels().diagonal({runs, 1}, inputs(points.q), shift.data(), scale, to, 0,
                                      items);
        for (int entry = 0; entry < 6; ++entry)
          for (int i = 0; i < items; ++i) {
            const bool on = entry == 0 || entry == 3 || entry == 5;
            const double want = scale * blocks[entry][i] + (on ? shift[i] : 0);
            if (!agree(diagonal[entry][i], want, 1e-10 * (std::fabs(want) + 1)))
              FAIL_CHECK("entry " << entry << " of particle " << i);
          }
      }
    });
  });
}
