// Kernels over plain arrays of numbers, compared with plain loops.
#include <algorithm>
#include <limits>

#include "core/geometry/bounding_box.h"
#include "core/ode/ode_system.h"
#include "core/particles/neighbours/neighbours.h"
#include "core/simd/convert.h"
#include "tests/support/kernel_cases.h"

using namespace sim_test;

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr int kBefore = 5;  // items that stand before those of a range

struct Motions {
  Axes q, v0, v1, from;
  explicit Motions(int items) : q(items), v0(items), v1(items), from(items) {
    scatter(q, 0);
    scatter(v0, 1);
    scatter(v1, 2);
    scatter(from, 3);
  }
};

double square(double x, double y, double z) { return std::fma(z, z, std::fma(y, y, x * x)); }

sim::BoundingBox plain_extent(const Motions& m, bool with_from, int begin, int end) {
  sim::BoundingBox all{
      {kInfinity, kInfinity, kInfinity}, {-kInfinity, -kInfinity, -kInfinity}, {}, 0};
  const auto raise = [](double& most, double value) { most = value > most ? value : most; };
  for (int i = begin; i < end; ++i) {
    for (int k = 0; k < 3; ++k) {
      all.least[k] = m.q[k][i] < all.least[k] ? m.q[k][i] : all.least[k];
      raise(all.most[k], m.q[k][i]);
    }
    raise(all.fastest[0], square(m.v0[0][i], m.v0[1][i], m.v0[2][i]));
    raise(all.fastest[1], square(m.v1[0][i], m.v1[1][i], m.v1[2][i]));
    if (with_from)
      raise(all.farthest,
            square(m.q[0][i] - m.from[0][i], m.q[1][i] - m.from[1][i], m.q[2][i] - m.from[2][i]));
  }
  return all;
}

bool same(const sim::BoundingBox& a, const sim::BoundingBox& b) {
  for (int k = 0; k < 3; ++k)
    if (a.least[k] != b.least[k] || a.most[k] != b.most[k]) return false;
  return a.fastest[0] == b.fastest[0] && a.fastest[1] == b.fastest[1] && a.farthest == b.farthest;
}

}  // namespace

TEST_CASE("the extent of particles is that of a plain loop", "[bounding_box_kernel]") {
  for_each_lane([](int items, int extreme) {
    for (const int begin : {0, kBefore}) {
      const int end = begin + items, at = begin + extreme;
      Motions m(end + 3);
      for (int k = 0; k < 3; ++k)  // those outside of the range are far away and fast
        for (int i = 0; i < end + 3; ++i)
          if (i < begin || i >= end) m.q[k][i] = m.v0[k][i] = m.v1[k][i] = i % 2 ? 1e6 : -1e6;
      // A coordinate below and above all others, fast at either end, far from its start, unknown.
      for (int kind = 0; kind < 13; ++kind) {
        Motions now = m;
        const int k = kind % 3;
        if (kind < 3)
          now.q[k][at] = -50;
        else if (kind < 6)
          now.q[k][at] = 50;
        else if (kind < 9)
          (kind < 8 ? now.v0 : now.v1)[k][at] = -60;
        else if (kind < 12)
          now.from[k][at] = 70;
        else
          now.q[k][at] = kNan;
        for (const bool with_from : {true, false}) {
          const auto from = inputs(now.from);
          CAPTURE(begin, kind, with_from);
          CHECK(same(sim::bounding_box_of()(
                         inputs(now.q), inputs(now.v0), inputs(now.v1),
                         with_from ? static_cast<const double* const*>(from) : nullptr, begin, end),
                     plain_extent(now, with_from, begin, end)));
        }
      }
    }
  });
}

TEST_CASE("numbers are rounded to floats and back as one by one", "[convert_kernel]") {
  for_each_lane([](int items, int extreme) {
    for (const double value : {1e300, -1e300, 1e-300, 1e-42, kInfinity, kNan, -0.0, 1 + 0x1p-24}) {
      Column from(items);
      scatter(from, 0);
      from[extreme] = value;
      ColumnOf<float> narrow(items), plain(items);
      Column wide(items), plain_wide(items);
      for (int i = 0; i < items; ++i) {
        plain[i] = static_cast<float>(from[i]);
        plain_wide[i] = static_cast<double>(plain[i]);
      }
      sim::convert().to_float(from.data(), narrow.data(), items);
      sim::convert().to_double(narrow.data(), wide.data(), items);
      CAPTURE(value);
      CHECK(first_difference(narrow, plain) == -1);
      CHECK(first_difference(wide, plain_wide) == -1);
      CHECK(std::signbit(narrow[extreme]) == std::signbit(plain[extreme]));
      CHECK((narrow[items] == 7777 && wide[items] == 7777));
    }
  });
}

TEST_CASE("stages are combined as by a plain loop", "[combine_kernel]") {
  for_each_lane([](int items, int extreme) {
    for (const int begin : {0, kBefore})
      for (int terms = 0; terms <= 3; ++terms) {
        const int end = begin + items;
        Column x(end), out(end), plain(end);
        scatter(x, 0);
        std::vector<Column> k(static_cast<std::size_t>(terms), Column(end));
        std::vector<sim::Stage::Term> list;
        for (int j = 0; j < terms; ++j) {
          auto& column = k[static_cast<std::size_t>(j)];
          scatter(column, 1 + j);
          column[begin + extreme] = j == 1 ? kNan : 1e9;
          list.push_back({0.3 + j, column.data()});
        }
        x[begin + extreme] = -1e9;
        for (int i = begin; i < end; ++i) {
          plain[i] = x[i];
          for (const auto& [coef, values] : list) plain[i] += coef * values[i];
        }
        sim::combine_range()({x.data(), list}, out.data(), static_cast<std::size_t>(begin),
                             static_cast<std::size_t>(end));
        CAPTURE(begin, terms);
        CHECK(first_difference(out, plain) == -1);
        CHECK(out[end] == 7777);
      }
  });
}

TEST_CASE("particles of some cells come by ascending id", "[neighbours_kernel]") {
  for_each_lane([](int items, int extreme) {
    // Ids near each other and far apart; places between two rows are left out.
    const int most = 20000, gap = 3;
    std::vector<std::int32_t> order(static_cast<std::size_t>(items + gap), most - 2);
    Axes q(items + gap);
    scatter(q, 0);
    Column points(4 * (items + gap));
    const auto split = extreme;
    std::vector<std::pair<int, int>> plain;
    for (int i = 0; i < items; ++i) {
      const int p = i < split ? i : i + gap, step = items % 2 ? 7 : 499;
      order[static_cast<std::size_t>(p)] = i == extreme ? most - 1 : (i + 5) * 41 % items * step;
      plain.emplace_back(order[static_cast<std::size_t>(p)], p);
    }
    for (int p = 0; p < items + gap; ++p)
      for (int axis = 0; axis < 3; ++axis) points[4 * p + axis] = q[axis][p];
    std::ranges::sort(plain);
    std::vector<sim::FoundParticles::Word> ids(most / 64 + 1);
    std::vector<std::uint64_t> filled(most / 4096 + 1);
    std::vector<std::int32_t> places(static_cast<std::size_t>(items));
    Axes found(items);
    const sim::CellGrid::Rows rows{{{0, split}, {split + gap, items + gap}}, 2};
    for (int again = 0; again < 2; ++again) {
      const int count =
          sim::neighbour_kernels().sort(rows, order.data(), points.data(),
                                        {ids.data(),
                                         filled.data(),
                                         static_cast<int>(ids.size()),
                                         places.data(),
                                         {found[0].data(), found[1].data(), found[2].data()}});
      REQUIRE(count == items);
      CHECK(std::ranges::all_of(ids, [](const auto& word) { return word.bits == 0; }));
      CHECK(std::ranges::count(filled, 0u) == std::ssize(filled));
      for (int k = 0; k < items; ++k) {
        const int p = plain[static_cast<std::size_t>(k)].second;
        if (places[static_cast<std::size_t>(k)] != p)
          FAIL_CHECK(k << ": " << places[static_cast<std::size_t>(k)] << ", not " << p);
        for (int axis = 0; axis < 3; ++axis)
          if (found[axis][k] != q[axis][p]) FAIL_CHECK("coordinate of " << k);
      }
    }
  });
}

TEST_CASE("points within a distance are those of a plain loop", "[neighbours_kernel]") {
  for_each_lane([](int items, int extreme) {
    for (const int begin : {0, kBefore})
      for (const double value : {0.5, std::nextafter(0.5, 1.0), 1e200, kNan}) {
        const int end = begin + items;
        Axes q(end);
        scatter(q, 0);
        const int own = begin + (extreme + 3) % items;
        const double limit = 0.25;
        q[0][begin + extreme] = q[0][own] + value;
        if (begin + extreme != own) {
          q[0][own] = 0;
          q[0][begin + extreme] = value;
          q[1][begin + extreme] = q[1][own];
          q[2][begin + extreme] = q[2][own];
        }
        std::vector<std::int32_t> plain, found(static_cast<std::size_t>(items + 8), -1);
        for (int i = begin; i < end; ++i)
          if (square(q[0][i] - q[0][own], q[1][i] - q[1][own], q[2][i] - q[2][own]) <= limit)
            plain.push_back(i);
        const int count =
            sim::neighbour_kernels().near(inputs(q), begin, end, own, limit, found.data());
        found.resize(static_cast<std::size_t>(std::max(count, 0)));
        CAPTURE(begin, value);
        CHECK(found == plain);
      }
  });
}
