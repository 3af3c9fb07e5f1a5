// Sparse factors in blocks of six.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <vector>

#include "plugins/contact/bodies/block_lu.h"

using namespace sim;

// A ring with two chords, whose elimination fills in; entries and solution are made up.
TEST_CASE("a sparse matrix of blocks that is not symmetric solves to rounding", "[linear]") {
  constexpr int kNodes = 9;
  constexpr std::size_t kSide = BlockLu::kSize, kAll = kSide * kNodes;
  std::vector<std::array<int, 2>> pairs;
  for (int i = 0; i < kNodes; ++i) pairs.push_back({i, (i + 1) % kNodes});
  pairs.push_back({7, 2});
  pairs.push_back({2, 7});  // the same again
  pairs.push_back({0, 4});
  BlockLu matrix;
  matrix.analyse(kNodes, pairs);
  matrix.clear();
  std::vector<double> dense(kAll * kAll);
  const auto set = [&](int row, int column) {
    BlockLu::Block& block = matrix.block(matrix.entry(row, column));
    for (std::size_t i = 0; i < kSide; ++i)
      for (std::size_t j = 0; j < kSide; ++j) {
        const double at =
            36 * (9 * row + column) + 6 * static_cast<double>(i) + static_cast<double>(j);
        // Zeros on the diagonal of its blocks: these need pivots.
        const double value = row == column ? (i == (j + 1) % kSide ? 20 : 0) + std::sin(at * at)
                                           : std::cos(0.7 * at * at);
        block[kSide * i + j] = i == j && row == column ? 0 : value;
        dense[kAll * (kSide * static_cast<std::size_t>(row) + i) +
              kSide * static_cast<std::size_t>(column) + j] = block[kSide * i + j];
      }
  };
  for (int i = 0; i < kNodes; ++i) set(i, i);
  for (const auto& [a, b] : pairs) set(a, b), set(b, a);
  std::vector<double> exact(kAll), x(kAll);
  for (std::size_t k = 0; k < kAll; ++k) exact[k] = 1 + std::sin(3.0 * static_cast<double>(k));
  for (std::size_t i = 0; i < kAll; ++i)
    for (std::size_t j = 0; j < kAll; ++j) x[i] += dense[kAll * i + j] * exact[j];
  REQUIRE(matrix.factorise());
  matrix.solve(x);
  for (std::size_t k = 0; k < kAll; ++k) CHECK(std::fabs(x[k] - exact[k]) < 1e-12);

  matrix.clear();
  CHECK_FALSE(matrix.factorise());
}
