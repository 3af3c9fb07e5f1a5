// Rows that are linear in what is looked for, as they are in velocities and accelerations.
#pragma once

#include <span>

#include "core/particles/constraints/pushes.h"
#include "core/particles/constraints/row_values.h"

namespace sim {

// J y + rest = 0. What is given outlives it.
struct LinearRows : PushSolver::Wanted {
  LinearRows(const RowValues& of, const PushSolver::Axes& of_all, std::span<const double> rest)
      : values(of), all(of_all), constant(rest) {}

  bool rows(std::span<double> rest) override {
    values.times(all.data(), rest.data());
    for (std::size_t r = 0; r < rest.size(); ++r) rest[r] += constant[r];
    return true;
  }

  const RowValues& values;
  const PushSolver::Axes& all;
  std::span<const double> constant;
};

}  // namespace sim
