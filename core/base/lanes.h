// Sums that compilers make vectors of, in one order everywhere.
#pragma once

namespace sim {

// The sum of term(i) over begin <= i < end, in eight lanes that are added at the end. Terms without
// a branch are evaluated side by side.
template <class Term>
double sum_in_lanes(int begin, int end, Term term) {
  double lanes[8] = {};
  int i = begin;
  for (; i + 8 <= end; i += 8)
    for (int lane = 0; lane < 8; ++lane) lanes[lane] += term(i + lane);
  for (int lane = 0; i + lane < end; ++lane) lanes[lane] += term(i + lane);
  double sum = 0;
  for (const double lane : lanes) sum += lane;
  return sum;
}

}  // namespace sim
