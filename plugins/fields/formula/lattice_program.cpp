#include "lattice_program.h"

#include <algorithm>

namespace sim {

LatticeProgram::LatticeProgram(const Lattice& lattice, const LatticeNeighbours& neighbours)
    : pitch_(lattice.pitch()) {
  for (int name = 0; name < lattice.names(); ++name) points_.push_back(add_point(name, {}));
  time_ = add_uniform(0);
  for (std::size_t i = 0; i < neighbours.names.size(); ++i)
    neighbours_.push_back(add_point(neighbours.names[i], neighbours.offsets[i]));
}

int LatticeProgram::add_operand(const Operand& slot) {
  slots_.push_back(slot);
  return static_cast<int>(slots_.size()) - 1;
}

int LatticeProgram::add_own(int array, int name) {
  return add_operand({Operand::Kind::kArray, array, name * pitch_, 0});
}

int LatticeProgram::add_point(int name, const Lattice::Index& offset) {
  const std::pair row(offset[0], offset[1]);
  const auto at = std::ranges::find(rows_, row) - rows_.begin();
  if (at == static_cast<std::ptrdiff_t>(rows_.size())) rows_.push_back(row);
  return add_operand({Operand::Kind::kArray, static_cast<int>(at), name * pitch_ + offset[2], 0});
}

void LatticeProgram::add(Op op, int to, std::array<int, 3> operand) {
  Instruction now{op, static_cast<std::uint16_t>(to), {}};
  for (int i = 0; i < operand_count(op); ++i)
    now.operand[i] = static_cast<std::uint16_t>(operand[static_cast<std::size_t>(i)]);
  instructions_.push_back(now);
}

void LatticeProgram::add_code(const Code& code, std::span<const int> outputs) {
  std::vector<int> slots = points_;
  slots.push_back(time_);
  slots.insert(slots.end(), neighbours_.begin(), neighbours_.end());
  slots.insert(slots.end(), outputs.begin(), outputs.end());
  for (const double constant : code.constants) slots.push_back(add_uniform(constant));
  for (int i = 0; i < code.registers; ++i) slots.push_back(add_register());
  for (const Instruction& now : code.instructions) {
    std::array<int, 3> operand{};
    for (int i = 0; i < operand_count(now.op); ++i)
      operand[static_cast<std::size_t>(i)] = slots[now.operand[i]];
    add(now.op, slots[now.to], operand);
  }
}

LatticeEvaluation::LatticeEvaluation(const Lattice& lattice, const LatticeNeighbours& neighbours,
                                     const Code& code)
    : results_(static_cast<std::size_t>(code.outputs * lattice.pitch())) {
  LatticeProgram program(lattice, neighbours);
  std::vector<int> outputs;
  for (int i = 0; i < code.outputs; ++i) outputs.push_back(program.add_own(program.own(0), i));
  program.add_code(code, outputs);
  time_ = program.time();
  rows_.assign(program.rows().begin(), program.rows().end());
  arrays_.resize(rows_.size() + 1);
  code_ = program.take();
}

}  // namespace sim
