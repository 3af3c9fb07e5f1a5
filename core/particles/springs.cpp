#include "core/particles/springs.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <tuple>

#include "core/base/inverse_sqrt.h"

namespace sim {
namespace {

constexpr int kMaxLayers = 4;  // springs between the same two particles that may lie in runs

struct PlainSpring {
  int a, b;
  double k, rest;
};

// What the first pass learns about all springs of one stride.
struct StrideStatistics {
  long count = 0;
  double k = 0, rest = 0;
  bool uniform = true;

  void add(double spring_k, double spring_rest) {
    if (count++ == 0) {
      k = spring_k;
      rest = spring_rest;
    }
    uniform = uniform && spring_k == k && spring_rest == rest;
  }
};

SpringRun empty_run(int n, int stride, const StrideStatistics& statistics) {
  SpringRun run;
  run.stride = stride;
  run.uniform = statistics.uniform;
  run.k = statistics.k;
  run.rest = statistics.rest;
  run.owners.resize(static_cast<std::size_t>(n) / 8 + 1);
  if (!run.uniform) {
    const auto size = static_cast<std::size_t>(n + 2 * SpringRun::kPad);
    run.ks = Array(size);
    run.rests = Array(size);
  }
  return run;
}

void put(SpringRun& run, int a, double k, double rest) {
  run.owners[static_cast<std::size_t>(a / 8)] |= static_cast<std::uint8_t>(1u << (a % 8));
  ++run.count;
  if (run.uniform) return;
  run.ks[static_cast<std::size_t>(a + SpringRun::kPad)] = k;
  run.rests[static_cast<std::size_t>(a + SpringRun::kPad)] = rest;
}

// A run pays where a block of 8 particles owns two or more of its springs.
bool pays(const SpringRun& run) {
  const long blocks = std::count_if(run.owners.begin(), run.owners.end(),
                                    [](std::uint8_t bits) { return bits != 0; });
  return run.count >= 2 * blocks;
}

}  // namespace

double length(const Vec3& d) {
  const double square = (d[0] * d[0] + d[1] * d[1]) + d[2] * d[2];
  if (in_seed_range(square)) return std::sqrt(square);
  const double scale = d.cwiseAbs().maxCoeff();
  return scale > 0 && std::isfinite(scale) ? scale * (d / scale).norm() : scale;
}

Vec3 spring_force(const Vec3& d, double k, double k_rest) {
  const double square = (d[0] * d[0] + d[1] * d[1]) + d[2] * d[2];
  if (in_seed_range(square)) {
    const double s = k_rest * inverse_sqrt(square) - k;
    return {s * d[0], s * d[1], s * d[2]};
  }
  if (k_rest == 0) return -k * d;
  // d = scale u with components of u in [-1, 1], one of them 1 or -1, so that |u| is harmless.
  const double scale = d.cwiseAbs().maxCoeff();
  if (scale == 0) return Vec3::Zero();
  const Vec3 u = d / scale;
  const double size = std::sqrt((u[0] * u[0] + u[1] * u[1]) + u[2] * u[2]);
  return ((k_rest - k * (scale * size)) / size) * u;
}

Springs::Springs(int n, const std::function<void(const Visit&)>& for_each) : n_(n) {
  // First pass: how many springs each stride has, and whether they are alike.
  std::map<int, StrideStatistics> strides;
  auto last = strides.end();
  for_each([&](int a, int b, double k, double rest) {
    const int stride = std::abs(a - b);
    if (last == strides.end() || last->first != stride) last = strides.try_emplace(stride).first;
    last->second.add(k, rest);
    ++count_;
  });

  // Second pass: every spring into the first run of its stride where its lower end owns none yet.
  std::map<int, std::vector<SpringRun>> layers;
  for (const auto& [stride, statistics] : strides)
    if (statistics.count * 64 >= n) layers[stride];
  std::vector<PlainSpring> rest_list;
  for_each([&](int a, int b, double k, double rest) {
    const int low = std::min(a, b), high = std::max(a, b);
    const auto found = layers.find(high - low);
    if (found != layers.end()) {
      for (SpringRun& run : found->second)
        if (!run.owns(low)) return put(run, low, k, rest);
      if (found->second.size() < kMaxLayers) {
        found->second.push_back(empty_run(n, high - low, strides[high - low]));
        return put(found->second.back(), low, k, rest);
      }
    }
    rest_list.push_back({low, high, k, rest});
  });

  for (auto& [stride, of_stride] : layers)
    for (SpringRun& run : of_stride) {
      if (pays(run)) {
        runs_.push_back(std::move(run));
        continue;
      }
      for (int a = 0; a + stride < n; ++a)
        if (run.owns(a)) rest_list.push_back({a, a + stride, run.k_of(a), run.rest_of(a)});
    }
  if (rest_list.empty()) return;

  // The others as rows of ends, sorted so that the order of the list does not show in the bits.
  first_end_.assign(static_cast<std::size_t>(n) + 1, 0);
  for (const PlainSpring& s : rest_list) {
    ++first_end_[static_cast<std::size_t>(s.a) + 1];
    ++first_end_[static_cast<std::size_t>(s.b) + 1];
  }
  for (std::size_t i = 1; i < first_end_.size(); ++i) first_end_[i] += first_end_[i - 1];
  ends_.resize(2 * rest_list.size());
  std::vector<int> next(first_end_.begin(), first_end_.end() - 1);
  for (const PlainSpring& s : rest_list) {
    ends_[static_cast<std::size_t>(next[static_cast<std::size_t>(s.a)]++)] = {s.b, s.k, s.rest};
    ends_[static_cast<std::size_t>(next[static_cast<std::size_t>(s.b)]++)] = {s.a, s.k, s.rest};
  }
  for (std::size_t i = 0; i + 1 < first_end_.size(); ++i)
    std::sort(ends_.begin() + first_end_[i], ends_.begin() + first_end_[i + 1],
              [](const SpringEnd& l, const SpringEnd& r) {
                return std::tie(l.to, l.k, l.rest) < std::tie(r.to, r.k, r.rest);
              });
}

std::span<const SpringEnd> Springs::ends(int i) const {
  if (first_end_.empty()) return {};
  const auto row = static_cast<std::size_t>(i);
  return {ends_.data() + first_end_[row], ends_.data() + first_end_[row + 1]};
}

void Springs::accumulate_ends(const ParticleView& view, Tile tile, ForceSink sink) const {
  for (int i = tile.begin; i < tile.end; ++i) {
    const Vec3 x = view.position(i);
    Vec3 sum = Vec3::Zero();
    for (const SpringEnd& end : ends(i))
      sum += spring_force(x - view.position(end.to), end.k, end.k * end.rest);
    sink.x[i] += sum[0];
    sink.y[i] += sum[1];
    sink.z[i] += sum[2];
  }
}

double Springs::potential(const ParticleView& view, Tile tile) const {
  double sum = 0;
  const auto add = [&](int a, int b, double k, double rest) {
    const double strain = length(view.position(a) - view.position(b)) - rest;
    sum += 0.5 * k * strain * strain;
  };
  for (const SpringRun& run : runs_)
    for (int a = tile.begin; a < tile.end; ++a)
      if (run.owns(a)) add(a, a + run.stride, run.k_of(a), run.rest_of(a));
  for (int i = tile.begin; i < tile.end; ++i)
    for (const SpringEnd& end : ends(i))
      if (end.to > i) add(i, end.to, end.k, end.rest);
  return sum;
}

}  // namespace sim
