// Vectors of three coordinates a node and symmetric 3 x 3 blocks, eight nodes at a time.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/array.h"

namespace sim {

struct BlockKernels {
  // inverses := the inverses of symmetric blocks (xx xy xz yy yz zz), 0 where not free. A block
  // that is not positive definite counts as |trace| I.
  void (*invert)(const double* const blocks[6], const std::uint8_t* free, double* const inverses[6],
                 int begin, int end);
  // z := inverses r, sums += the lanes of r.z.
  void (*multiply)(const double* const inverses[6], const double* const r[3], double* const z[3],
                   int begin, int end, double (&sums)[8]);
  // d += alpha p, r -= alpha a, z := inverses r, sums += the lanes of r.z.
  void (*advance)(double alpha, const double* const p[3], const double* const a[3],
                  double* const d[3], double* const r[3], const double* const inverses[6],
                  double* const z[3], int begin, int end, double (&sums)[8]);
  // sums += the lanes of a.b;  p := z + beta p.
  void (*dot)(const double* a, const double* b, std::size_t size, double (&sums)[8]);
  void (*turn)(double beta, const double* const z[3], double* const p[3], int begin, int end);
};

BlockKernels block_kernels();  // for this machine

// a.b, summed in eight lanes: the same bits on any machine.
double dot(const Array& a, const Array& b);

// to += factor a
void add_scaled(Array& to, double factor, const Array& a);

}  // namespace sim
