#include "core/ode/implicit/krylov_solver.h"

#include <algorithm>
#include <cmath>

#include "core/base/slot.h"

namespace sim {
namespace {

constexpr int kBasis = 80;            // vectors before it begins anew
constexpr int kMostBegins = 12;       // of those
constexpr double kSolved = 1e-10;     // of the right side
constexpr double kEnough = 1e-3;      // with which Newton's method still ends
constexpr double kInvariant = 1e-14;  // of a product: the basis has all of it

// Summed in order: the same bits on every machine.
double product(const Array& a, const Array& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

void add(double share, const Array& of, Array& to) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += share * of[i];
}

}  // namespace

KrylovSolver::KrylovSolver(OdeSystem& system, const StageOptions& options)
    : StageNewton(system, options),
      h_(slot(kBasis * (kBasis + 1))),
      cosine_(slot(kBasis)),
      sine_(slot(kBasis)),
      rest_(slot(kBasis + 1)),
      found_(size()),
      right_(size()) {
  for (int i = 0; i <= kBasis; ++i) basis_.emplace_back(size());
}

void KrylovSolver::linearise(double t, double tau, const double* y) {
  jacobian().at(t, y);
  tau_ = tau;
}

// Arnoldi step by modified Gram-Schmidt, with Givens rotations.
double KrylovSolver::extend(int k) {
  Array &from = basis_[slot(k)], &next = basis_[slot(k + 1)];
  jacobian().apply(from.data(), next.data());
  ++effort_.linear;
  for (std::size_t i = 0; i < next.size(); ++i) next[i] = from[i] - tau_ * next[i];
  const double before = std::sqrt(product(next, next));
  double* const column = h_.data() + slot(k) * slot(kBasis + 1);
  for (int i = 0; i <= k; ++i) {
    column[i] = product(basis_[slot(i)], next);
    add(-column[i], basis_[slot(i)], next);
  }
  double length = std::sqrt(product(next, next));
  if (!(length > kInvariant * before)) length = 0;
  for (int i = 0; i < k; ++i) {
    const double a = column[i], b = column[i + 1];
    column[i] = cosine_[slot(i)] * a + sine_[slot(i)] * b;
    column[i + 1] = cosine_[slot(i)] * b - sine_[slot(i)] * a;
  }
  const double size = std::sqrt(column[k] * column[k] + length * length);
  cosine_[slot(k)] = size > 0 ? column[k] / size : 1;
  sine_[slot(k)] = size > 0 ? length / size : 0;
  column[k] = size;
  rest_[slot(k + 1)] = -sine_[slot(k)] * rest_[slot(k)];
  rest_[slot(k)] *= cosine_[slot(k)];
  if (length > 0)
    for (std::size_t i = 0; i < next.size(); ++i) next[i] /= length;
  return std::fabs(rest_[slot(k + 1)]);
}

void KrylovSolver::add_to(Array& found, int count) {
  for (int k = count - 1; k >= 0; --k) {
    double sum = rest_[slot(k)];
    for (int j = k + 1; j < count; ++j)
      sum -= h_[slot(j) * slot(kBasis + 1) + slot(k)] * rest_[slot(j)];
    const double diagonal = h_[slot(k) * slot(kBasis + 1) + slot(k)];
    rest_[slot(k)] = diagonal != 0 ? sum / diagonal : 0;
  }
  for (int k = 0; k < count; ++k) add(rest_[slot(k)], basis_[slot(k)], found);
}

bool KrylovSolver::divide(Array& x) {
  std::ranges::copy(x.span(), right_.data());
  std::ranges::fill(found_.span(), 0.0);
  const double size = std::sqrt(product(right_, right_));
  if (!(size > 0)) return std::isfinite(size);
  double left = size;
  for (int begin = 0; begin < kMostBegins && left > kSolved * size; ++begin) {
    Array& first = basis_[0];
    if (begin > 0) {
      jacobian().apply(found_.data(), first.data());
      for (std::size_t i = 0; i < first.size(); ++i)
        first[i] = right_[i] - (found_[i] - tau_ * first[i]);
      left = std::sqrt(product(first, first));
    } else {
      std::ranges::copy(right_.span(), first.data());
    }
    if (!std::isfinite(left) || !(left > kSolved * size)) break;
    for (std::size_t i = 0; i < first.size(); ++i) first[i] /= left;
    rest_[0] = left;
    int count = 0;
    while (count < kBasis && left > 0.5 * kSolved * size) left = extend(count++);
    add_to(found_, count);
  }
  std::ranges::copy(found_.span(), x.data());
  return left <= kEnough * size;
}

}  // namespace sim
