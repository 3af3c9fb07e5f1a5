// Dense panels of sparse factors, compared with plain loops.
#include <algorithm>

#include "core/linear/supernodal.h"
#include "tests/support/kernel_cases.h"

using namespace sim_test;

namespace {

// Columns of `rows` numbers, each a number further than the last, and room behind them.
struct Columns {
  Columns(int row_count, int columns) : rows(row_count), numbers(columns * stride()) {
    for (int j = 0; j < columns; ++j)
      for (int i = 0; i < rows; ++i) at(i, j) = scattered(i, j);
  }
  int stride() const { return rows + 1; }
  double& at(int i, int j) { return numbers[j * stride() + i]; }

  int rows;
  Column numbers;
};

}  // namespace

TEST_CASE("products of columns with four others are those of plain loops", "[supernodal_kernel]") {
  for_each_lane([](int items, int extreme) {
    const sim::PanelKernels kernels = sim::panel_kernels();
    const int depth = 1 + extreme % 5;
    Columns a(items, depth);
    a.at(extreme, depth - 1) = 1e12;
    double b[4 * 5];
    for (int i = 0; i < 4 * depth; ++i) b[i] = scattered(i, 7);
    Column c(4 * (items + 8));
    kernels.multiply(a.numbers.data(), a.stride(), items, b, depth, c.data(), items + 8);
    for (int j = 0; j < 4; ++j)
      for (int i = 0; i < items; ++i) {
        double sum = 0;
        for (int k = 0; k < depth; ++k) sum += a.at(i, k) * b[4 * k + j];
        if (c[j * (items + 8) + i] != sum)
          FAIL_CHECK("(" << i << ", " << j << ") is " << c[j * (items + 8) + i] << ", not " << sum);
      }
  });
}

TEST_CASE("columns are eliminated, and solved with, as by plain loops", "[supernodal_kernel]") {
  for_each_lane([](int items, int extreme) {
    const sim::PanelKernels kernels = sim::panel_kernels();
    // Six columns in groups of at most four, as the factors take them.
    const int columns = std::min(items, 1 + extreme % 6);
    Columns l(items, columns);
    for (int j = 0; j < columns; ++j) l.at(j, j) = (extreme % 2 ? -1 : 1) * (4.0 + j);
    Columns plain = l;
    double pivots[4] = {};
    const int group = std::min(columns, 4);
    const bool definite = extreme % 2 == 0;
    if (!definite)
      CHECK_FALSE(kernels.eliminate(l.numbers.data(), l.stride(), items, group, true, pivots));
    l = plain;
    CHECK(kernels.eliminate(l.numbers.data(), l.stride(), items, group, definite, pivots));
    for (int k = 0; k < group; ++k) {
      const double pivot = plain.at(k, k), inverse = 1 / pivot;
      CHECK(pivots[k] == pivot);
      for (int j = k + 1; j < group; ++j) {
        const double factor = plain.at(j, k) * inverse;
        for (int i = j; i < items; ++i) plain.at(i, j) -= plain.at(i, k) * factor;
      }
      for (int i = k + 1; i < items; ++i) plain.at(i, k) *= inverse;
    }
    bool same = true;
    for (int j = 0; j < columns; ++j)
      for (int i = j; i < items; ++i) same &= l.at(i, j) == plain.at(i, j);
    CHECK(same);

    Column x(items + 8), expected(items + 8);
    for (int i = 0; i < items; ++i) x[i] = expected[i] = scattered(i, 3);
    kernels.forward(l.numbers.data(), l.stride(), items, columns, x.data());
    for (int k = 0; k < columns; ++k)
      for (int i = k + 1; i < items; ++i) expected[i] -= l.at(i, k) * expected[k];
    for (int i = 0; i < items; ++i) same &= x[i] == expected[i];
    CHECK(same);
    kernels.backward(l.numbers.data(), l.stride(), items, columns, x.data());
    double largest = 0;
    for (int k = columns - 1; k >= 0; --k) {
      for (int i = k + 1; i < items; ++i) expected[k] -= l.at(i, k) * expected[i];
      largest = std::max(largest, std::fabs(x[k] - expected[k]) / (1 + std::fabs(expected[k])));
    }
    CHECK(largest < 1e-12);
  });
}
