#include "core/linear/row_matrix.h"

#include <algorithm>
#include <cmath>

#include "core/base/assert.h"
#include "core/base/slot.h"
#include "core/linear/supernodal.h"

namespace sim {
namespace {

constexpr double kShift = 1e-9;        // of the diagonal, where rows depend on others
constexpr double kLeastPivot = 1e-11;  // of the diagonal, of rows that do not

}  // namespace

struct RowMatrix::Component : RowStructure::Component {
  bool diagonal = false, shifted = false;
  std::unique_ptr<SupernodalFactors> panels;  // null: lists
  int dependent = 0, first_dependent = -1;
};

RowMatrix::RowMatrix(const RowPattern& pattern, std::span<const double> weights,
                     std::span<const std::uint8_t> orthogonal)
    : RowMatrix(std::make_shared<const RowStructure>(pattern, weights, orthogonal)) {}

RowMatrix::RowMatrix(std::shared_ptr<const RowStructure> structure)
    : structure_(std::move(structure)) {
  for (const RowStructure::Component& each : structure_->components) {
    components_.push_back({each});
    if (each.in_panels)
      components_.back().panels = std::make_unique<SupernodalFactors>(structure_->entries_of(each));
  }
  entries_.resize(structure_->entry_row.size());
  values_.resize(structure_->rows.size());
  const auto n = static_cast<std::size_t>(structure_->size);
  for (std::vector<double>* each : {&inverse_, &work_, &x_, &rest_, &found_}) each->assign(n, 0);
  empty_.assign(n, 0);
}

RowMatrix::RowMatrix(RowMatrix&&) noexcept = default;
RowMatrix& RowMatrix::operator=(RowMatrix&&) noexcept = default;
RowMatrix::~RowMatrix() = default;

std::size_t RowMatrix::fill() const { return structure_->fill; }

// Threads take components in their order, so that each has about as much work.
template <class Body>
void RowMatrix::for_each(const Body& body) {
  constexpr std::size_t kWorthThreads = 10'000;  // numbers of L
  if (!pool_ || components_.size() < 2 || structure_->fill < kWorthThreads) {
    for (Component& each : components_) body(each);
    return;
  }
  pool_->run([&](int rank) {
    const auto ranks = static_cast<std::size_t>(pool_->size());
    for (Component& each : components_)
      if ((each.work - 1) * ranks / components_.back().work == static_cast<std::size_t>(rank))
        body(each);
  });
}

int RowMatrix::dependent() const {
  int sum = 0;
  for (const Component& each : components_) sum += each.dependent;
  return sum;
}

int RowMatrix::first_dependent() const {
  for (const Component& each : components_)
    if (each.dependent > 0) return each.first_dependent;
  return -1;
}

void RowMatrix::factorise(std::span<const Vec3> gradient, std::span<const double> weights,
                          double shift) {
  SIM_ASSERT(structure_->product_begin.size() == entries_.size() + 1 && shift >= 0);
  for_each([&](Component& of) { factorise(of, gradient, weights, shift); });
}

void RowMatrix::factorise_obeyed(std::span<const Vec3> gradient, std::span<const double> weights) {
  for_each([&](Component& of) {
    if (!of.orthogonal || !fill_diagonal(of, gradient, weights)) {
      factorise(of, gradient, weights, 0);
      return;
    }
    of.diagonal = true;
    of.dependent = 0;
    of.first_dependent = -1;
  });
}

void RowMatrix::factorise(Component& of, std::span<const Vec3> gradient,
                          std::span<const double> weights, double shift) {
  add_up(of, gradient, weights);
  of.diagonal = false;
  of.dependent = 0;
  of.first_dependent = -1;
  of.shifted = shift > 0 || !eliminate(of, 0);
  if (of.shifted) eliminate(of, std::max(shift, kShift));
  if (of.shifted && of.panels && shift == 0) find_dependent(of);
}

// False if weights differ, or a row has none.
bool RowMatrix::fill_diagonal(const Component& of, std::span<const Vec3> gradient,
                              std::span<const double> weights) {
  double weight = 0;
  for (int k = of.begin; k < of.end; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const auto diagonal = static_cast<std::size_t>(structure_->entry_begin[at + 1]) - 1;
    double sum = 0;
    for (int p = structure_->product_begin[diagonal]; p < structure_->product_begin[diagonal + 1];
         ++p) {
      const RowStructure::Product& product = structure_->products[static_cast<std::size_t>(p)];
      const double own = weights[static_cast<std::size_t>(product.node)];
      if (weight == 0) weight = own;
      if (own != weight) return false;
      sum += gradient[static_cast<std::size_t>(product.a)].squaredNorm();
    }
    if (!(sum > 0)) return false;
    inverse_[at] = 1 / (weight * sum);
    empty_[at] = 0;
  }
  return true;
}

// The entries of A.
void RowMatrix::add_up(const Component& of, std::span<const Vec3> gradient,
                       std::span<const double> weights) {
  const auto end =
      static_cast<std::size_t>(structure_->entry_begin[static_cast<std::size_t>(of.end)]);
  for (auto e =
           static_cast<std::size_t>(structure_->entry_begin[static_cast<std::size_t>(of.begin)]);
       e < end; ++e) {
    double sum = 0;
    for (int p = structure_->product_begin[e]; p < structure_->product_begin[e + 1]; ++p) {
      const RowStructure::Product& product = structure_->products[static_cast<std::size_t>(p)];
      sum += weights[static_cast<std::size_t>(product.node)] *
             gradient[static_cast<std::size_t>(product.a)].dot(
                 gradient[static_cast<std::size_t>(product.b)]);
    }
    entries_[e] = sum;
  }
}

// False if a pivot is so small that its row seems to depend on the rows before it.
bool RowMatrix::eliminate(Component& of, double shift) {
  return of.panels ? eliminate_panels(of, shift) : eliminate_rows(of, shift);
}

double& RowMatrix::diagonal_of(int place) {
  return entries_[slot(structure_->entry_begin[slot(place) + 1]) - 1];
}

// Rows in which nothing moves get a diagonal of 1.
bool RowMatrix::eliminate_panels(Component& of, double shift) {
  for (int k = of.begin; k < of.end; ++k) {
    double& diagonal = diagonal_of(k);
    empty_[slot(k)] = diagonal == 0;
    if (diagonal == 0) diagonal = 1;
  }
  const std::span<const double> entries = std::span<const double>(entries_).subspan(
      slot(structure_->entry_begin[slot(of.begin)]),
      slot(structure_->entry_begin[slot(of.end)] - structure_->entry_begin[slot(of.begin)]));
  bool regular = of.panels->factorise(entries, shift == 0, shift);
  for (int k = of.begin; k < of.end && regular && shift == 0; ++k)
    regular = of.panels->pivot(k - of.begin) > kLeastPivot * diagonal_of(k);
  return regular;
}

// Pivots of about the shift are those of rows that depend on others.
void RowMatrix::find_dependent(Component& of) {
  constexpr double kDependent = 100 * kShift;
  for (int k = of.begin; k < of.end; ++k) {
    if (of.panels->pivot(k - of.begin) > kDependent * diagonal_of(k)) continue;
    ++of.dependent;
    if (of.first_dependent < 0) of.first_dependent = structure_->row_at[slot(k)];
  }
}

bool RowMatrix::eliminate_rows(Component& of, double shift) {
  bool regular = true;
  for (int k = of.begin; k < of.end; ++k) {
    const auto at = static_cast<std::size_t>(k);
    for (int e = structure_->entry_begin[at]; e < structure_->entry_begin[at + 1]; ++e)
      work_[static_cast<std::size_t>(structure_->entry_row[static_cast<std::size_t>(e)])] =
          entries_[static_cast<std::size_t>(e)];
    const double diagonal = work_[at];
    double d = diagonal * (1 + shift);
    work_[at] = 0;
    for (int p = structure_->place_begin[at]; p < structure_->place_begin[at + 1]; ++p) {
      const auto [column, slot] = structure_->places[static_cast<std::size_t>(p)];
      const auto c = static_cast<std::size_t>(column);
      const double y = work_[c];
      work_[c] = 0;
      for (int q = structure_->column_begin[c]; q < slot; ++q)
        work_[static_cast<std::size_t>(structure_->rows[static_cast<std::size_t>(q)])] -=
            values_[static_cast<std::size_t>(q)] * y;
      const double l = y * inverse_[c];
      d -= l * y;
      values_[static_cast<std::size_t>(slot)] = l;
    }
    empty_[at] = !(diagonal > 0 || diagonal < 0 || diagonal != diagonal);
    if (empty_[at]) {
      d = 1;
    } else if (shift == 0 && d <= kLeastPivot * diagonal) {
      ++of.dependent;
      if (of.first_dependent < 0) of.first_dependent = structure_->row_at[at];
      regular = false;
      d = diagonal;  // the rows that follow are looked at all the same
    }
    inverse_[at] = 1 / d;
  }
  return regular;
}

// Forward and backward substitution.
void RowMatrix::substitute(const Component& of, double* x) const {
  if (of.panels) {
    of.panels->solve({x + of.begin, x + of.end});
    return;
  }
  for (int k = of.begin; k < of.end; ++k) {
    const auto at = static_cast<std::size_t>(k);
    const double y = x[k];
    for (int q = structure_->column_begin[at]; q < structure_->column_begin[at + 1]; ++q)
      x[structure_->rows[static_cast<std::size_t>(q)]] -= values_[static_cast<std::size_t>(q)] * y;
  }
  for (int k = of.end - 1; k >= of.begin; --k) {
    const auto at = static_cast<std::size_t>(k);
    double sum = x[k] * inverse_[at];
    for (int q = structure_->column_begin[at]; q < structure_->column_begin[at + 1]; ++q)
      sum -=
          values_[static_cast<std::size_t>(q)] * x[structure_->rows[static_cast<std::size_t>(q)]];
    x[k] = sum;
  }
}

// out := A x, in the elimination order.
void RowMatrix::multiply(const Component& of, const double* x, double* out) const {
  std::fill(out + of.begin, out + of.end, 0.0);
  for (int k = of.begin; k < of.end; ++k) {
    const auto at = static_cast<std::size_t>(k);
    for (int e = structure_->entry_begin[at]; e < structure_->entry_begin[at + 1]; ++e) {
      const int i = structure_->entry_row[static_cast<std::size_t>(e)];
      const double value = entries_[static_cast<std::size_t>(e)];
      out[i] += value * x[k];
      if (i != k) out[k] += value * x[i];
    }
  }
}

// Proximal steps from 0 for the right-hand side x_, to rounding.
void RowMatrix::refine(const Component& of) {
  constexpr int kMost = 4;
  constexpr double kRounding = 1e-15;
  const auto begin = static_cast<std::size_t>(of.begin), end = static_cast<std::size_t>(of.end);
  double given = 0;
  for (std::size_t k = begin; k < end; ++k) {
    rest_[k] = x_[k];
    found_[k] = 0;
    given = std::max(given, std::fabs(x_[k]));
  }
  for (int turn = 0; turn < kMost; ++turn) {
    substitute(of, rest_.data());
    for (std::size_t k = begin; k < end; ++k) found_[k] += rest_[k];
    if (turn + 1 == kMost) break;
    multiply(of, found_.data(), rest_.data());
    double left = 0;
    for (std::size_t k = begin; k < end; ++k) {
      rest_[k] = empty_[k] ? 0.0 : x_[k] - rest_[k];
      left = std::max(left, std::fabs(rest_[k]));
    }
    if (left <= kRounding * given) break;
  }
  std::copy(found_.begin() + of.begin, found_.begin() + of.end, x_.begin() + of.begin);
}

void RowMatrix::solve(double* x) {
  for_each([&](const Component& of) {
    const auto begin = static_cast<std::size_t>(of.begin), end = static_cast<std::size_t>(of.end);
    if (of.diagonal) {
      for (std::size_t k = begin; k < end; ++k) x[slot(structure_->row_at[k])] *= inverse_[k];
      return;
    }
    for (std::size_t k = begin; k < end; ++k)
      x_[k] = empty_[k] ? 0.0 : x[static_cast<std::size_t>(structure_->row_at[k])];
    if (of.shifted)
      refine(of);
    else
      substitute(of, x_.data());
    for (std::size_t k = begin; k < end; ++k)
      x[static_cast<std::size_t>(structure_->row_at[k])] = x_[k];
  });
}

}  // namespace sim
