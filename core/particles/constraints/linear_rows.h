// Constraint rows that are linear in the unknowns, as they are in velocities and accelerations.
#pragma once

#include <span>

#include "core/particles/constraints/active_set_contact_solver.h"
#include "core/particles/constraints/row_values.h"

namespace sim {

// J y + rest = 0. The arguments outlive it.
struct LinearRows : ActiveSetContactSolver::Problem {
  LinearRows(const RowValues& of, const ActiveSetContactSolver::Axes& of_all,
             std::span<const double> rest)
      : values(of), all(of_all), constant(rest) {}

  bool rows(std::span<double> rest) override {
    values.times(all.data(), rest.data());
    for (std::size_t r = 0; r < rest.size(); ++r) rest[r] += constant[r];
    return true;
  }

  const RowValues& values;
  const ActiveSetContactSolver::Axes& all;
  std::span<const double> constant;
};

}  // namespace sim
