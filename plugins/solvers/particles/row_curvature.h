// Second derivatives of the equations of constraints.
#pragma once

#include <span>
#include <vector>

#include "core/math/mat3.h"
#include "core/particles/constraints/row_values.h"

namespace sim {

// d2 phi / dx_a dx_b of each row and of each pair a <= b of its particles, in 1/m: from the
// constraint, or by central differences of its gradients if it gives none.
class RowCurvature {
 public:
  RowCurvature(const RowList& list, int particles);

  // memory: of all constraints.
  void evaluate(const ParticleView& view, const double* memory);

  // Blocks in the order of rows and of pairs in them, as RowList::write_curvature has it.
  std::span<const Mat3> blocks() const { return blocks_; }

 private:
  struct Part {  // of a constraint that gives none, maybe
    std::size_t part, first_pair, pairs;
    int rows = 0;
    std::vector<std::vector<int>> groups;  // of its particles, no two of which share a row; if used
  };

  void make_groups(Part& part) const;
  void add_differences(const Part& part, const ParticleView& view, const double* memory);

  const RowList* list_;
  std::vector<Part> parts_;
  std::vector<double> multiples_;  // of the unit matrix
  std::vector<Mat3> blocks_;
  std::vector<double> moved_;  // positions, axis by axis
  std::vector<double> numbers_;
  std::vector<Vec3> gradient_[2];
};

}  // namespace sim
