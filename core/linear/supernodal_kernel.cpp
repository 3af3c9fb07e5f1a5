#include "core/linear/supernodal.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "core/linear/supernodal_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

constexpr int kRows = 8, kColumns = 4;

using EightRows = Registers<kRows>;

SIM_INLINE void add_product(EightRows& sum, const EightRows& a, Doubles b) {
  for (int i = 0; i < EightRows::kParts; ++i) sum.part[i] += a.part[i] * b;
}

void multiply(const double* a, std::ptrdiff_t stride, int rows, const double* b, int depth,
              double* c, std::ptrdiff_t c_stride) {
  for (int i = 0; i < rows; i += kRows) {
    EightRows sum[kColumns] = {};
    const double* from = a + i;
    for (int k = 0; k < depth; ++k, from += stride) {
      const EightRows column = load_registers<kRows>(from);
      for (int j = 0; j < kColumns; ++j)
        add_product(sum[j], column, splat<double>(b[kColumns * k + j]));
    }
    for (int j = 0; j < kColumns; ++j) store(c + j * c_stride + i, sum[j]);
  }
}

// to := to - from * factor, and then from := from * scale.
SIM_INLINE void subtract(double* to, const double* from, int rows, double factor) {
  const Doubles f = splat<double>(factor);
  int i = 0;
  for (; i + kDoubles <= rows; i += kDoubles) store(to + i, load(to + i) - load(from + i) * f);
  for (; i < rows; ++i) to[i] -= from[i] * factor;
}

bool eliminate(double* panel, std::ptrdiff_t stride, int rows, int columns, bool positive,
               double* pivots) {
  for (int k = 0; k < columns; ++k) {
    double* const column = panel + k * stride;
    const double pivot = column[k];
    pivots[k] = pivot;
    if (!(positive ? pivot > 0 : pivot != 0) || !(pivot - pivot == 0)) return false;
    const double inverse = 1 / pivot;
    for (int j = k + 1; j < columns; ++j)
      subtract(panel + j * stride + j, column + j, rows - j, column[j] * inverse);
    int i = k + 1;
    const Doubles scale = splat<double>(inverse);
    for (; i + kDoubles <= rows; i += kDoubles) store(column + i, load(column + i) * scale);
    for (; i < rows; ++i) column[i] *= inverse;
  }
  return true;
}

// x := L^-1 x for N columns, which begin on the diagonal.
template <int N>
SIM_INLINE void forward_group(const double* panel, std::ptrdiff_t stride, int rows, double* x) {
  for (int k = 0; k < N; ++k)
    for (int i = k + 1; i < N; ++i) x[i] -= panel[k * stride + i] * x[k];
  Doubles known[N];
  for (int k = 0; k < N; ++k) known[k] = splat<double>(x[k]);
  int i = N;
  for (; i + kDoubles <= rows; i += kDoubles) {
    Doubles sum = load(x + i);
    for (int k = 0; k < N; ++k) sum -= load(panel + k * stride + i) * known[k];
    store(x + i, sum);
  }
  for (; i < rows; ++i)
    for (int k = 0; k < N; ++k) x[i] -= panel[k * stride + i] * x[k];
}

// x := L^-T x for N columns, likewise.
template <int N>
SIM_INLINE void backward_group(const double* panel, std::ptrdiff_t stride, int rows, double* x) {
  EightRows sum[N] = {};
  for (int i = N; i < rows; i += kRows) {
    const EightRows known = load_registers<kRows>(x + i);
    for (int k = 0; k < N; ++k) {
      const EightRows column = load_registers<kRows>(panel + k * stride + i);
      for (int part = 0; part < EightRows::kParts; ++part)
        sum[k].part[part] += column.part[part] * known.part[part];
    }
  }
  for (int k = N - 1; k >= 0; --k) {
    double eighths[kRows];
    store(eighths, sum[k]);
    double all = ((eighths[0] + eighths[4]) + (eighths[2] + eighths[6])) +
                 ((eighths[1] + eighths[5]) + (eighths[3] + eighths[7]));
    for (int i = k + 1; i < N; ++i) all += panel[k * stride + i] * x[i];
    x[k] -= all;
  }
}

// Calls f(the number of columns, as a type) for a group of four or for the rest.
template <class F>
SIM_INLINE void with_columns(int columns, const F& f) {
  switch (columns) {
    case 1:
      return f(std::integral_constant<int, 1>());
    case 2:
      return f(std::integral_constant<int, 2>());
    case 3:
      return f(std::integral_constant<int, 3>());
    default:
      return f(std::integral_constant<int, 4>());
  }
}

void forward(const double* panel, std::ptrdiff_t stride, int rows, int columns, double* x) {
  for (int at = 0; at < columns; at += kColumns)
    with_columns(
        columns - at, [&](auto count) __attribute__((always_inline)) {
          forward_group<count>(panel + at * stride + at, stride, rows - at, x + at);
        });
}

void backward(const double* panel, std::ptrdiff_t stride, int rows, int columns, double* x) {
  for (int at = (columns - 1) / kColumns * kColumns; at >= 0; at -= kColumns)
    with_columns(
        columns - at, [&](auto count) __attribute__((always_inline)) {
          backward_group<count>(panel + at * stride + at, stride, rows - at, x + at);
        });
}

constexpr PanelKernels kPanels{multiply, eliminate, forward, backward};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

PanelKernels panel_kernels() { return SIM_CHOOSE(kPanels); }

}  // namespace sim
#endif
