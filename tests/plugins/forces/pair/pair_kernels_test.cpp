// Kernels of pairs of particles, compared with sums over all pairs.
#include "plugins/forces/fluid/density_constraints.h"
#include "plugins/forces/fluid/fluid_forces.h"
#include "plugins/forces/pair/pair_forces.h"
#include "tests/support/kernel_lists.h"

using namespace sim_test;
using sim::Vec3;
using Kind = sim::PairLaw::Kind;

namespace {

// U and U' at a distance, from the textbook.
struct PlainPair {
  double energy, slope;
};
PlainPair pair_at(const sim::PairLaw& law, double r) {
  PlainPair pair{};
  if (law.kind == Kind::kSoft) {
    pair = {0.5 * law.strength * (law.length - r) * (law.length - r),
            -law.strength * (law.length - r)};
  } else if (law.kind == Kind::kMorse) {
    const double e = std::exp(-law.rate * (r - law.length));
    pair = {law.strength * (e * e - 2 * e), -2 * law.rate * law.strength * (e * e - e)};
  } else {
    const double s = std::pow(law.length / r, 6);
    pair = {4 * law.strength * (s * s - s), -24 * law.strength * (2 * s * s - s) / r};
  }
  return {pair.energy - law.energy_shift - law.slope_shift * (r - law.cutoff),
          pair.slope - law.slope_shift};
}

std::vector<sim::PairLaw> laws() {
  const sim::PairLaw lennard{Kind::kLennardJones, 1.3, 0.7, 0, 1.9, 0, 0},
      soft{Kind::kSoft, 40, 1.1, 0, 1.1, 0, 0}, morse{Kind::kMorse, 2, 0.9, 3, 2.1, 0, 0};
  return {lennard, sim::shifted(lennard, false), sim::shifted(lennard, true), soft,
          morse,   sim::shifted(morse, true)};
}

bool near(const double* got, const Vec3& want, double tolerance) {
  for (int k = 0; k < 3; ++k)
    if (!agree(got[k], want[static_cast<std::size_t>(k)], tolerance)) return false;
  return true;
}

}  // namespace

TEST_CASE("forces of pairs are those of a sum over all pairs", "[pair_kernel]") {
  for_each_lane([](int items, int extreme) {
    AllPairs all(items);
    const int other = (extreme + 1) % items;
    for (const sim::PairLaw& law : laws())
      // Much nearer than others, just within reach, just beyond it, and at the same place.
      for (const double r : {0.3, 0.999999 * law.cutoff, 1.000001 * law.cutoff, 0.0}) {
        for (int i = 0; i < items; ++i) all.set(i, piled(i));
        if (other != extreme) all.set(extreme, all.at(other) + Vec3(0, r, 0));
        std::vector<Vec3> plain(static_cast<std::size_t>(items), Vec3::Zero());
        std::vector<double> energy(static_cast<std::size_t>(items), 0);
        for (int i = 0; i < items; ++i)
          for (int j = 0; j < items; ++j) {
            const Vec3 d = all.at(i) - all.at(j);
            if (i == j || !(d.norm() < law.cutoff)) continue;
            if (law.kind != Kind::kLennardJones || d.norm() > 0)
              energy[static_cast<std::size_t>(i)] += 0.5 * pair_at(law, d.norm()).energy;
            if (d.norm() == 0) continue;
            plain[static_cast<std::size_t>(i)] += -pair_at(law, d.norm()).slope / d.norm() * d;
          }
        Column forces(4 * all.places), alone(4 * all.places), energies(all.places);
        const auto kernel = [&](double* f, double* u) {
          sim::pair_kernels(law).forces(law, all.blocks.data(), all.points.data(), 0,
                                        static_cast<int>(all.blocks.size()), f, u);
        };
        kernel(forces.data(), nullptr);
        kernel(nullptr, energies.data());
        const std::vector<double> without(energies.data(), energies.data() + all.places);
        kernel(alone.data(), energies.data());
        CAPTURE(static_cast<int>(law.kind), law.slope_shift, r);
        for (int i = 0; i < items; ++i) {
          const Vec3& want = plain[static_cast<std::size_t>(i)];
          if (!near(&forces[4 * i], want, 1e-10 * (want.norm() + 10)))
            FAIL_CHECK("particle " << i << ": " << forces[4 * i + 1] << ", not " << want[1]);
          const double u = energy[static_cast<std::size_t>(i)];
          if (!agree(energies[i], u, 1e-11 * (std::fabs(u) + 10)) ||
              energies[i] != without[static_cast<std::size_t>(i)] ||
              !near(&alone[4 * i], {forces[4 * i], forces[4 * i + 1], forces[4 * i + 2]}, 0))
            FAIL_CHECK("energy of " << i << ": " << energies[i] << ", not " << u);
        }
        for (int i = items; i < all.places; ++i)
          if (!near(&forces[4 * i], Vec3::Zero(), 0)) FAIL_CHECK("no particle " << i);
      }
  });
}

TEST_CASE("terms of eight pairs are those of the textbook", "[pair_kernel]") {
  for_each_lane([](int items, int extreme) {
    if (items > 8) return;
    for (const sim::PairLaw& law : laws())
      for (const double r : {0.4, 0.999999 * law.cutoff, 1.000001 * law.cutoff, 0.0, 1e100}) {
        double squares[8];
        for (int i = 0; i < 8; ++i) {
          const double own = i == extreme ? r : 0.6 + 0.1 * i;
          squares[i] = own * own;
        }
        sim::PairTerms terms{};
        sim::pair_kernels(law).terms(law, squares, terms);
        for (int i = 0; i < 8; ++i) {
          const double at = std::sqrt(squares[i]), h = 1e-4;
          const bool within = at < law.cutoff, apart = within && at > 0;
          const double reach = law.kind == Kind::kLennardJones && at == 0 ? 0 : 1;
          const double u = within && reach > 0 ? pair_at(law, at).energy : 0;
          const double g = apart ? -pair_at(law, at).slope / at : 0;
          // dg/d(r^2) by differences of g.
          const double up = -pair_at(law, at + h).slope / (at + h);
          const double down = -pair_at(law, at - h).slope / (at - h);
          const double dg = apart ? (up - down) / (4 * h * at) : 0;
          CAPTURE(static_cast<int>(law.kind), law.slope_shift, at);
          if (!agree(terms.u[i], u, 1e-11 * (std::fabs(u) + 1)) ||
              !agree(terms.g[i], g, 1e-11 * (std::fabs(g) + 1)) ||
              !agree(terms.dg[i], dg, 1e-4 * (std::fabs(dg) + 1)))
            FAIL_CHECK(i << ": " << terms.u[i] << " " << u << ", " << terms.g[i] << " " << g << ", "
                         << terms.dg[i] << " " << dg);
        }
      }
  });
}

namespace {

sim::FluidLaw fluid_of(double cohesion) {
  sim::FluidLaw law;
  law.volume = 0.5;
  law.smoothing = 1.2;
  law.viscosity = 0.7;
  law.cohesion = cohesion;
  law.stiffness = 10;
  sim::fit_to_lattice(law);
  return law;
}

double cube_of(double q) { return q < 2 ? std::pow(1 - q / 2, 3) : 0; }
double weight_of(double q) { return q < 2 ? std::pow(1 - q / 2, 4) * (2 * q + 1) : 0; }

struct PlainFluid {
  double density = 1, tie = 0;
  Vec3 force = Vec3::Zero(), drag = Vec3::Zero();
};

// Walls beside the pile, one an axis for the bits of `walls`; the fluid goes on behind them as
// images.
PlainFluid plain_fluid(const sim::FluidLaw& law, const AllPairs& all, const Column& slope,
                       const Column& v, int i, unsigned walls, double floor) {
  const double h = law.smoothing, push = 5 * law.volume * law.scale / (h * h);
  PlainFluid sum;
  for (int j = 0; j < all.items; ++j) {
    const Vec3 d = all.at(i) - all.at(j);
    const double r = d.norm(), u = 1 - r / (2 * h), both = slope[i] + slope[j];
    if (i != j && r < 2 * h && r > 0) {
      sum.density += weight_of(r / h);
      sum.force += push * both * cube_of(r / h) * d;
      sum.tie += 0.5 * law.cohesion * (1.125 * u - 1) * u * u * u;
      sum.force += law.cohesion * (4.5 * u - 3) * u * u / (2 * h * r) * d;
      const Vec3 w(v[4 * i] - v[4 * j], v[4 * i + 1] - v[4 * j + 1], v[4 * i + 2] - v[4 * j + 2]);
      sum.drag +=
          -law.viscosity * law.friction * cube_of(r / h) * w.dot(d) / (r * r + 0.01 * h * h) * d;
    }
    for (unsigned mirrors = 1; mirrors < 8; ++mirrors) {
      if (mirrors & ~walls) continue;
      double square = d.dot(d);
      Vec3 between = d;
      for (std::size_t k = 0; k < 3; ++k) {
        if (!(mirrors >> k & 1)) continue;
        square += 4 * (all.at(i)[k] - floor) * (all.at(j)[k] - floor);
        between[k] += 2 * (all.at(j)[k] - floor);
      }
      const double image = std::sqrt(std::fmax(square, 0)) / h;
      sum.density += weight_of(image);
      sum.force += push * both * cube_of(image) * between;
    }
  }
  sum.density *= law.scale;
  return sum;
}

}  // namespace

TEST_CASE("densities and forces of a fluid are those of plain sums", "[fluid_kernel]") {
  for_each_lane([](int items, int extreme) {
    AllPairs all(items);
    const int other = (extreme + 1) % items;
    for (const double cohesion : {0.0, 0.4})
      // No wall, one, two and three at right angles; planes, or asked point by point.
      for (const auto& [walls, planes] :
           {std::pair{0u, 0u}, {2u, 2u}, {2u, 0u}, {3u, 3u}, {7u, 5u}}) {
        const sim::FluidLaw law = fluid_of(cohesion);
        const double floor = -0.4;
        for (int i = 0; i < items; ++i) all.set(i, piled(i));
        // Very near to another, or within the wall, or at the end of what is in reach.
        if (other != extreme)
          all.set(extreme, all.at(other) + Vec3(0,
                                                items % 3 == 0   ? 0.02
                                                : items % 3 == 1 ? 2 * law.smoothing
                                                                 : 1.5,
                                                0));
        if (items % 4 == 3) all.set(extreme, {all.at(extreme)[0], floor + 0.01, 0.3});
        Column v(4 * all.places), slope(all.places);
        std::vector<Column> gaps(3, Column(4 * all.places));
        scatter(v, 5);
        for (int i = 0; i < all.places; ++i) {
          slope[i] = i < items ? 1 + scattered(i, 6) : 0;
          for (std::size_t k = 0; k < 3; ++k) {
            gaps[k][4 * i + static_cast<int>(k)] = 1;
            gaps[k][4 * i + 3] = i < items ? all.at(i)[k] - floor : 1e6;
          }
        }
        const int count = static_cast<int>(all.blocks.size());
        std::vector<std::uint16_t> near_walls(all.blocks.size(), static_cast<std::uint16_t>(walls));
        std::vector<std::size_t> firsts;
        const std::size_t room = 8 * 8 * static_cast<std::size_t>(items + 3);
        for (std::size_t b = 0; b < all.blocks.size(); ++b) firsts.push_back(b * room);
        Column ties(all.places), n(all.places), f(4 * all.places), drag(4 * all.places),
            apart(4 * all.places), weights(static_cast<int>(room) * count);
        sim::FluidBlocks from;
        from.blocks = all.blocks.data();
        from.points = all.points.data();
        from.velocities = v.data();
        from.near = near_walls.data();
        for (std::size_t k = 0; k < 3; ++k) from.walls[k] = gaps[k].data();
        from.planes = planes;
        from.ties = ties.data();
        from.weights = weights.data();
        from.firsts = firsts.data();
        const sim::FluidKernels kernels = sim::fluid_kernels(law);
        kernels.densities(law, from, 0, count, n.data());
        for (int i = 0; i < all.places; ++i) all.points[4 * i + 3] = slope[i];
        kernels.forces(law, from, 0, count, f.data(), drag.data());
        kernels.resistance(law, from, 0, count, apart.data());
        CAPTURE(cohesion, walls, planes);
        for (int i = 0; i < items; ++i) {
          const PlainFluid want = plain_fluid(law, all, slope, v, i, walls, floor);
          if (!agree(n[i], want.density, 1e-11 * want.density) ||
              (cohesion > 0 && !agree(ties[i], want.tie, 1e-11)) ||
              !near(&f[4 * i], want.force, 1e-10 * (want.force.norm() + 1)) ||
              !near(&drag[4 * i], want.drag, 1e-10 * (want.drag.norm() + 1)) ||
              !near(&apart[4 * i], want.drag, 1e-10 * (want.drag.norm() + 1)))
            FAIL_CHECK("particle " << i << ": " << n[i] << " " << want.density << ", "
                                   << f[4 * i + 1] << " " << want.force[1]);
        }
      }
  });
}

TEST_CASE("rows of a fluid are those of plain sums", "[density_constraints_kernel]") {
  for_each_lane([](int items, int extreme) {
    const sim::FluidLaw law = fluid_of(0);
    AllPairs all(items);
    for (int i = 0; i < items; ++i) all.set(i, piled(i));
    if (const int other = (extreme + 1) % items; other != extreme)
      all.set(extreme, all.at(other) + Vec3(0, items % 2 ? 0.02 : 2 * law.smoothing, 0));
    const int length = items + 1, count = static_cast<int>(all.blocks.size());
    const auto room = static_cast<std::size_t>(24 * length * count);
    std::vector<float> slopes(room), weights(room), images(2 * room);
    // Images are rows of their own: here of each particle and the next.
    std::vector<std::int32_t> image_slots(static_cast<std::size_t>(8 * count));
    for (std::size_t i = 0; i < images.size(); ++i)
      images[i] = static_cast<float>(scattered(static_cast<int>(i), 7));
    Column n(all.places);
    std::vector<sim::DensityConstraintRow> rows;
    for (int b = 0; b < count; ++b) {
      const auto at = static_cast<std::size_t>(b * length);
      sim::density_constraint_kernels().slopes(law, all.blocks[static_cast<std::size_t>(b)],
                                               all.points.data(), b, n.data() + 8 * b,
                                               slopes.data() + 24 * at, weights.data() + 8 * at);
      for (int lane = 0; lane < 8; ++lane)
        image_slots[static_cast<std::size_t>(8 * b + lane)] = (8 * b + lane + 1) % items;
      rows.push_back({all.blocks[static_cast<std::size_t>(b)].slots, slopes.data() + 24 * at,
                      weights.data() + 8 * at, length, image_slots.data() + 8 * b,
                      images.data() + 48 * b, 1});
    }
    Column p(all.places), w(4 * all.places), pressure_forces(4 * all.places), rates(all.places),
        viscous_forces(4 * all.places);
    scatter(p, 8);
    scatter(w, 9);
    p[extreme] = 1e3;
    const auto& kernels = sim::density_constraint_kernels();
    kernels.pressure_forces(rows.data(), p.data(), 0, count, pressure_forces.data());
    kernels.rates(rows.data(), w.data(), 0, count, rates.data());
    kernels.viscous_forces(rows.data(), w.data(), 0, count, viscous_forces.data());
    const double h = law.smoothing;
    const auto velocity = [&](int i) { return Vec3(w[4 * i], w[4 * i + 1], w[4 * i + 2]); };
    for (int i = 0; i < items; ++i) {
      double density = 1, rate = 0;
      Vec3 push = Vec3::Zero(), apply_viscosity = Vec3::Zero();
      for (int j = 0; j < items; ++j) {
        const Vec3 d = all.at(i) - all.at(j);
        const double r = d.norm();
        if (i == j || !(r < 2 * h) || r == 0) continue;
        density += weight_of(r / h);
        const Vec3 s = -5 * law.scale / (h * h) * cube_of(r / h) * d;
        const Vec3 between = velocity(i) - velocity(j);
        push += (p[i] + p[j]) * s;
        rate += s.dot(between);
        apply_viscosity += law.viscosity * law.friction * cube_of(r / h) * between.dot(d) /
                           (r * r + 0.01 * h * h) * d;
      }
      const float* const own = images.data() + 48 * (i / 8) + i % 8;
      const Vec3 a(own[0], own[8], own[16]), b(own[24], own[32], own[40]);
      const int image = (i + 1) % items;
      push += (p[i] + p[image]) * a;
      rate += a.dot(velocity(i)) + b.dot(velocity(image));
      if (!agree(n[i], law.scale * density, 1e-11 * density) || !agree(rates[i], rate, 1e-5) ||
          !near(&pressure_forces[4 * i], push, 1e-5 * (push.norm() + 1)) ||
          !near(&viscous_forces[4 * i], apply_viscosity, 1e-5 * (apply_viscosity.norm() + 1)))
        FAIL_CHECK("particle " << i << ": " << n[i] << " " << law.scale * density << ", "
                               << rates[i] << " " << rate << ", " << viscous_forces[4 * i + 1]
                               << " " << apply_viscosity[1]);
    }
  });
}
