#include "block_lu_kernels.h"

#undef SIM_THIS_FILE
#define SIM_THIS_FILE "block_lu_kernel.cpp"
#include "core/simd/foreach_target.h"

SIM_TARGET_BEGIN
namespace sim::SIM_TARGET {
namespace {

constexpr int kSize = static_cast<int>(kBlockSize), kStride = static_cast<int>(kBlockStride);

using Column = Registers<kSize>;

// y -= a x.
SIM_INLINE void subtract_scaled(Column& y, const Column& a, double x) {
  const Doubles factor = splat<double>(x);
  for (int p = 0; p < Column::kParts; ++p) y.part[p] -= a.part[p] * factor;
}

struct Columns {
  Column column[kSize];
};

SIM_INLINE Columns load_columns(const LuBlock& block) {
  Columns a;
  for (int k = 0; k < kSize; ++k) a.column[k] = load_registers<kSize>(block.numbers + kStride * k);
  return a;
}

// y -= A x.
SIM_INLINE void subtract_product(const Columns& a, const double* x, double* y) {
  Column sum = load_registers<kSize>(y);
  for (int k = 0; k < kSize; ++k) subtract_scaled(sum, a.column[k], x[k]);
  store(y, sum);
}

// C -= A B.
SIM_INLINE void subtract_product(const Columns& a, const LuBlock& b, LuBlock& c) {
  for (int at = 0; at < kSize * kStride; at += kStride)
    subtract_product(a, b.numbers + at, c.numbers + at);
}

// A := A^-1 by Gauss and Jordan's elimination with pivots of rows.
bool invert(LuBlock& a) {
  LuBlock inverse{};
  for (int k = 0; k < kSize; ++k) inverse.numbers[(kStride + 1) * k] = 1;
  for (int k = 0; k < kSize; ++k) {
    double factors[kStride] = {};  // of the rows that are left
    int pivot = k;
    for (int i = 0; i < kSize; ++i) {
      factors[i] = a.numbers[kStride * k + i];
      if (i > k && std::fabs(factors[i]) > std::fabs(factors[pivot])) pivot = i;
    }
    const double inverse_pivot = 1 / factors[pivot];
    if (!std::isfinite(inverse_pivot)) return false;
    factors[pivot] = factors[k], factors[k] = 0;
    for (double* const numbers : {a.numbers, inverse.numbers})
      for (int j = 0; j < kSize; ++j) {
        double* const column = numbers + kStride * j;
        const double scaled = inverse_pivot * column[pivot];
        column[pivot] = column[k], column[k] = scaled;
        Column rest = load_registers<kSize>(column);
        subtract_scaled(rest, load_registers<kSize>(factors), scaled);
        store(column, rest);
      }
  }
  a = inverse;
  return true;
}

// Column by column: L_ik = A_ik A_kk^-1, A_ij -= L_ik A_kj.
bool factorise(const LuBlocks& a) {
  const std::size_t* target = a.targets;
  for (std::size_t k = 0; k < a.nodes; ++k) {
    if (!invert(a.blocks[k])) return false;
    for (std::size_t p = a.begin[k]; p < a.begin[k + 1]; ++p) {
      LuBlock& below = a.blocks[a.lower(p)];
      LuBlock product{};
      subtract_product(load_columns(below), a.blocks[k], product);
      for (int at = 0; at < kSize * kStride; ++at) below.numbers[at] = -product.numbers[at];
      const Columns left = load_columns(below);
      for (std::size_t q = a.begin[k]; q < a.begin[k + 1]; ++q)
        subtract_product(left, a.blocks[a.upper(q)], a.blocks[*target++]);
    }
  }
  return true;
}

void solve(const LuBlocks& factors, double* x) {
  for (std::size_t k = 0; k < factors.nodes; ++k)
    for (std::size_t p = factors.begin[k]; p < factors.begin[k + 1]; ++p)
      subtract_product(load_columns(factors.blocks[factors.lower(p)]), x + kBlockStride * k,
                       x + kBlockStride * factors.rows[p]);
  for (std::size_t k = factors.nodes; k-- > 0;) {
    double* const at = x + kBlockStride * k;
    for (std::size_t p = factors.begin[k]; p < factors.begin[k + 1]; ++p)
      subtract_product(load_columns(factors.blocks[factors.upper(p)]),
                       x + kBlockStride * factors.rows[p], at);
    double sum[kStride] = {};
    subtract_product(load_columns(factors.blocks[k]), at, sum);
    for (int j = 0; j < kStride; ++j) at[j] = -sum[j];
  }
}

void add_product(const double (&rows)[3][kBlockStride], const double (&products)[3][kBlockStride],
                 LuBlock& block) {
  const Column n = load_registers<kSize>(rows[0]), u = load_registers<kSize>(rows[1]),
               v = load_registers<kSize>(rows[2]);
  for (int j = 0; j < kSize; ++j) {
    double* const column = block.numbers + kStride * j;
    const Doubles along_n = splat<double>(products[0][j]), along_u = splat<double>(products[1][j]),
                  along_v = splat<double>(products[2][j]);
    for (int p = 0; p < Column::kParts; ++p)
      store(column + p * kDoubles,
            ((load(column + p * kDoubles) + n.part[p] * along_n) + u.part[p] * along_u) +
                v.part[p] * along_v);
  }
}

constexpr BlockLuKernels kBlockLu{factorise, solve, add_product};

}  // namespace
}  // namespace sim::SIM_TARGET
SIM_TARGET_END

#if SIM_ONCE
namespace sim {

BlockLuKernels block_lu_kernels() { return SIM_CHOOSE(kBlockLu); }

}  // namespace sim
#endif
