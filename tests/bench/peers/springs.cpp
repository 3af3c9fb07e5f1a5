#include "tests/bench/peers/springs.h"

#include <algorithm>

namespace peer {

RightHandSide::RightHandSide(const Scene& scene) : scene_(scene), count_(scene.springs.size()) {
  for (const double m : scene.mass) inverse_mass_.push_back(1 / m);
  for (const Spring& s : scene.springs) {
    a_.push_back(3 * s.a);
    b_.push_back(3 * s.b);
    k_.push_back(s.k);
    rest_.push_back(s.rest);
  }
  choose_way();
}

void RightHandSide::choose_way() {
  std::vector<double> x = scene_.x, dx(2 * x.size());
  x.insert(x.end(), scene_.v.begin(), scene_.v.end());
  double best[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL};
  const double until = seconds_now() + 0.3;
  for (int round = 0; round < 4 || seconds_now() < until; ++round)
    for (way_ = 0; way_ < 3; ++way_) {
      const double start = seconds_now();
      (*this)(x.data(), dx.data());
      best[way_] = std::min(best[way_], seconds_now() - start);
    }
  const char* const names[] = {"records", "arrays", "blocks"};
  std::string times;
  for (int way = 0; way < 3; ++way) {
    char text[64];
    std::snprintf(text, sizeof text, "%s%s %.2f ns", way ? ", " : "", names[way],
                  best[way] * 1e9 / static_cast<double>(count_));
    times += text;
  }
  way_ = static_cast<int>(std::min_element(best, best + 3) - best);
  about_ = std::string(names[way_]) + " (a spring: " + times + ")";
}

namespace {

void add(const double* x, double* f, int a, int b, double k, double rest) {
  const double dx = x[a] - x[b], dy = x[a + 1] - x[b + 1], dz = x[a + 2] - x[b + 2];
  const double factor = k * (rest / std::sqrt(dx * dx + dy * dy + dz * dz) - 1);
  f[a] += factor * dx;
  f[a + 1] += factor * dy;
  f[a + 2] += factor * dz;
  f[b] -= factor * dx;
  f[b + 1] -= factor * dy;
  f[b + 2] -= factor * dz;
}

}  // namespace

void RightHandSide::operator()(const double* X, double* dX) const {
  const std::size_t size = scene_.x.size();
  const double *const v = X + size, drag = scene_.drag;
  double* const f = dX + size;
  for (std::size_t i = 0; i < size; ++i) {
    dX[i] = v[i];
    f[i] = -drag * v[i];
  }
  if (way_ == 0) add_records(X, f);
  if (way_ == 1) add_arrays(X, f);
  if (way_ == 2) add_blocks(X, f);
  for (std::size_t i = 0; i < inverse_mass_.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      f[3 * i + c] = f[3 * i + c] * inverse_mass_[i] + scene_.g[c];
  for (const int id : scene_.pinned)
    for (int c = 0; c < 3; ++c) f[3 * id + c] = 0;
}

void RightHandSide::add_records(const double* x, double* f) const {
  for (const Spring& s : scene_.springs) add(x, f, 3 * s.a, 3 * s.b, s.k, s.rest);
}

void RightHandSide::add_arrays(const double* x, double* f) const {
  for (std::size_t s = 0; s < count_; ++s) add(x, f, a_[s], b_[s], k_[s], rest_[s]);
}

void RightHandSide::add_blocks(const double* x, double* f) const {
  constexpr std::size_t kBlock = 256;
  double fx[kBlock], fy[kBlock], fz[kBlock];
  for (std::size_t first = 0; first < count_; first += kBlock) {
    const std::size_t n = std::min(kBlock, count_ - first);
    const int *const a = &a_[first], *const b = &b_[first];
    const double *const k = &k_[first], *const rest = &rest_[first];
    for (std::size_t s = 0; s < n; ++s) {
      const double dx = x[a[s]] - x[b[s]], dy = x[a[s] + 1] - x[b[s] + 1];
      const double dz = x[a[s] + 2] - x[b[s] + 2];
      const double factor = k[s] * (rest[s] / std::sqrt(dx * dx + dy * dy + dz * dz) - 1);
      fx[s] = factor * dx;
      fy[s] = factor * dy;
      fz[s] = factor * dz;
    }
    for (std::size_t s = 0; s < n; ++s) {
      f[a[s]] += fx[s];
      f[a[s] + 1] += fy[s];
      f[a[s] + 2] += fz[s];
      f[b[s]] -= fx[s];
      f[b[s] + 1] -= fy[s];
      f[b[s] + 2] -= fz[s];
    }
  }
}

}  // namespace peer
