// Formulas of the cells of a lattice as instructions on its rows.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "core/expression/program.h"
#include "core/expression/vector_code.h"
#include "lattice.h"

namespace sim {

// The neighbours that formulas read: inputs behind the names of the cell and t.
struct LatticeNeighbours {
  std::vector<int> names;
  std::vector<Lattice::Index> offsets;
};

// The arrays of the code: first the rows around that formulas read, among them that of the cell,
// then those of the caller.
class LatticeProgram {
 public:
  using Operand = VectorCode::Operand;

  LatticeProgram(const Lattice& lattice, const LatticeNeighbours& neighbours);

  int add_operand(const Operand& slot);
  int add_register() { return add_operand({}); }
  int add_uniform(double number) { return add_operand({Operand::Kind::kUniform, 0, 0, number}); }
  // A number of the cell, the `name`-th of a row of the caller.
  int add_own(int array, int name);

  // Slots of the names of the cell, and of t.
  int point(int name) const { return points_[static_cast<std::size_t>(name)]; }
  int time() const { return time_; }

  void add(Op op, int to, std::array<int, 3> operand);
  // The outputs of the code, one a slot.
  void add_code(const Code& code, std::span<const int> outputs);

  // The arrays of rows: the offsets of their slabs and rows.
  std::span<const std::pair<int, int>> rows() const { return rows_; }
  int own(int number) const { return static_cast<int>(rows_.size()) + number; }

  VectorCode take() { return VectorCode(std::move(instructions_), std::move(slots_)); }

 private:
  int add_point(int name, const Lattice::Index& offset);

  std::ptrdiff_t pitch_;
  std::vector<std::pair<int, int>> rows_;
  std::vector<Operand> slots_;
  std::vector<int> points_, neighbours_;  // slots
  int time_;
  std::vector<Instruction> instructions_;
};

// Formulas evaluated in all cells, row by row.
class LatticeEvaluation {
 public:
  LatticeEvaluation() = default;
  LatticeEvaluation(const Lattice& lattice, const LatticeNeighbours& neighbours, const Code& code);

  // Calls visit(slab, row, results) for each row of x: the numbers of formula i begin i pitches
  // behind the results.
  template <class Visit>
  void run(const Lattice& lattice, double t, LatticeRows& x, const Visit& visit) {
    code_.set_uniform(time_, t);
    for (int slab = 0; slab < lattice.slabs(); ++slab)
      for (int row = 0; row < lattice.rows(); ++row) {
        double** array = arrays_.data();
        for (const auto& [slabs, rows] : rows_) *array++ = x.row(slab + slabs, row + rows);
        *array = results_.data();
        code_.run(arrays_.data(), lattice.length());
        visit(slab, row, results_.data());
      }
  }

 private:
  VectorCode code_;
  int time_ = 0;
  std::vector<std::pair<int, int>> rows_;
  std::vector<double*> arrays_;
  Array results_;
};

}  // namespace sim
