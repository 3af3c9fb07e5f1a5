#include "core/particles/springs/springs.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "core/base/assert.h"
#include "core/particles/springs/energy.h"
#include "core/simd/inverse_sqrt.h"

namespace sim {
namespace {

constexpr int kMaxLayers = 4;  // springs between the same two particles that may lie in runs

// Statistics of the first pass over the springs of one stride.
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

SpringRun empty_run(int n, int stride, const StrideStatistics& statistics, SpringSense sense,
                    bool own_numbers) {
  SpringRun run;
  run.stride = stride;
  run.uniform = statistics.uniform && sense == SpringSense::kBoth && !own_numbers;
  run.sense = sense;
  run.k = statistics.k;
  run.rest = statistics.rest;
  run.owners.resize(static_cast<std::size_t>(n) / 8 + 2);
  if (!run.uniform) {
    const auto size = static_cast<std::size_t>(n + 2 * SpringRun::kPad);
    run.ks = Array(size);
    run.rests = Array(size);
  }
  return run;
}

void put(SpringRun& run, int a, double k, double rest) {
  SIM_ASSERT(a >= 0 && static_cast<std::size_t>(a) / 8 < run.owners.size());
  SIM_ASSERT(!run.owns(a));
  set_bit(run.owners.data(), a);
  ++run.count;
  if (run.uniform) return;
  run.ks[static_cast<std::size_t>(a + SpringRun::kPad)] = k;
  run.rests[static_cast<std::size_t>(a + SpringRun::kPad)] = rest;
}

// A run pays if a block of 8 particles owns two or more of its springs.
bool pays(const SpringRun& run) {
  const long blocks = std::count_if(run.owners.begin(), run.owners.end(),
                                    [](std::uint8_t bits) { return bits != 0; });
  return run.count >= 2 * blocks;
}

}  // namespace

double length(const Vec3& d) {
  const double square = square_of(d[0], d[1], d[2]);
  if (square > kSafeLeast && square < kSafeMost) return std::sqrt(square);
  const double scale = d.cwiseAbs().maxCoeff();
  return scale > 0 && std::isfinite(scale) ? scale * (d / scale).norm() : scale;
}

double spring_factor(const Vec3& d, double k, double k_rest) {
  const double inverse = inverse_sqrt(square_of(d[0], d[1], d[2]));
  if (inverse == inverse) return std::fma(k_rest, inverse, -k);
  if (k_rest == 0) return -k;
  // d = scale u with components of u in [-1, 1], one of them 1 or -1, so that |u| does not
  // overflow.
  const double scale = d.cwiseAbs().maxCoeff();
  if (scale == 0) return 0;
  const Vec3 u = d / scale;
  const double s = k_rest / std::sqrt((u[0] * u[0] + u[1] * u[1]) + u[2] * u[2]) / scale - k;
  return s <= std::numeric_limits<double>::max() || s != s ? s : 0;
}

double spring_factor(SpringSense sense, const Vec3& d, double k, double rest) {
  if (sense != SpringSense::kBoth && slack(sense, length(d), rest)) return 0;
  return spring_factor(d, k, k * rest);
}

double spring_stretch(SpringSense sense, const Vec3& d, double rest) {
  const double now = length(d);
  return slack(sense, now, rest) ? 0 : now - rest;
}

Springs::Springs(int n, const std::function<void(const Visit&)>& for_each, SpringSense sense,
                 bool breakable)
    : n_(n), sense_(sense) {
  // First pass: count the springs of each stride, and see whether they are alike.
  std::map<int, StrideStatistics> strides;
  auto last = strides.end();
  for_each([&](int a, int b, double k, double rest) {
    SIM_ASSERT(a != b && a >= 0 && a < n && b >= 0 && b < n);
    const int stride = std::abs(a - b);
    if (last == strides.end() || last->first != stride) last = strides.try_emplace(stride).first;
    last->second.add(k, rest);
    ++count_;
  });

  // Second pass: put every spring into the first run of its stride where its lower end owns none
  // yet.
  std::map<int, std::vector<SpringRun>> layers;
  for (const auto& [stride, statistics] : strides)
    if (statistics.count * 64 >= n) layers[stride];
  std::vector<Net::Spring> others;
  for_each([&](int a, int b, double k, double rest) {
    const int low = std::min(a, b), high = std::max(a, b);
    const auto found = layers.find(high - low);
    if (found != layers.end()) {
      for (SpringRun& run : found->second)
        if (!run.owns(low)) return put(run, low, k, rest);
      if (found->second.size() < kMaxLayers) {
        found->second.push_back(empty_run(n, high - low, strides[high - low], sense, breakable));
        return put(found->second.back(), low, k, rest);
      }
    }
    others.push_back({low, high, k, rest});
  });

  for (auto& [stride, of_stride] : layers)
    for (SpringRun& run : of_stride) {
      if (pays(run)) {
        runs_.push_back(std::move(run));
        continue;
      }
      for (int a = 0; a + stride < n; ++a)
        if (run.owns(a)) others.push_back({a, a + stride, run.k_of(a), run.rest_of(a)});
    }
  // Every spring is in one run or in the net.
  SIM_ASSERT([&] {
    long all = static_cast<long>(others.size());
    for (const SpringRun& run : runs_) all += run.count;
    return all == count_;
  }());
  net_ = Net(n, others, sense, breakable);
  if (breakable) find_places(for_each);
}

// Equal springs between the same two particles are matched in the order of runs and slots.
void Springs::find_places(const std::function<void(const Visit&)>& for_each) {
  std::set<const double*> taken;
  const auto take = [&](double* k, double* rest, double wanted_k, double wanted_rest) {
    return *k == wanted_k && *rest == wanted_rest && taken.insert(k).second;
  };
  for_each([&](int a, int b, double k, double rest) {
    const int low = std::min(a, b), high = std::max(a, b);
    Numbers& numbers = places_.emplace_back();
    for (SpringRun& run : runs_) {
      if (run.stride != high - low || !run.owns(low)) continue;
      const auto at = static_cast<std::size_t>(low + SpringRun::kPad);
      if (!take(&run.ks[at], &run.rests[at], k, rest)) continue;
      numbers = {{&run.ks[at], nullptr}, {&run.rests[at], nullptr}};
      return;
    }
    for (const std::size_t end : {0U, 1U})
      net_.find(end == 0 ? low : high, end == 0 ? high : low, [&](double* own_k, double* own_rest) {
        if (!take(own_k, own_rest, k, rest)) return false;
        numbers.k[end] = own_k;
        numbers.rest[end] = own_rest;
        return true;
      });
  });
}

void Springs::set(std::size_t index, double k, double rest) {
  const Numbers& numbers = places_[index];
  count_ += (k > 0) - (*numbers.k[0] > 0);
  for (const std::size_t end : {0U, 1U}) {
    if (!numbers.k[end]) continue;
    *numbers.k[end] = k;
    *numbers.rest[end] = rest;
  }
}

double Springs::potential(const ParticleView& view, Tile tile) const {
  SIM_ASSERT(0 <= tile.begin && tile.begin <= tile.end && tile.end <= n_);
  double sum = 0;
  for (const SpringRun& run : runs_) sum += run_energy(run, view, tile.begin, tile.end);
  const Tile used = net_.used(tile);
  for (int i = used.begin; i < used.end; ++i)
    net_.at(i, [&](int to, double k, double rest) {
      if (to < i) return;
      const double strain = spring_stretch(sense_, view.position(i) - view.position(to), rest);
      sum += 0.5 * k * strain * strain;
    });
  return sum;
}

}  // namespace sim
