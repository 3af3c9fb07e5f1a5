#include "lattice_stepper.h"

#include <algorithm>
#include <utility>

#include "core/base/finite.h"

namespace sim {
namespace {

constexpr int kSmall = 1 << 14;        // numbers of all stages that are kept whole
constexpr int kCellsAtOnce = 1 << 20;  // evaluations of cells: some milliseconds

// Arrays behind the rows of the point: x, the next state so far, slopes that are kept, the result.
enum Own { kX, kSum, kSlopes, kOut, kOwn };

}  // namespace

bool LatticeStepper::fits(const Code& code, const ExplicitPlan& plan) {
  const int own = code.outputs * (plan.stages + 5) + 2 * plan.stages;
  return code.slots() + own <= VectorCode::kMostOperands &&
         code.registers + 2 * code.outputs <= VectorCode::kMostRegisters;
}

LatticeStepper::LatticeStepper(const Lattice& lattice, const LatticeNeighbours& neighbours,
                               const Code& code, const ExplicitPlan& plan)
    : lattice_(lattice), neighbours_(neighbours), plan_(plan) {
  const int slabs = lattice.slabs(), reach = lattice.reach()[0], last = plan.stages - 1;
  const double numbers = static_cast<double>(lattice.cells()) * lattice.names() * (plan.stages + 3);
  const bool periodic = lattice.edge() == LatticeEdge::Kind::kPeriodic;
  // A periodic lattice has no slab to begin with: stages begin beyond the end, with slabs that are
  // computed again at the other end.
  const bool whole =
      numbers < kSmall || slabs <= 2 * reach || (periodic && slabs < 4 * last * reach);
  lag_ = whole ? slabs : reach;
  extra_ = periodic && !whole ? reach : 0;

  for (int i = 0; i < plan.stages; ++i) stages_.push_back(stage(code, i));
  const int margin = (plan.stages + 1) * reach, names = lattice.names();
  x_ = LatticeRows(lattice, names, slabs, margin);
  next_ = LatticeRows(lattice, names, slabs, margin);
  for (int i = 0; i < last; ++i)
    points_.emplace_back(lattice, names, whole ? slabs : 2 * reach + 1, margin);
  int kept_slopes = 1;
  for (int i = 0; i < plan.stages; ++i)
    if (is_kept(i)) kept_slopes = i + 1;
  beyond_ = LatticeRows(lattice, names, 1, margin);
  slopes_ = LatticeRows(lattice, names * kept_slopes, whole ? slabs : last * reach + 1, margin);
  const double work = static_cast<double>(lattice.cells()) * plan.stages;
  at_once_ = code.reads[static_cast<std::size_t>(lattice.names())]  // t is another in each step
                 ? 1
                 : std::clamp(static_cast<int>(kCellsAtOnce / work), 1, 256);
}

bool LatticeStepper::is_kept(int stage) const {
  for (int i = stage + 2; i < plan_.stages; ++i)
    if (plan_.a_at(i, stage) != 0) return true;
  return false;
}

LatticeStepper::Stage LatticeStepper::stage(const Code& code, int number) {
  LatticeProgram program(lattice_, neighbours_);
  rows_.assign(program.rows().begin(), program.rows().end());
  arrays_.resize(rows_.size() + kOwn);
  Stage made;
  made.time = program.time();
  const int names = lattice_.names(), last = plan_.stages - 1;
  const auto weight = [&](double value) {
    made.weights.push_back({program.add_uniform(0), value});
    return made.weights.back().slot;
  };

  std::vector<std::vector<int>> slopes(static_cast<std::size_t>(number) + 1);
  for (int j = 0; j <= number; ++j)
    for (int name = 0; name < names; ++name)
      slopes[static_cast<std::size_t>(j)].push_back(
          is_kept(j) ? program.add_own(program.own(kSlopes), j * names + name)
                     : program.add_register());
  program.add_code(code, slopes.back());

  std::vector<int> x, sum, out, part;
  for (int name = 0; name < names; ++name) {
    // The point of the first stage is x.
    x.push_back(number == 0 ? program.point(name) : program.add_own(program.own(kX), name));
    out.push_back(program.add_own(program.own(kOut), name));
    // The next state grows where it will be.
    sum.push_back(number == last ? out.back() : program.add_own(program.own(kSum), name));
    part.push_back(program.add_register());
  }

  // to := from + h weight k
  const auto add = [&](const std::vector<int>& to, double value, int slope,
                       const std::vector<int>& from) {
    const int factor = weight(value);
    for (std::size_t name = 0; name < to.size(); ++name)
      program.add(Op::kProductPlus, to[name],
                  {factor, slopes[static_cast<std::size_t>(slope)][name], from[name]});
  };
  const auto copy = [&](const std::vector<int>& from) {
    for (std::size_t name = 0; name < out.size(); ++name)
      program.add(Op::kCopy, out[name], {from[name], 0, 0});
  };

  // The next state grows by a slope a stage.
  const auto begin = plan_.b.begin();
  const bool begun = std::any_of(begin, begin + number, [](double b) { return b != 0; });
  const std::vector<int>& so_far = begun ? sum : x;
  if (const double b = plan_.b[static_cast<std::size_t>(number)]; b != 0)
    add(sum, b, number, so_far);
  else if (number == last && !begun)
    copy(x);

  // The point of the next stage.
  if (number < last) {
    int end = number;
    while (end >= 0 && plan_.a_at(number + 1, end) == 0) --end;
    const std::vector<int>* from = &x;
    for (int j = 0; j <= end; ++j) {
      if (plan_.a_at(number + 1, j) == 0) continue;
      const std::vector<int>& to = j == end ? out : part;
      add(to, plan_.a_at(number + 1, j), j, *from);
      from = &to;
    }
    if (end < 0) copy(x);
  }
  made.code = program.take();
  return made;
}

void LatticeStepper::set_step(double h) {
  if (h == h_) return;
  h_ = h;
  for (Stage& stage : stages_)
    for (const Weight& weight : stage.weights)
      stage.code.set_uniform(weight.slot, h * weight.weight);
}

void LatticeStepper::run_slab(int stage, int slab) {
  const auto number = static_cast<std::size_t>(stage);
  LatticeRows& point = stage == 0 ? x_ : points_[number - 1];
  LatticeRows& out = stage == plan_.stages - 1 ? next_ : points_[number];
  for (int row = 0; row < lattice_.rows(); ++row) {
    double** array = arrays_.data();
    for (const auto& [slabs, rows] : rows_) *array++ = point.row(slab + slabs, row + rows);
    array[kX] = x_.row(slab, row);
    const bool inside = slab >= 0 && slab < lattice_.slabs();
    array[kSum] = inside ? next_.row(slab, row) : beyond_.row(0, row);
    array[kSlopes] = slopes_.row(slab, row);
    array[kOut] = out.row(slab, row);
    stages_[number].code.run(arrays_.data(), lattice_.length());
    lattice_.fill_ghosts(array[kOut]);
  }
}

void LatticeStepper::sweep() {
  const int slabs = lattice_.slabs(), last = plan_.stages - 1, first = -last * extra_;
  for (int front = first; front < slabs - first + last * lag_; ++front)
    for (int stage = 0; stage <= last; ++stage) {
      const int slab = front - stage * lag_, beyond = (last - stage) * extra_;
      if (slab >= -beyond && slab < slabs + beyond) run_slab(stage, slab);
    }
}

bool LatticeStepper::step(double t, double h, int count, const double* x, double* x_next) {
  set_step(h);
  for (std::size_t i = 0; i < stages_.size(); ++i)
    stages_[i].code.set_uniform(stages_[i].time, t + plan_.c[i] * h);
  x_.load(lattice_, x);
  for (int i = 0; i < count; ++i) {
    sweep();
    std::swap(x_, next_);
  }
  x_.store(lattice_, x_next);
  return all_finite({x_next, static_cast<std::size_t>(lattice_.cells() * lattice_.names())});
}

}  // namespace sim
