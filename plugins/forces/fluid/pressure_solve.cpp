#include "pressure_solve.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr int kMostProducts = 2000;

}  // namespace

template <class Act>
void PressureSolve::each(ThreadPool& pool, const Act& act) {
  pool.run_parts(places_, 8, [&](int begin, int end) {
    for (int i = begin; i < end; ++i) act(i);
  });
}

void PressureSolve::push(const DensityConstraints& rows, const double* p, ThreadPool& pool) {
  rows.push(p, pushes_.data(), pool);
  each(pool, [&](int i) {
    for (int axis = 0; axis < 3; ++axis) pushes_.data()[4 * i + axis] *= -inverse_.data()[i];
  });
}

void PressureSolve::multiply(const DensityConstraints& rows, const double* p, double* result,
                             ThreadPool& pool) {
  ++products_;
  push(rows, p, pool);
  rows.rate(pushes_.data(), result, pool);
  each(pool, [&](int i) { result[i] = -result[i]; });
}

std::span<double> PressureSolve::pressures(const DensityConstraints& rows) {
  if (places_ == 0) {
    places_ = rows.places();
    for (Array* const array : {&p_, &gradient_, &way_, &product_, &inverse_})
      *array = Array(static_cast<std::size_t>(places_));
    pushes_ = Array(4 * static_cast<std::size_t>(places_));
  }
  return p_.span();
}

bool PressureSolve::solve(const DensityConstraints& rows, const double* b, const double* mass,
                          double tolerance, ThreadPool& pool) {
  pressures(rows);
  double* const p = p_.data();
  double* const g = gradient_.data();
  double* const displacement = way_.data();
  double* const product = product_.data();
  double most = 0;
  for (int k = 0; k < n_; ++k) {
    const double m = mass[rows.id(k)];
    inverse_.data()[k] = m < HUGE_VAL ? 1 / m : 0;
    most = std::max(most, inverse_.data()[k]);
  }
  double largest = largest_ * most;  // eigenvalue of A; more where it is denser, as products show
  // The gradient of the free set, pressures above 0, and of those at 0 that want to rise.
  const auto free = [&](int i) { return p[i] > 0 ? g[i] : 0.0; };
  const auto chopped = [&](int i) { return p[i] > 0 ? 0.0 : std::min(g[i], 0.0); };
  multiply(rows, p, g, pool);
  each(pool, [&](int i) {
    g[i] -= i < n_ ? b[i] : 0;
    displacement[i] = 0;
  });
  const double enough = tolerance * tolerance * n_;
  bool begin = true, met = false;
  for (const long first = products_; products_ < first + kMostProducts && !pool.gives_up(0);) {
    const double frees = sum_(rows, pool, [&](int i) { return free(i) * free(i); });
    const double wanted = sum_(rows, pool, [&](int i) { return chopped(i) * chopped(i); });
    met = !(frees + wanted > enough);
    if (met) break;
    const double shares =
        sum_(rows, pool, [&](int i) { return std::min(p[i] * largest, free(i)) * free(i); });
    if (wanted > shares) {  // let go
      each(pool, [&](int i) { displacement[i] = chopped(i); });
      multiply(rows, displacement, product, pool);
      const double curve = sum_(rows, pool, [&](int i) { return displacement[i] * product[i]; });
      if (!(curve > 0)) break;
      const double length = wanted / curve;
      largest = std::max(largest, curve / wanted);
      each(pool, [&](int i) {
        p[i] -= length * displacement[i];
        g[i] -= length * product[i];
      });
      begin = true;
      continue;
    }
    if (begin) each(pool, [&](int i) { displacement[i] = free(i); });
    multiply(rows, displacement, product, pool);
    const double curve = sum_(rows, pool, [&](int i) { return displacement[i] * product[i]; });
    if (begin) largest = std::max(largest, curve / frees);
    begin = false;
    const double slope = sum_(rows, pool, [&](int i) { return displacement[i] * g[i]; });
    if (!(curve > 0)) break;
    const double length = slope / curve;
    double feasible = HUGE_VAL;
    for (int i = 0; i < n_; ++i)
      if (displacement[i] > 0) feasible = std::min(feasible, p[i] / displacement[i]);
    if (length <= feasible) {
      each(pool, [&](int i) {
        p[i] = std::max(0.0, p[i] - length * displacement[i]);
        g[i] -= length * product[i];
      });
      const double along = sum_(rows, pool, [&](int i) { return free(i) * product[i]; }) / curve;
      each(pool, [&](int i) { displacement[i] = free(i) - along * displacement[i]; });
      continue;
    }
    // Steps to the first pressure that becomes 0, and from there by a projected gradient step.
    each(pool, [&](int i) {
      p[i] = std::max(0.0, p[i] - feasible * displacement[i]);
      g[i] -= feasible * product[i];
      if (p[i] > 0) p[i] = std::max(0.0, p[i] - g[i] / largest);
    });
    multiply(rows, p, g, pool);
    each(pool, [&](int i) { g[i] -= i < n_ ? b[i] : 0; });
    begin = true;
  }
  push(rows, p, pool);
  return met;
}

}  // namespace sim
