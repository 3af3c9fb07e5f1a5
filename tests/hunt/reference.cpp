#include "tests/hunt/reference.h"

#include <algorithm>
#include <cmath>

namespace sim_test {
namespace {

using State = std::vector<double>;

// n substeps of the modified midpoint rule from t to t + h.
State midpoint(const Rhs& f, double t, double h, int n, const State& x, const State& slope) {
  const double tau = h / n;
  State before = x, now(x.size());
  for (std::size_t i = 0; i < x.size(); ++i) now[i] = x[i] + tau * slope[i];
  for (int k = 1; k < n; ++k) {
    const State d = f(t + k * tau, now);
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double next = before[i] + 2 * tau * d[i];
      before[i] = now[i];
      now[i] = next;
    }
  }
  const State d = f(t + h, now);
  for (std::size_t i = 0; i < x.size(); ++i) now[i] = 0.5 * (now[i] + before[i] + tau * d[i]);
  return now;
}

}  // namespace

std::vector<State> extrapolated(const Rhs& f, State x, std::span<const double> times,
                                double tolerance, double longest, long most) {
  constexpr int kColumns = 8;  // order 16
  std::vector<State> found;
  double t = 0, h = times.empty() ? 0 : times.back() / 64;
  long evaluations = 0;
  for (const double goal : times) {
    while (t < goal) {
      h = std::min(h, longest);
      const bool last = t + h >= goal;
      const double step = last ? goal - t : h;
      const State slope = f(t, x);
      std::vector<State> row;
      double error = HUGE_VAL;
      for (int k = 0; k < kColumns; ++k) {
        const int n = 2 * (k + 1);
        State value = midpoint(f, t, step, n, x, slope);
        evaluations += n + 1;
        // Aitken and Neville: row[j] becomes the value of column j.
        for (int j = 0; j < k; ++j) {
          const double ratio = double(n) / (2 * (k - j));
          const State lower = row[static_cast<std::size_t>(j)];
          row[static_cast<std::size_t>(j)] = value;
          for (std::size_t i = 0; i < x.size(); ++i)
            value[i] += (value[i] - lower[i]) / (ratio * ratio - 1);
        }
        if (k > 0) {
          error = 0;
          for (std::size_t i = 0; i < x.size(); ++i) {
            const double scale = tolerance * (1e-3 + std::max(std::abs(value[i]), std::abs(x[i])));
            const double off = std::abs(value[i] - row[static_cast<std::size_t>(k - 1)][i]) / scale;
            if (!(off <= error)) error = off;
          }
        }
        row.push_back(std::move(value));
      }
      if (evaluations > most || std::isnan(error)) return {};
      if (error > 1 && step > 1e-13 * goal) {
        h = step * std::max(0.2, 0.9 * std::pow(error, -1.0 / (2 * kColumns - 1)));
        continue;
      }
      x = row.back();
      t = last ? goal : t + step;
      const double grown =
          step * std::clamp(0.9 * std::pow(error + 1e-300, -1.0 / (2 * kColumns - 1)), 0.5, 3.0);
      if (!last || grown < h) h = grown;
    }
    found.push_back(x);
  }
  return found;
}

}  // namespace sim_test
