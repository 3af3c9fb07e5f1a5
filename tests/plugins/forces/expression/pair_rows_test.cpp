// Rows of pairs for formulas, compared with sums over all pairs.
#include "plugins/forces/expression/pair_rows.h"

#include "tests/support/kernel_lists.h"

using namespace sim_test;
using sim::PairRows;
using sim::Vec3;

namespace {

double slope_at(double r) { return 3 - 2 / r; }

}  // namespace

TEST_CASE("rows of pairs have their distances, and add the forces of a sum over all pairs",
          "[pair_rows_kernel]") {
  for_each_lane([](int items, int extreme) {
    constexpr double kCutoff = 1.9;
    AllPairs all(items);
    const int other = (extreme + 1) % items;
    for (const bool of_square : {false, true})
      // Much nearer than others, just within reach, just beyond it, and at the same place.
      for (const double way : {0.3, 0.999999 * kCutoff, 1.000001 * kCutoff, 0.0, 1e-25}) {
        for (int i = 0; i < items; ++i) all.set(i, piled(i));
        if (other != extreme) all.set(extreme, all.at(other) + Vec3(0, way, 0));
        const auto kernels = sim::pair_row_kernels(of_square);
        CAPTURE(way, of_square);
        for (int b = 0; b < std::ssize(all.blocks); ++b) {
          const sim::NeighbourBlock& block = all.blocks[static_cast<std::size_t>(b)];
          constexpr int kMany = 3;
          double sums[3][8] = {};
          for (int first = 0; first < block.length; first += kMany) {
            PairRows rows;
            double slopes[PairRows::kMost];
            const int count = std::min(kMany, block.length - first);
            kernels.measure(block, b, all.points.data(), first, count, kCutoff, rows);
            for (int at = 0; at < 8 * count; ++at) {
              const int i = 8 * b + at % 8, entry = 8 * first + at, j = block.slots[entry];
              const double r =
                  entry / 8 < block.count[at % 8] ? (all.at(i) - all.at(j)).norm() : kCutoff;
              const double measure = of_square ? r * r : r;
              if (!(std::fabs(rows.measure[at] - measure) <= 1e-15 * measure))
                FAIL_CHECK(i << ", " << j << ": " << rows.measure[at] << ", not " << measure);
              if (r > 0 && !(std::fabs(rows.inverse[at] * measure - 1) <= 1e-15))
                FAIL_CHECK(i << ", " << j << ": 1/r = " << rows.inverse[at] << " of " << r);
              slopes[at] = r > 0 ? slope_at(r) / (of_square ? r : 1) : 7;
            }
            kernels.add(rows, slopes, count, kCutoff, sums);
          }
          for (int lane = 0; lane < 8; ++lane) {
            const int i = 8 * b + lane;
            Vec3 force = Vec3::Zero();
            for (int j = 0; j < items && i < items; ++j) {
              const Vec3 d = all.at(i) - all.at(j);
              const double r = d.norm();
              if (r > 0 && r < kCutoff) force = force - slope_at(r) / r * d;
            }
            for (int axis = 0; axis < 3; ++axis)
              if (!agree(sums[axis][lane], force[static_cast<std::size_t>(axis)], 1e-13 * items))
                FAIL_CHECK("particle " << i << ": " << sums[axis][lane] << ", not "
                                       << force[static_cast<std::size_t>(axis)]);
          }
        }
      }
  });
}

TEST_CASE("a pair at one place has no force if its slope is finite, and none that hides if not",
          "[pair_rows_kernel]") {
  for (const bool of_square : {false, true}) {
    PairRows rows{};
    double slopes[8] = {}, sums[3][8] = {};
    slopes[2] = 5;
    slopes[3] = HUGE_VAL;
    sim::pair_row_kernels(of_square).add(rows, slopes, 1, 1, sums);
    CHECK(sums[0][2] == 0);
    CHECK(std::isnan(sums[0][3]));
  }
}
