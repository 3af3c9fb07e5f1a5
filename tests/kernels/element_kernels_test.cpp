// Kernels of triangles and cells, compared with plain loops.
#include "core/base/bits.h"
#include "core/base/thread_pool.h"
#include "core/geometry/cells.h"
#include "plugins/contact/surfaces/self_collision_culling.h"
#include "plugins/forces/fem/fem_forces.h"
#include "plugins/forces/wind/wind_forces.h"
#include "tests/support/kernel_cases.h"

using namespace sim_test;
using sim::Mat3;
using sim::Vec3;
using Model = sim::ConstitutiveLaw::Model;

namespace {

Vec3 at(const Axes& axes, int i) { return {axes[0][i], axes[1][i], axes[2][i]}; }

bool near(const Vec3& got, const Vec3& want, double tolerance) {
  for (std::size_t k = 0; k < 3; ++k)
    if (!agree(got[k], want[k], tolerance)) return false;
  return true;
}

sim::ParticleView view_of(const Axes& q, const Axes& v) {
  return {.n = q[0].items(),
          .x = q[0].data(),
          .y = q[1].data(),
          .z = q[2].data(),
          .vx = v[0].data(),
          .vy = v[1].data(),
          .vz = v[2].data()};
}
sim::ForceSink sink_of(Axes& to) { return {to[0].data(), to[1].data(), to[2].data()}; }

// A third of the force of the air on a triangle, from the definition of the law.
Vec3 wind_third(const sim::WindLaw& law, const sim::AirNow& air, const Vec3 (&x)[3],
                const Vec3 (&v)[3]) {
  const Vec3 w = air.velocity((x[0] + x[1] + x[2]) / 3.0) - (v[0] + v[1] + v[2]) / 3.0;
  const Vec3 normal = (x[1] - x[0]).cross(x[2] - x[0]);
  if (normal.norm() == 0) return Vec3::Zero();
  const Vec3 n = normal / normal.norm(), across = w - w.dot(n) * n;
  const double area = 0.5 * normal.norm(), along = w.dot(n);
  if (law.linear) return area / 3 * (law.normal * along * n + law.tangential * across);
  return area / 3 *
         (law.normal * std::fabs(along) * along * n + law.tangential * across.norm() * across);
}

struct Sheet {
  Axes q, v;
  Sheet(int items, int extreme, double value) : q(items), v(items) {
    scatter(q, 0);
    scatter(v, 1);
    q[2][extreme] = value;
    v[0][extreme] = 30;
  }
};

constexpr sim::WindLaw kWinds[] = {{false, 0.6, 0.2}, {true, 0.5, 0.1}};

}  // namespace

TEST_CASE("wind on triangles is that of a plain loop", "[wind_kernel]") {
  const sim::Air still(Vec3(3, 1, -2), {}), breeze(Vec3(3, 1, -2), {2, 0.3, 1.5, 7});
  for_each_lane([&](int items, int extreme) {
    for (const sim::WindLaw& law : kWinds)
      for (const sim::Air* const air : {&still, &breeze})
        for (const double value : {25.0, 1e-9}) {
          const int particles = items + 2;
          Sheet sheet(particles, extreme, value);
          // One without an area.
          std::vector<int> ids;
          for (int t = 0; t < items; ++t)
            ids.insert(ids.end(), {t, (t * 5 + 1) % particles, (t * 3 + 2) % particles});
          ids[static_cast<std::size_t>(3 * extreme + 2)] = extreme;
          ids[static_cast<std::size_t>(3 * ((extreme + 1) % items))] = extreme;
          const sim::AirNow now = air->at(0.37);
          const std::size_t stride = 48;
          Column thirds(3 * 48);
          sim::wind_kernels().any(law, now, view_of(sheet.q, sheet.v), ids.data(), 0, items,
                                  thirds.data(), stride);
          for (int t = 0; t < items; ++t) {
            Vec3 x[3], v[3];
            for (int k = 0; k < 3; ++k) {
              x[k] = at(sheet.q, ids[static_cast<std::size_t>(3 * t + k)]);
              v[k] = at(sheet.v, ids[static_cast<std::size_t>(3 * t + k)]);
            }
            const Vec3 want = wind_third(law, now, x, v);
            const Vec3 got(thirds[t], thirds[t + 48], thirds[t + 96]);
            if (!near(got, want, 1e-7 * (want.norm() + 1)))
              FAIL_CHECK("triangle " << t << " is off by " << (got - want).norm());
          }
          if (thirds[items] != 0) FAIL_CHECK("a triangle behind the last");
        }
  });
}

TEST_CASE("wind that is swept is that of a plain loop", "[wind_kernel]") {
  const sim::Air air(Vec3(3, 1, -2), {2, 0.3, 1.5, 7});
  for_each_lane([&](int items, int extreme) {
    for (const sim::WindLaw& law : kWinds) {
      Sheet sheet(items, extreme, 25);
      std::vector<sim::TriangleRun> runs;
      for (const auto& [b, c] : {std::pair{1, 4}, {5, 1}, {11, 12}})
        runs.push_back({b, c, bits_where(items, [&, b = b, c = c](int a) {
                          return a + std::max(b, c) < items && a % 6 != 5;
                        })});
      Axes forces(items), plain(items);
      const sim::AirNow now = air.at(0);
      for (const sim::TriangleRun& run : runs)
        for (int a = 0; a < items; ++a) {
          if (!sim::bit(run.bits.data(), a)) continue;
          const int ids[] = {a, a + static_cast<int>(run.b), a + static_cast<int>(run.c)};
          Vec3 x[3], v[3];
          for (int k = 0; k < 3; ++k) {
            x[k] = at(sheet.q, ids[k]);
            v[k] = at(sheet.v, ids[k]);
          }
          const Vec3 third = wind_third(law, now, x, v);
          for (const int id : ids)
            for (int k = 0; k < 3; ++k) plain[k][id] += third[static_cast<std::size_t>(k)];
        }
      // Whole, and from a block in the middle on.
      for (const int begin : {0, items / 16 * 8}) {
        for (int k = 0; k < 3; ++k) forces[k] = Column(items);
        sim::WindSweep sweep(law, air, runs);
        sweep.start(view_of(sheet.q, sheet.v), begin);
        sweep.add(view_of(sheet.q, sheet.v), {begin, items}, sink_of(forces));
        for (int i = begin; i < items; ++i)
          if (!near(at(forces, i), at(plain, i), 1e-7 * (at(plain, i).norm() + 1)))
            FAIL_CHECK("particle " << i << " from " << begin << " on");
        CHECK(forces[1][items] == 7777);
      }
    }
  });
}

namespace {

Mat3 inverse_transposed(const Mat3& F) {
  const Vec3 a(F(0, 0), F(0, 1), F(0, 2)), b(F(1, 0), F(1, 1), F(1, 2)),
      c(F(2, 0), F(2, 1), F(2, 2));
  const double J = a.dot(b.cross(c));
  return Mat3{b.cross(c), c.cross(a), a.cross(b)} * (1 / J);
}

double determinant(const Mat3& F) {
  const Vec3 a(F(0, 0), F(0, 1), F(0, 2)), b(F(1, 0), F(1, 1), F(1, 2)),
      c(F(2, 0), F(2, 1), F(2, 2));
  return a.dot(b.cross(c));
}

double trace(const Mat3& m) { return m(0, 0) + m(1, 1) + m(2, 2); }

// The rotation of the polar decomposition, by Higham's iteration.
Mat3 rotation_of(Mat3 F) {
  for (int i = 0; i < 60; ++i) F = 0.5 * (F + inverse_transposed(F));
  return F;
}

// The first stress of a law, from its definition in constitutive_law.h.
Mat3 stress_of(const sim::ConstitutiveLaw& law, const Mat3& F) {
  const Mat3 C = sim::transposed(F) * F, one = Mat3::Identity();
  if (law.model == Model::kStVk) {
    const Mat3 E = 0.5 * (C - one);
    return F * (2 * law.mu * E + law.lambda * trace(E) * one);
  }
  if (law.model == Model::kCorotated) {
    const Mat3 R = rotation_of(F);
    return 2 * law.mu * (F - R) + law.lambda * (trace(sim::transposed(R) * F) - 3) * R;
  }
  const double J = determinant(F), I = trace(C);
  return law.mu * (1 - 1 / (I + 1)) * F +
         (law.lambda * (J - 1) - 0.75 * law.mu) * J * inverse_transposed(F);
}

}  // namespace

TEST_CASE("forces of cells are those of a plain loop", "[fem_kernel]") {
  sim::ThreadPool pool(1);
  for_each_lane([&](int items, int extreme) {
    for (const Model model : {Model::kNeoHookean, Model::kCorotated, Model::kStVk})
      for (const int nodes : {4, 10}) {
        if (nodes == 10 && items % 5 != 1) continue;
        const sim::ConstitutiveLaw law{model, 40, 70};
        // Cells that do not join, each with corners of its own, and nodes on their edges.
        constexpr int kEdges[6][2] = {{0, 1}, {1, 2}, {0, 2}, {0, 3}, {1, 3}, {2, 3}};
        Axes rest(items * nodes), now(items * nodes), v(0);
        std::vector<int> ids;
        for (int cell = 0; cell < items; ++cell)
          for (int node = 0; node < nodes; ++node) {
            const int id = cell * nodes + node;
            ids.push_back(id);
            for (int k = 0; k < 3; ++k) {
              const int *edge = node < 4 ? nullptr : kEdges[node - 4], first = cell * nodes;
              rest[k][id] = edge ? 0.5 * (rest[k][first + edge[0]] + rest[k][first + edge[1]])
                                 : (node == k + 1) + 0.1 * scattered(id, k);
              now[k][id] =
                  1.2 * rest[k][id] + 0.1 * scattered(id, 4 + k) + 0.2 * rest[(k + 1) % 3][id];
              if (cell == extreme) now[k][id] = (k == 1 ? 9 : 0.2) * rest[k][id];
            }
          }
        Axes forces(items * nodes);
        sim::FemForces solid(law, ids, nodes);
        solid.bind(view_of(rest, v));
        solid.prepare(view_of(now, v), pool);
        solid.add({0, items * nodes}, sink_of(forces));
        CAPTURE(static_cast<int>(model), nodes);
        for (int cell = 0; cell < items; ++cell) {
          const std::span<const int> own = std::span(ids).subspan(
              static_cast<std::size_t>(cell * nodes), static_cast<std::size_t>(nodes));
          std::vector<Vec3> plain(static_cast<std::size_t>(nodes), Vec3::Zero());
          for (int point = 0; point < sim::cell_points(nodes); ++point) {
            const auto place = sim::cell_point(
                own, [&](int id) { return at(rest, id); }, point);
            Mat3 F = Mat3::Zero();
            for (std::size_t a = 0; a < own.size(); ++a)
              F += sim::outer(at(now, own[a]), place.gradient[a]);
            const Mat3 P = stress_of(law, F);
            for (std::size_t a = 0; a < own.size(); ++a)
              plain[a] -= std::fabs(place.weight) * (P * place.gradient[a]);
          }
          for (std::size_t a = 0; a < own.size(); ++a)
            if (!near(at(forces, own[a]), plain[a], 1e-9 * (plain[a].norm() + 1)))
              FAIL_CHECK("cell " << cell << ", node " << a << " is off by "
                                 << (at(forces, own[a]) - plain[a]).norm());
        }
      }
  });
}

namespace {

// The forces on the first cell of `count` alike, all of one deformation but for a given one.
std::vector<Vec3> forces_beside(const Mat3& F, int count, int odd, const Mat3& other) {
  const sim::ConstitutiveLaw law{Model::kCorotated, 40, 70};
  Axes rest(4 * count), now(4 * count), v(0);
  std::vector<int> ids;
  for (int i = 0; i < 4 * count; ++i) {
    Vec3 corner;
    if (i % 4 > 0) corner[static_cast<std::size_t>(i % 4 - 1)] = 1;
    const Vec3 place = (i / 4 == odd ? other : F) * corner;
    for (std::size_t k = 0; k < 3; ++k) {
      rest[k][i] = corner[k];
      now[k][i] = place[k];
    }
    ids.push_back(i);
  }
  sim::ThreadPool pool(1);
  Axes forces(4 * count);
  sim::FemForces solid(law, ids, 4);
  solid.bind(view_of(rest, v));
  solid.prepare(view_of(now, v), pool);
  solid.add({0, 4 * count}, sink_of(forces));
  return {at(forces, 0), at(forces, 1), at(forces, 2), at(forces, 3)};
}

}  // namespace

// The rotation nearest to F = diag(a, b, c) with c < 0, |c| < b is 1: P = 2 mu (F - 1) + lambda
// tr(F - 1), and the force on the node at 1 along an axis is -P/6 of that column. The roots of its
// polynomial are twice the gap b - |c| apart: rounding of the root and of the quotient bring in
// 1 / gap each.
TEST_CASE("the rotation of an inverted cell is found where two stretches nearly cancel",
          "[fem_kernel]") {
  for (const double gap : {0.4, 1e-2, 1e-4, 1e-5}) {
    const Vec3 stretches(1.3, 0.8, gap - 0.8);
    const std::vector<Vec3> forces =
        forces_beside(Mat3::Diagonal(stretches), 1, -1, Mat3::Identity());
    const double trace = stretches[0] + stretches[1] + stretches[2] - 3;
    for (std::size_t k = 0; k < 3; ++k) {
      Vec3 want;
      want[k] = -(80 * (stretches[k] - 1) + 70 * trace) / 6;
      CAPTURE(gap, k);
      CHECK((forces[k + 1] - want).norm() < 1e-13 / (gap * gap));
    }
  }
}

TEST_CASE("the force of a cell has the same bits beside any other", "[fem_kernel]") {
  const Mat3 strong({1.9, 0.2, -0.4}, {0, 0.4, 0.1}, {0.3, 0, 1.5});
  for (int shape = 0; shape < 60; ++shape) {
    Mat3 mild = Mat3::Identity();
    for (std::size_t k = 0; k < 9; ++k)
      mild(k / 3, k % 3) += 0.03 * scattered(shape, static_cast<int>(k));
    const std::vector<Vec3> alone = forces_beside(mild, 8, -1, mild);
    for (const Mat3& other : {strong, Mat3::Diagonal({1, 0.5, -0.4999}), Mat3::Zero()})
      CHECK(forces_beside(mild, 8, 1, other) == alone);
  }
}

TEST_CASE("sheets that lie open are found as by a plain loop", "[self_collision_culling_kernel]") {
  constexpr int kRows = 4, kLeast = 17;  // columns beside the items: two vectors of any machine
  int open = 0, folded = 0;
  for_each_lane([&](int items, int extreme) {
    const int cols = items + kLeast, first = 3;
    const sim::SheetGrid grid{first, kRows, cols};
    const double axes[2][3] = {{0.8, 0.6, 0}, {-0.6, 0.8, 0}};
    for (const double lift : {0.0, 0.3, 0.9, 3.0, std::nan("")})
      for (const int column : {extreme, cols - 1 - extreme}) {
        Axes q(first + kRows * cols);
        for (int i = 0; i < kRows; ++i)
          for (int j = 0; j < cols; ++j) {
            const int id = first + i * cols + j;
            for (int k = 0; k < 3; ++k)
              q[k][id] = i * axes[0][k] + j * axes[1][k] + 0.05 * scattered(id, k);
          }
        q[0][first + (items % kRows) * cols + column] += lift;
        // The symmetric part of P F is at least c in each triangle.
        const double c = 0.4;
        bool plain = true;
        const auto projected = [&](int i, int j, int axis) {
          const Vec3 x = at(q, first + i * cols + j);
          return axes[axis][0] * x[0] + axes[axis][1] * x[1] + axes[axis][2] * x[2];
        };
        for (int i = 0; i + 1 < kRows; ++i)
          for (int j = 0; j + 1 < cols; ++j)
            for (int k = 0; k < 2; ++k) {
              double m[2][2];
              for (int axis = 0; axis < 2; ++axis) {
                m[axis][0] = projected(i + 1, j + k, axis) - projected(i, j + k, axis);
                m[axis][1] = projected(i + 1 - k, j + 1, axis) - projected(i + 1 - k, j, axis);
              }
              const double off = 0.5 * (m[0][1] + m[1][0]);
              plain =
                  plain && m[0][0] > c && m[1][1] > c && (m[0][0] - c) * (m[1][1] - c) > off * off;
            }
        std::vector<double> scratch(static_cast<std::size_t>(4 * (cols + 8)));
        CAPTURE(lift, column);
        CHECK(sim::unfolded_sheet()(inputs(q), grid, axes, c, scratch.data()) == plain);
        ++(plain ? open : folded);
      }
  });
  CHECK(open > 100);
  CHECK(folded > 100);
}
