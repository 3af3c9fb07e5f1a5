// First contacts of vertices with triangles and of edges, and crossings of sheets, from exact
// arithmetic (tests/reference/first_contact.csv, crossings.csv).
#include "plugins/contact/surfaces/time_of_impact.h"

#include <catch2/catch.hpp>
#include <random>

#include "core/particles/elements/mesh_intersections.h"
#include "plugins/contact/surfaces/self_collision_culling.h"
#include "tests/support/table.h"

namespace {

using sim::FourPoints;
using sim::PairKind;
using sim::Vec3;

Vec3 point_of(const sim_test::Row& row, const std::string& what, std::size_t k) {
  const std::string name = what + std::to_string(k);
  return {row.number(name + "x"), row.number(name + "y"), row.number(name + "z")};
}

struct Case {
  PairKind kind;
  FourPoints start, way;
};

Case case_of(const sim_test::Row& row) {
  Case one{row.number("kind") == 0 ? PairKind::kVertexTriangle : PairKind::kEdgeEdge, {}, {}};
  for (std::size_t k = 0; k < 4; ++k) {
    // In the file the vertex is the last of the four.
    const std::size_t from = one.kind == PairKind::kVertexTriangle ? (k + 3) % 4 : k;
    one.start[k] = point_of(row, "start", from);
    one.way[k] = point_of(row, "end", from) - one.start[k];
  }
  return one;
}

// The least distance by a search over both parts: nothing of it is in the code that is tested.
double sampled_distance(PairKind kind, const FourPoints& p, int steps) {
  double least = HUGE_VAL;
  const bool vertex = kind == PairKind::kVertexTriangle;
  for (int i = 0; i <= steps; ++i)
    for (int j = 0; j <= (vertex ? steps - i : steps); ++j) {
      const double a = double(i) / steps, b = double(j) / steps;
      const Vec3 r = vertex ? p[0] - (p[1] + a * (p[2] - p[1]) + b * (p[3] - p[1]))
                            : p[0] + a * (p[1] - p[0]) - (p[2] + b * (p[3] - p[2]));
      least = std::min(least, r.norm());
    }
  return least;
}

}  // namespace

TEST_CASE("no contact is missed, and its time is right") {
  const sim_test::Table table("first_contact.csv");
  REQUIRE(table.rows().size() == 93);
  for (const sim_test::Row& row : table.rows()) {
    INFO(row.text("what"));
    const Case one = case_of(row);
    const double hit = row.number("hit"), margin = row.number("margin");
    double size = 0;
    for (std::size_t k = 0; k < 4; ++k)
      size = std::max(size, (one.start[k] - one.start[0]).cwiseAbs().maxCoeff());
    const sim::TimeOfImpact found =
        sim::time_of_impact(one.kind, one.start, one.way, 1e-11 * std::min(size, 1.0));
    if (hit == 0) CHECK_FALSE(found.hit);
    if (hit != 1) continue;  // in one plane all the time: the distance says it, below
    CHECK(found.hit);
    CHECK(found.s <= row.number("t") + 1e-15);
    if (margin > 1e-4) CHECK(found.s == Approx(row.number("t")).margin(1e-9).epsilon(0));
  }
}

TEST_CASE("ways in one plane count by the distance") {
  const sim_test::Table table("first_contact.csv");
  int met = 0;
  for (const sim_test::Row& row : table.rows_where("hit", 2)) {
    INFO(row.text("what"));
    const Case one = case_of(row);
    double least = HUGE_VAL;
    for (int step = 0; step <= 400; ++step) {
      FourPoints now = one.start;
      for (std::size_t k = 0; k < 4; ++k) now[k] += step / 400.0 * one.way[k];
      least = std::min(least, sampled_distance(one.kind, now, 40));
    }
    if (least < 1e-3) {
      CHECK(sim::time_of_impact(one.kind, one.start, one.way, 1e-3).hit);
      ++met;
    }
  }
  CHECK(met >= 3);
}

TEST_CASE("a step that is called free keeps the distance") {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int free = 0, hits = 0;
  for (int trial = 0; trial < 4000; ++trial) {
    const PairKind kind = trial % 2 ? PairKind::kEdgeEdge : PairKind::kVertexTriangle;
    FourPoints p, d;
    const double flat = trial % 3 ? 1 : 1e-7;  // thin parts, too
    for (std::size_t k = 0; k < 4; ++k) {
      p[k] = Vec3(uniform(random), flat * uniform(random), uniform(random));
      d[k] = Vec3(uniform(random), uniform(random), uniform(random));
    }
    const double gap = 1e-3;
    const sim::TimeOfImpact found = sim::time_of_impact(kind, p, d, gap);
    double least = HUGE_VAL;
    for (int step = 0; step <= 60; ++step) {
      FourPoints now = p;
      for (std::size_t k = 0; k < 4; ++k) now[k] += found.s * step / 60.0 * d[k];
      const sim::Separation apart = sim::separation_of(kind, now);
      CHECK(apart.gap <= sampled_distance(kind, now, 12) * (1 + 1e-12));
      if (found.s > 0) least = std::min(least, sampled_distance(kind, now, 12));
    }
    if (found.s > 0) CHECK(least >= 0.5 * gap);
    (found.hit ? hits : free) += 1;
  }
  CHECK(free > 500);
  CHECK(hits > 300);
}

// The nearest points of two parts: none of a dense search are nearer, and the line between them is
// as long as the gap.
TEST_CASE("weights lead from one part to the other by the shortest way") {
  std::mt19937 random(11);
  std::uniform_real_distribution<double> uniform(-1, 1);
  int inside = 0, ends = 0, sides = 0;
  for (int trial = 0; trial < 600; ++trial) {
    const PairKind kind = trial % 2 ? PairKind::kEdgeEdge : PairKind::kVertexTriangle;
    FourPoints p;
    for (Vec3& each : p) each = Vec3(uniform(random), uniform(random), uniform(random));
    if (trial % 4 == 3) p[3] = p[2] + 0.7 * (p[1] - p[0]);  // parallel edges
    if (trial % 8 == 6) p[0] = p[1] + 0.3 * (p[2] - p[1]) + Vec3(0, 0, 1e-3);
    const sim::Separation apart = sim::separation_of(kind, p);
    const std::size_t first = kind == PairKind::kEdgeEdge ? 2 : 1;
    double sums[2] = {0, 0};
    Vec3 r = Vec3::Zero();
    int zeros = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      CHECK((k < first ? apart.weights[k] : -apart.weights[k]) >= -1e-12);
      sums[k < first ? 0 : 1] += apart.weights[k];
      zeros += std::abs(apart.weights[k]) < 1e-12;
      r += apart.weights[k] * p[k];
    }
    CHECK(sums[0] == Approx(1).epsilon(1e-12));
    CHECK(sums[1] == Approx(-1).epsilon(1e-12));
    CHECK((r / r.norm() - apart.normal).norm() < 1e-9);
    CHECK(apart.gap == Approx(r.norm()).epsilon(1e-6));
    const double sampled = sampled_distance(kind, p, 60);
    CHECK(r.norm() <= sampled * (1 + 1e-12));
    CHECK(r.norm() >= sampled - 0.06);
    (zeros == 0 ? inside : zeros == 1 ? sides : ends) += 1;
  }
  CHECK((inside > 50 && sides > 50 && ends > 50));
}

// Needles: their corners are nearly in one line, so that their planes mean little.
TEST_CASE("distances of thin triangles are right, too") {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int trial = 0; trial < 400; ++trial) {
    FourPoints p;
    for (Vec3& each : p) each = Vec3(uniform(random), uniform(random), uniform(random));
    const double thin = std::pow(10, -4 - trial % 13);
    const Vec3 off(uniform(random), uniform(random), uniform(random));
    p[3] = p[1] + (trial % 3 - 0.4) * (p[2] - p[1]) + thin * off;
    if (trial % 2) p[0] = p[1] + 0.3 * (p[2] - p[1]) + 0.01 * off;
    const sim::Separation apart = sim::separation_of(PairKind::kVertexTriangle, p);
    INFO(trial << ", " << thin);
    // The least of the distances to its edges, but for what the inside of a needle adds.
    double least = HUGE_VAL;
    for (std::size_t k = 1; k < 4; ++k) {
      const Vec3 a = p[k], d = p[k % 3 + 1] - a;
      const double s = std::clamp((p[0] - a).dot(d) / d.squaredNorm(), 0.0, 1.0);
      least = std::min(least, (p[0] - a - s * d).norm());
    }
    CHECK(apart.gap <= least * (1 + 1e-12));
    CHECK(apart.gap >= (least - 4 * thin) * (1 - 1e-6));
    Vec3 r = Vec3::Zero();
    for (std::size_t k = 0; k < 4; ++k) r += apart.weights[k] * p[k];
    CHECK((r.norm() >= 0.99 * apart.gap && r.norm() <= 1.01 * least + 4 * thin));
  }
}

// Head-on at the speed v from the height z: the gap is reached at (z - gap) / v, or a little before
// it, by what it takes to advance to half of it.
TEST_CASE("times of impact of simple ways are their closed forms") {
  constexpr double kGap = 1e-6;
  const FourPoints triangle{Vec3(0.2, 0.3, 0.8), Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0)},
      cross{Vec3(-1, 0, 0.8), Vec3(1, 0, 0.8), Vec3(0, -1, 0), Vec3(0, 1, 0)},
      along{Vec3(0, 0, 0.8), Vec3(1, 0, 0.8), Vec3(0.5, 0, 0), Vec3(1.5, 0, 0)};
  for (const auto& [kind, start] : {std::pair(PairKind::kVertexTriangle, triangle),
                                    {PairKind::kEdgeEdge, cross},
                                    {PairKind::kEdgeEdge, along}}) {
    const auto met = [&, kind = kind, start = start](const Vec3& first, const Vec3& second,
                                                     double height) {
      FourPoints p = start, way;
      const std::size_t count = kind == PairKind::kEdgeEdge ? 2 : 1;
      for (std::size_t k = 0; k < 4; ++k) {
        if (k < count) p[k] += Vec3(0, 0, height - 0.8);
        way[k] = k < count ? first : second;
      }
      return sim::time_of_impact(kind, p, way, kGap);
    };
    for (const double speed : {0.9, 1.6, 3.2, 64.0}) {
      INFO(speed);
      // Either part moves, or both; sideways motion of both changes nothing.
      for (const auto& [first, second] :
           {std::pair(Vec3(0, 0, -speed), Vec3(0, 0, 0)),
            {Vec3(0, 0, 0), Vec3(0, 0, speed)},
            {Vec3(5, -7, -0.25 * speed), Vec3(5, -7, 0.75 * speed)}}) {
        const sim::TimeOfImpact found = met(first, second, 0.8);
        REQUIRE(found.hit);
        CHECK(found.s <= (0.8 - 0.5 * kGap) / speed + 1e-15);
        CHECK(found.s >= (0.8 - kGap) / speed - 1e-15);
        CHECK(found.then.gap <= kGap);
        CHECK(std::abs(found.then.normal.z() - 1) < 1e-6);
        CHECK_FALSE(met(-first, -second, 0.8).hit);  // away
      }
    }
    // At the end of the way, and just beyond it.
    CHECK(met(Vec3(0, 0, -0.8), Vec3(0, 0, 0), 0.8).hit);
    const sim::TimeOfImpact missed = met(Vec3(0, 0, -0.8), Vec3(0, 0, 0), 0.8 + 2 * kGap);
    CHECK_FALSE(missed.hit);
    CHECK(missed.s == 1);
    // Near from the start: at once, wherever they go; at rest, too.
    for (const Vec3& way : {Vec3(0, 0, -1), Vec3(0, 0, 1), Vec3(0, 0, 0)}) {
      const sim::TimeOfImpact now = met(way, Vec3(0, 0, 0), 0.99 * kGap);
      CHECK(now.hit);
      CHECK(now.s == 0);
    }
    CHECK_FALSE(met(Vec3(0, 0, 0), Vec3(0, 0, 0), 1.01 * kGap).hit);
    // Grazing ways at twice the gap never meet, those within it do.
    CHECK_FALSE(met(Vec3(100, 0, 0), Vec3(0, 0, 0), 2 * kGap).hit);
    CHECK(sim::relative_motion(kind,
                               {Vec3(3, 0, 0), Vec3(3, 0, 0), Vec3(3, 4, 0), Vec3(3, 4, 0)}) == 4);
  }
}

TEST_CASE("sheets cross as often as exact fractions count") {
  const sim_test::Table table("crossings.csv");
  for (int mesh = 0; mesh < 12; ++mesh) {
    const std::vector<sim_test::Row> rows = table.rows_where("mesh", mesh);
    const int n = static_cast<int>(rows.front().number("rows"));
    const int m = static_cast<int>(rows.front().number("cols"));
    std::vector<double> x, y, z;
    for (const sim_test::Row& row : rows)
      x.push_back(row.number("x")), y.push_back(row.number("y")), z.push_back(row.number("z"));
    sim::ParticleView view;
    view.n = n * m;
    view.x = x.data(), view.y = y.data(), view.z = z.data();
    std::vector<sim::TriangleMesh::Triangle> triangles;
    for (int i = 0; i + 1 < n; ++i)
      for (int j = 0; j + 1 < m; ++j) {
        const int at = i * m + j;
        triangles.push_back({at, at + m, at + 1});
        triangles.push_back({at + m, at + m + 1, at + 1});
      }
    const std::shared_ptr<const sim::TriangleMesh> surfaces[] = {
        std::make_shared<const sim::TriangleMesh>(n * m, triangles)};
    sim::MeshIntersections crossings(surfaces);
    CHECK(crossings.count(view) == static_cast<std::int64_t>(rows.front().number("crossings")));
    CHECK(crossings.first(view).empty() == (rows.front().number("crossings") == 0));
    // The least distance of a vertex and a triangle without it.
    double least = HUGE_VAL;
    for (int i = 0; i < n * m; ++i)
      for (const auto& [a, b, c] : surfaces[0]->triangles())
        if (i != a && i != b && i != c)
          least = std::min(least, sim::separation_of(PairKind::kVertexTriangle,
                                                     {view.position(i), view.position(a),
                                                      view.position(b), view.position(c)})
                                      .gap);
    CHECK(least == Approx(rows.front().number("least_distance")).margin(1e-12));
  }
}

TEST_CASE("a sheet that is called open keeps its distances") {
  constexpr int kRows = 9, kCols = 19;
  const sim::TriangleMesh mesh(kRows * kCols, sim::grid_triangles({kRows, kCols, 1}, false));
  const auto grid = sim::sheet_of(mesh);
  REQUIRE(grid);
  CHECK((grid->first == 0 && grid->rows == kRows && grid->cols == kCols));
  CHECK_FALSE(sim::sheet_of(sim::TriangleMesh(90, sim::grid_triangles({9, 10, 1}, false))));
  std::mt19937 random(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  sim::SelfCollisionCulling sheet(*grid);
  int open = 0, closed = 0;
  for (int trial = 0; trial < 60; ++trial) {
    const double rough = 0.05 * (trial % 12), bend = 0.12 * (trial % 7);
    std::vector<double> q[2][3];
    for (int end = 0; end < 2; ++end)
      for (int i = 0; i < kRows; ++i)
        for (int j = 0; j < kCols; ++j) {
          const double turn = bend * (j - 9) * (end ? 1 : 0.8);
          const Vec3 place(bend > 0 ? std::sin(turn) / bend : j,
                           bend > 0 ? std::cos(turn) / bend : 0, i);
          for (std::size_t axis = 0; axis < 3; ++axis)
            q[end][axis].push_back(place[axis] + rough * uniform(random));
        }
    const auto axes = [&](int end) {
      return std::array<const double*, 3>{q[end][0].data(), q[end][1].data(), q[end][2].data()};
    };
    constexpr double kDistance = 0.1;
    if (!sheet.stays_open(axes(0), axes(1), kDistance)) {
      ++closed;
      continue;
    }
    ++open;
    for (const double s : {0.0, 0.3, 0.7, 1.0}) {
      const auto at = [&](int id) {
        const auto k = static_cast<std::size_t>(id);
        Vec3 place;
        for (std::size_t axis = 0; axis < 3; ++axis)
          place[axis] = q[0][axis][k] + s * (q[1][axis][k] - q[0][axis][k]);
        return place;
      };
      double least = HUGE_VAL;
      for (const auto& [a, b, c] : mesh.triangles())
        for (int v = 0; v < kRows * kCols; ++v)
          if (v != a && v != b && v != c)
            least = std::min(
                least,
                sim::separation_of(PairKind::kVertexTriangle, {at(v), at(a), at(b), at(c)}).gap);
      for (const auto& e : mesh.edges())
        for (const auto& f : mesh.edges()) {
          const auto [a, b] = e.ends;
          const auto [c, d] = f.ends;
          if (a == c || a == d || b == c || b == d) continue;
          least = std::min(
              least, sim::separation_of(PairKind::kEdgeEdge, {at(a), at(b), at(c), at(d)}).gap);
        }
      CHECK(least >= kDistance);
    }
  }
  CHECK(open > 5);
  CHECK(closed > 20);
}

// A ball at height y falls on a triangle, and a rod on an edge: they meet when y less the way is
// the radius and the gap that is asked for.
TEST_CASE("balls and rods with a radius meet when their surfaces do") {
  const double radius = 0.3, gap = 0.01;
  const Vec3 none = Vec3::Zero(), fall(0, -2, 0);
  const FourPoints ball{Vec3(0.2, 1, 0.2), {0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  const FourPoints rod{Vec3(-1, 1, 0), {1, 1, 0}, {0, 0, -1}, {0, 0, 1}};
  for (const auto& [kind, p, d] :
       {std::tuple{PairKind::kVertexTriangle, ball, FourPoints{fall, none, none, none}},
        std::tuple{PairKind::kEdgeEdge, rod, FourPoints{fall, fall, none, none}}}) {
    const sim::TimeOfImpact met = sim::time_of_impact(kind, p, d, gap, radius);
    REQUIRE(met.hit);
    CHECK(met.s <= (1 - radius - 0.5 * gap) / 2);
    CHECK(met.s >= (1 - radius - gap) / 2 - 1e-12);
    CHECK(met.then.gap == Approx(1 - 2 * met.s - radius));
    CHECK(!sim::time_of_impact(kind, p, {0.3 * d[0], 0.3 * d[1], none, none}, gap, radius).hit);
  }
}
