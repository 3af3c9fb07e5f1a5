// Sweeps over the particles of a step, compared with plain loops.
#include "core/base/bits.h"
#include "core/particles/explicit/sweep.h"
#include "tests/support/kernel_cases.h"

using namespace sim_test;
using sim::Vec3;

namespace {

template <class Real>
constexpr double kTolerance = sizeof(Real) == 8 ? 1e-12 : 2e-5;

template <class Real>
Vec3 at(const AxesOf<Real>& axes, int i) {
  return {axes[0][i], axes[1][i], axes[2][i]};
}

template <class Real>
void set(Real* const (&to)[3], AxesOf<Real>& from) {
  for (int k = 0; k < 3; ++k) const_cast<Real*&>(to[k]) = from[k].data();
}
template <class Real>
void set(const Real* (&to)[3], const AxesOf<Real>& from) {
  for (int k = 0; k < 3; ++k) to[k] = from[k].data();
}
template <class Real>
void set(Real* (&to)[3], AxesOf<Real>& from) {
  for (int k = 0; k < 3; ++k) to[k] = from[k].data();
}

// Particles with springs of several strides, of which one particle is the extreme one.
template <class Real>
struct Case {
  int items;
  AxesOf<Real> q, v, force, row;
  Column inverse_masses, keeps, gains;
  std::vector<std::uint8_t> free;
  std::vector<sim::SpringRun> springs;
  sim::Motion motion;

  Case(int count, int extreme, bool own_masses, double value)
      : items(count),
        q(count),
        v(count),
        force(count),
        row(count),
        inverse_masses(count, 1),
        keeps(count, 1),
        gains(count, 1),
        free(bits_where(count, [](int i) { return i % 7 != 3; })) {
    scatter(q, 0);
    scatter(v, 1);
    scatter(force, 2);
    scatter(row, 3);
    for (int k = 0; k < 3; ++k) q[k][extreme] = static_cast<Real>(value * (k + 1));
    v[1][extreme] = 300;
    for (int i = 0; i < count; ++i) {
      inverse_masses[i] = 0.5 + 0.05 * i;
      keeps[i] = 1 - 0.01 * i;
      gains[i] = 0.02 + 0.001 * i;
    }
    for (const int stride : {1, 2, 3, 5, 8, 15}) {  // cables have 2, struts 5
      auto& run = springs.emplace_back();
      run.stride = stride;
      run.sense = stride == 2   ? sim::SpringSense::kTension
                  : stride == 5 ? sim::SpringSense::kCompression
                                : sim::SpringSense::kBoth;
      run.uniform = stride != 3 && run.sense == sim::SpringSense::kBoth;
      run.k = 30;
      run.rest = 0.7;
      run.owners = bits_where(count, [=](int a) { return a + stride < count && a % 5 != 2; });
      if (run.uniform) continue;
      run.ks = sim::Array(static_cast<std::size_t>(count + 2 * sim::SpringRun::kPad));
      run.rests = sim::Array(static_cast<std::size_t>(count + 2 * sim::SpringRun::kPad));
      for (int a = 0; a < count; ++a) {
        run.ks[static_cast<std::size_t>(a + sim::SpringRun::kPad)] = 20 + a;
        run.rests[static_cast<std::size_t>(a + sim::SpringRun::kPad)] = 0.1 * (a % 4);
      }
    }
    motion.free = free.data();
    motion.inverse_mass = 1.3;
    motion.inverse_masses = own_masses ? inverse_masses.data() : nullptr;
    motion.gravity[0] = 0.1;
    motion.gravity[1] = -9.81;
    motion.gravity[2] = 0.2;
  }
  Case(const Case&) = delete;
  Case& operator=(const Case&) = delete;

  sim::Rings<Real> rings() const {
    std::vector<const sim::SpringRun*> runs;
    for (const auto& run : springs) runs.push_back(&run);
    return sim::Rings<Real>(runs);
  }
  double inverse_mass(int i) const {
    return motion.inverse_masses ? inverse_masses[i] : motion.inverse_mass;
  }
  // F / m + g - c / m v of a free particle.
  Vec3 acceleration(int i, const Vec3& velocity, bool with_force) const {
    if (!sim::bit(free.data(), i)) return Vec3::Zero();
    Vec3 sum = with_force ? at(force, i) : Vec3::Zero();
    for (const auto& run : springs) {
      const auto add = [&](int owner, int other) {
        const Vec3 d = at(q, i) - at(q, other);
        const double rest = run.rest_of(owner), length = std::hypot(d[0], d[1], d[2]);
        if (run.sense == sim::SpringSense::kTension && length < rest) return;
        if (run.sense == sim::SpringSense::kCompression && length > rest) return;
        sum += sim::spring_force(d, run.k_of(owner), run.k_of(owner) * rest);
      };
      if (run.owns(i)) add(i, i + run.stride);
      const int a = i - run.stride;
      if (a >= 0 && run.owns(a)) add(a, a);
    }
    return inverse_mass(i) * (sum - motion.damping * velocity) +
           Vec3(motion.gravity[0], motion.gravity[1], motion.gravity[2]);
  }
};

template <class Real>
bool near(const Vec3& got, const Vec3& want, double scale) {
  for (std::size_t k = 0; k < 3; ++k)
    if (!agree(got[k], want[k], kTolerance<Real> * (std::fabs(want[k]) + scale))) return false;
  return true;
}

// In one sweep, or in two of which the second starts with rings of its own.
template <class Real, class Sweep>
bool sweep_parts(const Case<Real>& c, bool parts, const Sweep& sweep) {
  const auto kernels = sim::sweep_kernels<Real>();
  const int middle = c.items / 2 / sim::kGrain * sim::kGrain;
  auto rings = c.rings();
  if (!parts || middle == 0) return sweep(kernels, rings, 0, c.items);
  bool good = true;
  for (const auto& [begin, end] : {std::pair{0, middle}, {middle, c.items}}) {
    const Real* q[3];
    set(q, c.q);
    kernels.start(rings, 2, q, begin, sim::kGrain);
    good = sweep(kernels, rings, begin, end) && good;
  }
  return good;
}

// `terms`: of the rows of velocities now, of positions, and of the final velocities.
template <class Real>
void check_rk(int items, int extreme, const int (&terms)[3], double value) {
  for (const bool own_masses : {false, true})
    for (const bool damped : {false, true})
      for (const bool parts : {false, true}) {
        Case<Real> c(items, extreme, own_masses, value);
        c.motion.damping = damped ? 0.8 : 0;
        AxesOf<Real> a(items), q_next(items), v_next(items);
        sim::RkStage<Real> stage{};
        set(stage.q, c.q);
        set(stage.q0, c.q);
        set(stage.v0, c.v);
        const bool with_force = items % 2 == 0;
        if (with_force) set(stage.force, c.force);
        set(stage.a, a);
        set(stage.q_next, q_next);
        set(stage.v_next, v_next);
        stage.drift = 0.1;
        stage.kick = 0.2;
        const Real* row[3];
        set(row, c.row);
        double sums[3] = {};
        sim::Row<Real>* const rows[] = {&stage.v_now, &stage.q_row, &stage.v_row};
        for (int r = 0; r < 3; ++r)
          for (int term = 0; term < terms[r]; ++term) {
            rows[r]->add(0.1 * (r + 1) + 0.03 * term, row);
            sums[r] += 0.1 * (r + 1) + 0.03 * term;
          }
        const bool finite =
            sweep_parts<Real>(c, parts, [&](const auto& kernels, auto& rings, int begin, int end) {
              return kernels.rk(rings, c.motion, stage, begin, end);
            });
        CAPTURE(own_masses, damped, parts, value, sizeof(Real));
        CHECK(finite);
        const double scale = 300;
        for (int i = 0; i < items; ++i) {
          const Vec3 v_now = at(c.v, i) + sums[0] * at(c.row, i);
          const Vec3 acceleration = c.acceleration(i, v_now, with_force);
          if (!near<Real>(at(a, i), acceleration, scale) ||
              !near<Real>(at(q_next, i), at(c.q, i) + 0.1 * at(c.v, i) + sums[1] * at(c.row, i),
                          scale) ||
              !near<Real>(at(v_next, i), at(c.v, i) + sums[2] * at(c.row, i) + 0.2 * acceleration,
                          scale))
            FAIL_CHECK("particle " << i << ": " << a[1][i] << ", not " << acceleration[1]);
        }
      }
}

}  // namespace

TEST_CASE("stages of Runge-Kutta methods are those of a plain loop", "[sweep_kernel]") {
  for_each_lane([](int items, int extreme) {
    // A loop of its own each, and two without.
    const int kinds[][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 1}, {1, 3, 3}, {2, 1, 2}};
    const auto& terms = kinds[(items + extreme) % 6];
    check_rk<double>(items, extreme, terms, 40);
    check_rk<float>(items, extreme, terms, 40);
    check_rk<double>(items, extreme, terms, items % 2 ? 1e-160 : 1e-20);
  });
}

TEST_CASE("stages whose acceleration is known are those of a plain loop", "[sweep_kernel]") {
  for_each_lane([](int items, int extreme) {
    Case<double> c(items, extreme, false, 40);
    AxesOf<double> q_next(items), v_next(items);
    sim::RkStage<double> stage{};
    set(stage.q0, c.q);
    set(stage.v0, c.v);
    set(stage.a, c.force);
    set(stage.q_next, q_next);
    if (items % 3) set(stage.v_next, v_next);
    stage.drift = 0.1;
    stage.kick = 0.2;
    const double* row[3];
    set(row, c.row);
    stage.q_row.add(0.3, row);
    stage.v_row.add(0.4, row);
    auto rings = c.rings();
    CHECK(sim::sweep_kernels<double>().rk(rings, c.motion, stage, 0, items));
    for (int i = 0; i < items; ++i) {
      const Vec3 v = at(c.v, i) + 0.4 * at(c.row, i) + 0.2 * at(c.force, i);
      if (!near<double>(at(q_next, i), at(c.q, i) + 0.1 * at(c.v, i) + 0.3 * at(c.row, i), 100) ||
          (stage.v_next[0] && !near<double>(at(v_next, i), v, 100)))
        FAIL_CHECK("particle " << i);
    }
  });
}

namespace {

template <class Real>
void check_kick(int items, int extreme, double value) {
  for (const bool own : {false, true})
    for (const bool parts : {false, true}) {
      Case<Real> c(items, extreme, own, value);
      AxesOf<Real> a(items), q_next(items), v_next(items), v_after(items);
      sim::KickStage<Real> stage{};
      set(stage.q, c.q);
      set(stage.v, c.v);
      const bool with_force = items % 2 == 0;
      if (with_force) set(stage.force, c.force);
      stage.kicks = true;
      stage.kick = {0.9, 0.05, own ? c.keeps.data() : nullptr, c.gains.data()};
      stage.next_kick = {0.8, 0.07, own ? c.gains.data() : nullptr, c.keeps.data()};
      set(stage.v_next, v_next);
      if (items % 3) set(stage.v_after, v_after);
      set(stage.a, a);
      stage.drift = 0.1;
      set(stage.q_next, q_next);
      stage.check = true;
      const bool finite =
          sweep_parts<Real>(c, parts, [&](const auto& kernels, auto& rings, int begin, int end) {
            return kernels.kick(rings, c.motion, stage, begin, end);
          });
      CAPTURE(own, parts, sizeof(Real));
      CHECK(finite);
      const double scale = 300;
      for (int i = 0; i < items; ++i) {
        const Vec3 acceleration = c.acceleration(i, Vec3::Zero(), with_force);
        const Vec3 v =
            (own ? c.keeps[i] : 0.9) * at(c.v, i) + (own ? c.gains[i] : 0.05) * acceleration;
        const Vec3 after = (own ? c.gains[i] : 0.8) * v + (own ? c.keeps[i] : 0.07) * acceleration;
        const Vec3 drifts = items % 3 ? after : v;
        if (!near<Real>(at(a, i), acceleration, scale) || !near<Real>(at(v_next, i), v, scale) ||
            (items % 3 && !near<Real>(at(v_after, i), after, scale)) ||
            !near<Real>(at(q_next, i), at(c.q, i) + 0.1 * drifts, scale))
          FAIL_CHECK("particle " << i << ": " << v_next[1][i] << ", not " << v[1]);
      }
    }
}

}  // namespace

TEST_CASE("kicks of splitting methods are those of a plain loop", "[sweep_kernel]") {
  for_each_lane([](int items, int extreme) {
    check_kick<double>(items, extreme, 40);
    check_kick<float>(items, extreme, 40);
    check_kick<double>(items, extreme, 1e-160);
    // A drift alone.
    Case<double> c(items, extreme, false, 40);
    AxesOf<double> q_next(items);
    sim::KickStage<double> stage{};
    set(stage.q, c.q);
    set(stage.v, c.v);
    stage.drift = 0.3;
    set(stage.q_next, q_next);
    auto rings = c.rings();
    CHECK(sim::sweep_kernels<double>().kick(rings, c.motion, stage, 0, items));
    for (int i = 0; i < items; ++i)
      if (!near<double>(at(q_next, i), at(c.q, i) + 0.3 * at(c.v, i), 100))
        FAIL_CHECK("particle " << i);
  });
}

TEST_CASE("a number that is not finite is seen at any index", "[sweep_kernel]") {
  for_each_lane([](int items, int extreme) {
    for (const double value : {std::nan(""), HUGE_VAL, -HUGE_VAL})
      for (const int axis : {0, 1, 2}) {
        Case<double> c(items, extreme, false, 1);
        c.v[axis][extreme] = value;
        AxesOf<double> q_next(items), v_next(items);
        sim::RkStage<double> stage{};
        set(stage.q, c.q);
        set(stage.q0, c.q);
        set(stage.v0, c.v);
        set(stage.q_next, q_next);
        set(stage.v_next, v_next);
        sim::KickStage<double> kick{};
        set(kick.q, c.q);
        set(kick.v, c.v);
        kick.kicks = kick.check = true;
        kick.kick.keep = 1;
        set(kick.v_next, v_next);
        auto rings = c.rings(), others = c.rings();
        CHECK_FALSE(sim::sweep_kernels<double>().rk(rings, c.motion, stage, 0, items));
        CHECK_FALSE(sim::sweep_kernels<double>().kick(others, c.motion, kick, 0, items));
      }
  });
}
