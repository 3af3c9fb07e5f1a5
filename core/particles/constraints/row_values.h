// All equations of a system side by side, and their values at one state.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/thread_pool.h"
#include "core/particles/constraint.h"

namespace sim {

// The equations of all active constraints, in their order: the part that does not change.
struct RowList {
  struct Part {
    const Constraint* constraint;
    int row = 0, entry = 0;  // its first
    std::size_t memory = 0, internal_size = 0;
  };
  std::vector<Part> parts;
  RowPattern pattern;
  std::vector<int> cuts;                 // of the pattern
  std::vector<std::uint8_t> orthogonal;  // rows of constraints that are

  int rows() const { return pattern.rows(); }
  const Part& part_of(int row) const;
  int end_of(std::size_t part) const;   // the row behind its last
  std::size_t pairs_of(int row) const;  // a <= b of its particles
  std::string name(int row) const;      // of the equation
  // curvature() of all constraints, one after the other: of the pairs of each row.
  std::size_t pairs() const;
  void write_curvature(ParticleView view, const double* memory, std::span<double> pairs) const;
};

// phi, J = d phi / d x, d phi / d t and the bias of all rows at one state.
class RowValues {
 public:
  explicit RowValues(const RowList& list);
  // Threads share the products of J, with the same bits; null: the caller alone.
  void share(ThreadPool* pool) { pool_ = pool; }

  // memory: of all constraints. False if a number is not finite. The rows are as many as the list
  // has now, never more than at first.
  bool evaluate(ParticleView view, const double* memory);

  std::span<const double> phi() const { return phi_; }
  std::span<const double> drive() const { return drive_; }
  std::span<const double> bias() const { return bias_; }
  std::span<const Vec3> gradient() const { return gradient_; }
  double largest_phi() const;
  // The power of the rows, W, that move or hold particles that are led; the work, J, if these are
  // impulses. view: at the state of the rows.
  double driving_power(std::span<const double> multipliers, const ParticleView& view) const;

  // out := J v
  void times(const double* const v[3], double* out) const;
  // v += W J^T lambda
  void add_transposed(const double* lambda, const double* weights, double* const v[3]) const;

 private:
  void resize();
  // Calls body(begin, end) for parts of n items, on the threads if there are many rows.
  template <class Body>
  void for_parts(int n, const Body& body) const;

  const RowList* list_;
  ThreadPool* pool_ = nullptr;
  std::vector<double> phi_, drive_, bias_;
  std::vector<Vec3> gradient_;
};

}  // namespace sim
