// Pairs of eight particles side by side, each with its next neighbours.
#pragma once

#include "core/expression/formulas.h"
#include "core/particles/neighbours/neighbours.h"

namespace sim {

// Entry k of the particle in lane l is number 8 k + l.
struct PairRows {
  static constexpr int kMost = Program::kBlock;

  alignas(64) double d[3][kMost];                     // m
  alignas(64) double measure[kMost], inverse[kMost];  // r or r^2, and 1 over it
};

struct PairRowKernels {
  // Measures entries [first, first + count) of the lists of block b: d = x_i - x_j, r = |d|. An
  // entry that only fills up a list is as far away as the cutoff.
  void (*measure)(const NeighbourBlock& block, int b, const double* points, int first, int count,
                  double cutoff, PairRows& rows);
  // Adds the forces of the pairs with r < cutoff, -slope d/r where r is measured and -slope d where
  // r^2 is, by the slopes of `count` rows. Where r = 0 there is no direction, and no force if the
  // slope is finite.
  void (*add)(const PairRows& rows, const double* slopes, int count, double cutoff,
              double (&sums)[3][8]);
  // Adds half the energies U of the pairs with r < cutoff.
  void (*add_energies)(const PairRows& rows, const double* energies, int count, double cutoff,
                       double (&sums)[8]);
};
PairRowKernels pair_row_kernels(bool of_square);  // for this machine

}  // namespace sim
