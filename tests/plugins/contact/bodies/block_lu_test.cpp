// Sparse factors in blocks of six.
#include <catch2/catch.hpp>

#include <array>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "core/simd/simd_targets.h"
#include "plugins/contact/bodies/block_lu.h"

using namespace sim;

namespace {

// A matrix of 2 x 2 blocks, with entries that are made up and pivots off the diagonal.
std::array<LuBlock, 4> made_up_blocks() {
  std::array<LuBlock, 4> blocks{};  // both of the diagonal, below, above
  for (std::size_t b = 0; b < blocks.size(); ++b)
    for (std::size_t i = 0; i < kBlockSize; ++i)
      for (std::size_t j = 0; j < kBlockSize; ++j)
        blocks[b](i, j) = std::sin(1.7 * static_cast<double>(36 * b + 6 * i + j)) +
                          (b < 2 && i == (j + 2) % kBlockSize ? 4 : 0);
  return blocks;
}

// The inverse by rows: Gauss and Jordan's elimination, number by number.
LuBlock inverse_of(LuBlock a) {
  LuBlock inverse{};
  for (std::size_t k = 0; k < kBlockSize; ++k) inverse(k, k) = 1;
  for (std::size_t k = 0; k < kBlockSize; ++k) {
    std::size_t pivot = k;
    for (std::size_t i = k + 1; i < kBlockSize; ++i)
      if (std::fabs(a(i, k)) > std::fabs(a(pivot, k))) pivot = i;
    const double scale = 1 / a(pivot, k);
    for (LuBlock* block : {&inverse, &a})
      for (std::size_t j = 0; j < kBlockSize; ++j)
        std::swap((*block)(k, j), (*block)(pivot, j)), (*block)(k, j) *= scale;
    for (std::size_t i = 0; i < kBlockSize; ++i) {
      const double factor = i == k ? 0 : a(i, k);
      for (LuBlock* block : {&inverse, &a})
        for (std::size_t j = 0; j < kBlockSize; ++j) (*block)(i, j) -= factor * (*block)(k, j);
    }
  }
  return inverse;
}

LuBlock minus_product(const LuBlock& a, const LuBlock& b, LuBlock c) {
  for (std::size_t i = 0; i < kBlockSize; ++i)
    for (std::size_t j = 0; j < kBlockSize; ++j)
      for (std::size_t k = 0; k < kBlockSize; ++k) c(i, j) -= a(i, k) * b(k, j);
  return c;
}

bool same(const LuBlock& a, const LuBlock& b) {
  for (std::size_t i = 0; i < kBlockSize; ++i)
    for (std::size_t j = 0; j < kBlockSize; ++j)
      if (a(i, j) != b(i, j)) return false;
  return true;
}

}  // namespace

TEST_CASE("blocks are factorised with the bits of plain loops by every instruction set",
          "[block_lu_kernel]") {
  const std::array<LuBlock, 4> a = made_up_blocks();
  std::array<LuBlock, 4> factors = a;
  factors[0] = inverse_of(a[0]);
  const LuBlock negative = minus_product(a[2], factors[0], LuBlock{});
  for (std::size_t i = 0; i < kBlockSize; ++i)
    for (std::size_t j = 0; j < kBlockSize; ++j) factors[2](i, j) = -negative(i, j);
  factors[1] = inverse_of(minus_product(factors[2], a[3], a[1]));

  double rows[3][kBlockStride] = {}, products[3][kBlockStride] = {};
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < kBlockSize; ++i)
      rows[k][i] = std::cos(static_cast<double>(6 * k + i)), products[k][i] = 1 / rows[k][i];
  LuBlock sum = a[1];
  for (std::size_t i = 0; i < kBlockSize; ++i)
    for (std::size_t j = 0; j < kBlockSize; ++j)
      for (std::size_t k = 0; k < 3; ++k) sum(i, j) += rows[k][i] * products[k][j];

  const std::size_t begin[] = {0, 1, 1}, row[] = {1}, target[] = {1};
  for (const SimdLevel level : simd_levels()) {
    CAPTURE(simd_name(level));
    setenv("SIM_SIMD", simd_name(level), 1);
    const BlockLuKernels kernels = block_lu_kernels();
    unsetenv("SIM_SIMD");
    std::array<LuBlock, 4> blocks = a;
    const LuBlocks matrix{2, begin, row, target, blocks.data()};
    REQUIRE(kernels.factorise(matrix));
    for (std::size_t b = 0; b < blocks.size(); ++b) CHECK(same(blocks[b], factors[b]));

    double x[2 * kBlockStride] = {}, product[2 * kBlockStride] = {};
    for (std::size_t k = 0; k < kBlockSize; ++k)
      x[k] = 1 + 0.1 * static_cast<double>(k), x[8 + k] = -2;
    for (std::size_t i = 0; i < kBlockSize; ++i)
      for (std::size_t j = 0; j < kBlockSize; ++j) {
        product[i] += a[0](i, j) * x[j] + a[3](i, j) * x[8 + j];
        product[8 + i] += a[2](i, j) * x[j] + a[1](i, j) * x[8 + j];
      }
    kernels.solve(matrix, product);
    for (std::size_t k = 0; k < 2 * kBlockStride; ++k) CHECK(std::fabs(product[k] - x[k]) < 1e-13);

    LuBlock added = a[1];
    kernels.add_product(rows, products, added);
    CHECK(same(added, sum));
    blocks[0] = LuBlock{};
    CHECK_FALSE(kernels.factorise(matrix));
  }
}

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
    LuBlock& block = matrix.block(matrix.entry(row, column));
    for (std::size_t i = 0; i < kSide; ++i)
      for (std::size_t j = 0; j < kSide; ++j) {
        const double at =
            36 * (9 * row + column) + 6 * static_cast<double>(i) + static_cast<double>(j);
        // Zeros on the diagonal of its blocks: these need pivots.
        const double value = row == column ? (i == (j + 1) % kSide ? 20 : 0) + std::sin(at * at)
                                           : std::cos(0.7 * at * at);
        block(i, j) = i == j && row == column ? 0 : value;
        dense[kAll * (kSide * static_cast<std::size_t>(row) + i) +
              kSide * static_cast<std::size_t>(column) + j] = block(i, j);
      }
  };
  for (int i = 0; i < kNodes; ++i) set(i, i);
  for (const auto& [a, b] : pairs) set(a, b), set(b, a);
  std::vector<double> exact(kAll), x(BlockLu::kStride * kNodes);
  for (std::size_t k = 0; k < kAll; ++k) exact[k] = 1 + std::sin(3.0 * static_cast<double>(k));
  const auto slot_of = [](std::size_t k) { return BlockLu::kStride * (k / kSide) + k % kSide; };
  for (std::size_t i = 0; i < kAll; ++i)
    for (std::size_t j = 0; j < kAll; ++j) x[slot_of(i)] += dense[kAll * i + j] * exact[j];
  REQUIRE(matrix.factorise());
  matrix.solve(x);
  for (std::size_t k = 0; k < kAll; ++k) CHECK(std::fabs(x[slot_of(k)] - exact[k]) < 1e-12);

  matrix.clear();
  CHECK_FALSE(matrix.factorise());
}
