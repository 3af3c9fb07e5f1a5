// Sums that compilers make vectors of, in one order everywhere.
#pragma once

namespace sim {

inline double sum_of(const double (&lanes)[8]) {
  double sum = 0;
  for (const double lane : lanes) sum += lane;
  return sum;
}

// The sum of term(i) over begin <= i < end, in eight lanes that are added at the end. Terms without
// a branch are evaluated side by side.
template <class Index, class Term>
double sum_in_lanes(Index begin, Index end, Term term) {
  double lanes[8] = {};
  Index i = begin;
  for (; i + 8 <= end; i += 8)
    for (Index lane = 0; lane < 8; ++lane) lanes[lane] += term(i + lane);
  for (Index lane = 0; i + lane < end; ++lane) lanes[lane] += term(i + lane);
  return sum_of(lanes);
}

}  // namespace sim
