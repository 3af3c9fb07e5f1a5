#include "core/particles/constraints/constraints.h"

#include <algorithm>
#include <cmath>

#include "core/base/assert.h"
#include "core/linear/row_structure.h"

namespace sim {

void Constraints::add(std::unique_ptr<Constraint> constraint, const std::string& name,
                      const std::string& place, double feedback, const ParticleView& initial) {
  constexpr std::size_t kLine = 8;
  constraint->bind(initial);
  if (const std::string note = constraint->note(); !note.empty())
    notes_.push_back("constraint '" + name + "': " + note);
  const auto memory = static_cast<std::size_t>(constraint->internal_size());
  rows_.parts.push_back({constraint.get(), 0, 0, memory_, memory});
  append_rows(rows_.parts.back());
  SIM_ASSERT(
      std::ranges::all_of(rows_.pattern.ids, [&](int id) { return 0 <= id && id < initial.n; }));
  memory_ += (memory + kLine - 1) / kLine * kLine;
  feedback_ = std::max(feedback_, feedback);
  parts_.push_back({std::move(constraint), name, place});
  if (parts_.size() > 1) return;
  for (int i = 0; i < initial.n; ++i)
    size_ = std::max(size_, initial.position(i).cwiseAbs().maxCoeff());
}

void Constraints::append_rows(RowList::Part& part) {
  const RowPattern own = part.constraint->pattern();
  // Rows one behind the other.
  SIM_ASSERT(std::ranges::is_sorted(own.begin) && own.begin.front() == 0);
  SIM_ASSERT(own.begin.back() == static_cast<int>(own.ids.size()));
  RowPattern& all = rows_.pattern;
  part.row = all.rows(), part.entry = all.begin.back();
  for (std::size_t r = 1; r < own.begin.size(); ++r) all.begin.push_back(part.entry + own.begin[r]);
  all.ids.insert(all.ids.end(), own.ids.begin(), own.ids.end());
  rows_.orthogonal.resize(static_cast<std::size_t>(all.rows()), part.constraint->orthogonal());
}

void Constraints::refresh() {
  rows_.pattern = {};
  rows_.orthogonal.clear();
  for (RowList::Part& part : rows_.parts) append_rows(part);
}

void Constraints::set_masses(std::span<const double> masses) {
  weights_.assign(masses.size(), 0);
  for (std::size_t i = 0; i < masses.size(); ++i)
    if (masses[i] < HUGE_VAL) weights_[i] = 1 / masses[i];
  rows_.cuts = rows_.pattern.cuts();
  structure_ = std::make_shared<const RowStructure>(rows_.pattern, weights_, rows_.orthogonal);
}

bool Constraints::move() const {
  return std::ranges::any_of(parts_, [](const Entry& each) { return each.constraint->moves(); });
}

const std::string& Constraints::title(const RowList::Part& part) const {
  return parts_[static_cast<std::size_t>(&part - rows_.parts.data())].title;
}

const std::string& Constraints::place(const RowList::Part& part) const {
  return parts_[static_cast<std::size_t>(&part - rows_.parts.data())].place;
}

void Constraints::start(double* memory) const {
  std::fill_n(memory, memory_, 0.0);
  for (const RowList::Part& part : rows_.parts)
    part.constraint->start({memory + part.memory, part.internal_size});
}

void Constraints::follow(const ParticleView& view, double* memory) const {
  for (const RowList::Part& part : rows_.parts) {
    if (part.internal_size == 0) continue;
    const std::span<double> own(memory + part.memory, part.internal_size);
    ParticleView seen = view;
    seen.internal = own;
    part.constraint->follow(seen, own);
  }
}

}  // namespace sim
