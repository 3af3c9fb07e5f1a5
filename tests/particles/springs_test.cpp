// Runs are found in any list of springs, and give the forces of a plain loop.
#include "core/particles/springs/springs.h"

#include <catch2/catch.hpp>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <tuple>

#include "core/base/thread_pool.h"
#include "core/particles/particle_system.h"
#include "core/simd/simd_targets.h"

using namespace sim;

namespace {

struct Tie {
  int a, b;
  double k, rest;
};
using Ties = std::vector<Tie>;

Ties cloth(int n) {
  Ties list;
  const double s = 1.0 / n;
  const auto add = [&](double k, int di, int dj) {
    for (int i = 0; i + di < n; ++i)
      for (int j = std::max(0, -dj); j < n && j + dj < n; ++j)
        list.push_back({i * n + j, (i + di) * n + j + dj, k, s * std::hypot(di, dj)});
  };
  add(100, 0, 1);
  add(100, 1, 0);
  add(50, 1, 1);
  add(50, 1, -1);
  add(25, 0, 2);
  add(25, 2, 0);
  return list;
}

Ties chain(int n, bool jitter) {
  Ties list;
  for (int i = 0; i + 1 < n; ++i)
    list.push_back({i, i + 1, 200.0 + (jitter ? i : 0), 0.1 + (jitter ? 1e-4 * i : 0)});
  return list;
}

Ties random_graph(int n, int springs) {
  std::mt19937 random(7);
  Ties list;
  while (static_cast<int>(list.size()) < springs) {
    const int a = static_cast<int>(random() % static_cast<unsigned>(n));
    const int b = static_cast<int>(random() % static_cast<unsigned>(n));
    if (a != b) list.push_back({a, b, 10.0 + static_cast<double>(random() % 90), 0.3});
  }
  return list;
}

Springs springs_of(int n, const Ties& list) {
  return Springs(n, [&](const Springs::Visit& visit) {
    for (const Tie& tie : list) visit(tie.a, tie.b, tie.k, tie.rest);
  });
}

// The springs of a list as a force of the particle system.
class ListForce final : public Force {
 public:
  explicit ListForce(Ties list) : list_(std::move(list)) {}
  void bind(const ParticleView& initial) override {
    springs_.emplace(initial.n, [&](const Springs::Visit& visit) {
      for (const Tie& tie : list_) visit(tie.a, tie.b, tie.k, tie.rest);
    });
  }
  const Springs* springs() const override { return &*springs_; }

 private:
  Ties list_;
  std::optional<Springs> springs_;
};

std::vector<Vec3> positions(int n) {
  std::mt19937 random(3);
  std::uniform_real_distribution<double> within(-1, 1);
  std::vector<Vec3> x;
  for (int i = 0; i < n; ++i) x.push_back({within(random), within(random), within(random)});
  return x;
}

// Accelerations of unit masses as the system computes them.
std::vector<Vec3> system_forces(const Ties& list, const std::vector<Vec3>& x, int threads = 1) {
  const int n = static_cast<int>(x.size());
  const Layout layout(n);
  Array state(layout.size()), y(layout.size()), dydt(layout.size());
  for (int i = 0; i < n; ++i)
    for (int axis = 0; axis < 3; ++axis)
      layout.block(state.data(), axis)[i] = x[static_cast<std::size_t>(i)][axis];
  ThreadPool pool(threads);
  std::vector<std::unique_ptr<Force>> forces;
  forces.push_back(std::make_unique<ListForce>(list));
  ParticleSystem system(std::vector<double>(x.size(), 1.0), {}, std::move(forces), state.data(),
                        pool);
  system.eval(0, {state.data(), {}}, y.data(), dydt.data());
  std::vector<Vec3> f;
  for (int i = 0; i < n; ++i)
    f.push_back({layout.block(dydt.data(), 3)[i], layout.block(dydt.data(), 4)[i],
                 layout.block(dydt.data(), 5)[i]});
  return f;
}

// A plain loop over the list in extended precision.
std::vector<Vec3> plain_forces(const Ties& list, const std::vector<Vec3>& x) {
  using Long = std::array<long double, 3>;
  std::vector<Long> f(x.size());
  for (const Tie& tie : list) {
    const auto a = static_cast<std::size_t>(tie.a), b = static_cast<std::size_t>(tie.b);
    Long d;
    for (std::size_t axis = 0; axis < 3; ++axis)
      d[axis] = static_cast<long double>(x[a][axis]) - x[b][axis];
    const long double length = std::sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const long double force = -tie.k * (length - tie.rest) / length * d[axis];
      f[a][axis] += force;
      f[b][axis] -= force;
    }
  }
  std::vector<Vec3> rounded;
  for (const Long& force : f)
    rounded.push_back({static_cast<double>(force[0]), static_cast<double>(force[1]),
                       static_cast<double>(force[2])});
  return rounded;
}

// The springs of a list with particle i called number[i].
Ties renumbered(Ties list, const std::vector<int>& number) {
  for (Tie& tie : list) {
    tie.a = number[static_cast<std::size_t>(tie.a)];
    tie.b = number[static_cast<std::size_t>(tie.b)];
  }
  return list;
}

// 0 .. n - 1, shuffled within windows.
std::vector<int> shuffled(int n, int window) {
  std::vector<int> number(static_cast<std::size_t>(n));
  std::iota(number.begin(), number.end(), 0);
  std::mt19937 random(5);
  for (int begin = 0; begin < n; begin += window)
    std::shuffle(number.begin() + begin, number.begin() + std::min(begin + window, n), random);
  return number;
}

// The ties of every particle, in the order in which a net adds them.
std::vector<Ties> sorted_ends(const Ties& list, std::size_t n) {
  std::vector<Ties> ends(n);
  for (const Tie& tie : list) {
    ends[static_cast<std::size_t>(tie.a)].push_back(tie);
    ends[static_cast<std::size_t>(tie.b)].push_back({tie.b, tie.a, tie.k, tie.rest});
  }
  for (Ties& of_one : ends)
    std::ranges::sort(of_one, {},
                      [](const Tie& tie) { return std::tuple(tie.k, tie.rest, tie.b); });
  return ends;
}

// The forces of a net, end by end.
std::vector<Vec3> net_forces(const Ties& list, const std::vector<Vec3>& x) {
  std::vector<Vec3> f;
  for (const Ties& ends : sorted_ends(list, x.size())) {
    Vec3 sum = Vec3::Zero();
    for (const Tie& tie : ends) {
      const Vec3 d = x[static_cast<std::size_t>(tie.a)] - x[static_cast<std::size_t>(tie.b)];
      const double s = spring_factor(d, tie.k, tie.k * tie.rest);
      for (int axis = 0; axis < 3; ++axis) sum[axis] = std::fma(s, d[axis], sum[axis]);
    }
    f.push_back(sum);
  }
  return f;
}

void check_every_way(const Ties& list, const std::vector<Vec3>& x,
                     const std::vector<Vec3>& forces) {
  for (const int threads : {1, 2, 3}) CHECK(system_forces(list, x, threads) == forces);
  for (const char* level : {"sse2", "fma", "avx2", "avx512"}) {
    setenv("SIM_SIMD", level, 1);
    CHECK(system_forces(list, x, 2) == forces);
  }
  unsetenv("SIM_SIMD");
}

double worst_difference(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i)
    worst = std::max(worst, (a[i] - b[i]).cwiseAbs().maxCoeff());
  return worst;
}

}  // namespace

TEST_CASE("a cloth of any size is six runs", "[particles]") {
  for (const int n : {8, 10, 32, 50}) {
    const Springs springs = springs_of(n * n, cloth(n));
    CHECK(springs.runs().size() == 6);
    CHECK(springs.net().empty());
    std::vector<int> strides;
    for (const SpringRun& run : springs.runs()) strides.push_back(run.stride);
    CHECK(strides == std::vector<int>{1, 2, n - 1, n, n + 1, 2 * n});
  }
}

TEST_CASE("the order of a list and of the ends of its springs does not matter", "[particles]") {
  const int n = 20;
  Ties list = cloth(n);
  const std::vector<Vec3> x = positions(n * n);
  const std::vector<Vec3> before = system_forces(list, x);
  std::mt19937 random(11);
  std::shuffle(list.begin(), list.end(), random);
  for (std::size_t i = 0; i < list.size(); i += 3) std::swap(list[i].a, list[i].b);
  CHECK(springs_of(n * n, list).runs().size() == 6);
  CHECK(system_forces(list, x) == before);
}

TEST_CASE("a chain is one run, with or without its own constants everywhere", "[particles]") {
  const Springs even = springs_of(100, chain(100, false));
  REQUIRE(even.runs().size() == 1);
  CHECK(even.runs()[0].uniform);
  CHECK(even.runs()[0].count == 99);
  const Springs odd = springs_of(100, chain(100, true));
  REQUIRE(odd.runs().size() == 1);
  CHECK_FALSE(odd.runs()[0].uniform);
  CHECK(odd.runs()[0].k_of(42) == 242.0);
}

TEST_CASE("two springs between the same particles are two springs", "[particles]") {
  Ties list = chain(64, false);
  const Ties again = list;
  list.insert(list.end(), again.begin(), again.end());
  const std::vector<Vec3> x = positions(64);
  const std::vector<Vec3> once = system_forces(again, x), twice = system_forces(list, x);
  for (std::size_t i = 0; i < x.size(); ++i)
    CHECK((twice[i] - 2 * once[i]).norm() <= 1e-13 * (1 + once[i].norm()));
}

TEST_CASE("what fits no run stays a list", "[particles]") {
  const Springs springs = springs_of(3000, random_graph(3000, 6000));
  CHECK(springs.runs().empty());
  CHECK_FALSE(springs.net().empty());
  CHECK(springs.count() == 6000);
}

TEST_CASE("forces agree with a plain loop in extended precision", "[particles]") {
  // Sums of at most some tens of terms below 300 N: 1e-12 is a few tens of roundings.
  for (const int n : {2, 3, 5, 8, 9, 17, 33})
    CHECK(worst_difference(system_forces(cloth(n), positions(n * n)),
                           plain_forces(cloth(n), positions(n * n))) < 1e-12);
  for (const int n : {2, 7, 8, 9, 64, 1000})
    CHECK(worst_difference(system_forces(chain(n, true), positions(n)),
                           plain_forces(chain(n, true), positions(n))) < 1e-12);
  const Ties graph = random_graph(500, 2000);
  CHECK(worst_difference(system_forces(graph, positions(500)),
                         plain_forces(graph, positions(500))) < 1e-12);
  Ties mixed = cloth(12);
  for (const Tie& tie : random_graph(144, 40)) mixed.push_back(tie);
  CHECK(worst_difference(system_forces(mixed, positions(144)),
                         plain_forces(mixed, positions(144))) < 1e-12);
}

TEST_CASE("threads and instruction sets do not change a bit", "[particles]") {
  for (const int n : {8, 33, 64}) {
    const Ties list = cloth(n);
    const std::vector<Vec3> x = positions(n * n);
    const std::vector<Vec3> one = system_forces(list, x);
    for (const int threads : {2, 3, 4}) CHECK(system_forces(list, x, threads) == one);
    for (const char* level : {"sse2", "fma", "avx2", "avx512"}) {
      setenv("SIM_SIMD", level, 1);
      CHECK(system_forces(list, x) == one);
    }
    unsetenv("SIM_SIMD");
  }
}

TEST_CASE("a large net in another order adds the same ends in the same order", "[particles]") {
  const int n = 190 * 190;
  const std::vector<Vec3> x = positions(n);
  const Ties random = renumbered(cloth(190), shuffled(n, n));
  const Springs springs = springs_of(n, random);
  REQUIRE(springs.runs().empty());
  CHECK(springs.net().reordered());
  check_every_way(random, x, net_forces(random, x));

  const std::vector<Ties> ends = sorted_ends(random, x.size());
  long wrong = 0;
  for (int i = 0; i < n; ++i) {
    std::size_t e = 0;
    const Ties& of_one = ends[static_cast<std::size_t>(i)];
    springs.at(i, [&](int to, double k, double rest) {
      wrong +=
          e >= of_one.size() || of_one[e].b != to || of_one[e].k != k || of_one[e].rest != rest;
      ++e;
    });
    wrong += e != of_one.size();
  }
  CHECK(wrong == 0);
}

TEST_CASE("a net keeps numbers that are near, or few", "[particles]") {
  for (const auto& [side, window] : {std::pair{190, 64}, std::pair{40, 1600}}) {
    const int n = side * side;
    Ties list = renumbered(cloth(side), shuffled(n, window));
    for (Tie& tie : list) tie.k = 100;  // not the stiffness alone tells the springs apart
    const std::vector<Vec3> x = positions(n);
    REQUIRE(springs_of(n, list).runs().empty());
    CHECK_FALSE(springs_of(n, list).net().reordered());
    check_every_way(list, x, net_forces(list, x));
  }
}

TEST_CASE("a net of a few particles among many acts on these, wherever they are", "[particles]") {
  constexpr int kParticles = 2000;
  const std::vector<Vec3> x = positions(kParticles);
  for (const int first : {0, 5, 8, 1003, kParticles - 17}) {
    CAPTURE(first);
    Ties list;
    for (const Tie& tie : random_graph(17, 25))
      list.push_back({tie.a + first, tie.b + first, tie.k, tie.rest});
    const Springs springs = springs_of(kParticles, list);
    REQUIRE(springs.runs().empty());
    check_every_way(list, x, net_forces(list, x));
    std::vector<double> columns(6 * kParticles);
    for (std::size_t i = 0; i < x.size(); ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) columns[axis * kParticles + i] = x[i][axis];
    ParticleView view;
    view.n = kParticles;
    view.x = columns.data(), view.y = view.x + kParticles, view.z = view.y + kParticles;
    double energy = 0;
    for (const Tie& tie : list) {
      const double strain =
          (x[static_cast<std::size_t>(tie.a)] - x[static_cast<std::size_t>(tie.b)]).norm() -
          tie.rest;
      energy += 0.5 * tie.k * strain * strain;
    }
    double potential = 0;
    for (int begin = 0; begin < kParticles; begin += 64)
      potential += springs.potential(view, {begin, std::min(begin + 64, kParticles)});
    CHECK(potential == Approx(energy).epsilon(1e-12));
  }
}

TEST_CASE("a net may be in pieces, with a star, free particles and extreme lengths",
          "[particles]") {
  // Two cloths of 130 x 130, a star of 5000 and 3 particles without springs.
  const int cloth_size = 130 * 130, n = 2 * cloth_size + 5001 + 3;
  Ties list = cloth(130);
  for (const Tie& tie : cloth(130))
    list.push_back({tie.a + cloth_size, tie.b + cloth_size, tie.k + 1, tie.rest});
  for (int i = 1; i <= 5000; ++i)
    list.push_back({2 * cloth_size, 2 * cloth_size + i, 1.0 + i % 7, 0.2});
  list = renumbered(list, shuffled(n, n));
  std::vector<Vec3> x = positions(n);
  const auto at = [&](int i) -> Vec3& { return x[static_cast<std::size_t>(i)]; };
  at(list[100].a) = at(list[100].b);
  at(list[200].a) = at(list[200].b) + Vec3(1e-200, 0, 0);
  at(list[300].a) = Vec3(0, 1e200, 0);
  at(list.back().b) = Vec3(0, 0, -1e170);
  const Springs springs = springs_of(n, list);
  REQUIRE(springs.runs().empty());
  CHECK(springs.net().reordered());
  check_every_way(list, x, net_forces(list, x));
}

TEST_CASE("runs and a reordered net add up", "[particles]") {
  const int n = 33001;
  Ties list = chain(n, false);
  for (const Tie& tie : renumbered(list, shuffled(n, n))) list.push_back(tie);
  list.push_back({0, n - 1, 10, 0.3});
  const Springs springs = springs_of(n, list);
  REQUIRE(springs.runs().size() == 1);
  REQUIRE(springs.net().reordered());
  const std::vector<Vec3> x = positions(n), forces = system_forces(list, x);
  CHECK(worst_difference(forces, plain_forces(list, x)) < 1e-12);
  check_every_way(list, x, forces);
}

TEST_CASE("distances far outside the fast path give the exact force", "[particles]") {
  // Chains of every stride-th particle, a single pair of which is at an extreme distance: in the
  // first block, and where the ring of the run begins again, read by the same block or a later one.
  constexpr int kCount = 64;
  for (const auto& [stride, low] : {std::pair{1, 7}, {1, 16}, {1, 17}, {12, 3}, {12, 33}})
    for (const double d : {1e-300, 1e-200, 1e-100, 1e-25, 1e-22, 1e19, 1e25, 1e100, 1e200}) {
      Ties list;
      for (int i = 0; i + stride < kCount; ++i) list.push_back({i, i + stride, 2.0, 0.5});
      std::vector<Vec3> x;
      for (int i = 0; i < kCount; ++i) {
        const int links = (i - low) / stride;
        if ((i - low) % stride != 0)
          x.push_back({0, 1.0 * (i / stride), 5});
        else if (i <= low)
          x.push_back({0, i < low ? links - 1.0 : 0.0, 0});
        else
          x.push_back({d, links - 1.0, 0});
      }
      REQUIRE(springs_of(kCount, list).runs().size() == 1);
      const double expected = -2.0 * (d - 0.5);  // on the upper particle, along x
      for (const char* level : {"sse2", "fma", "avx2", "avx512"}) {
        setenv("SIM_SIMD", level, 1);
        const std::vector<Vec3> forces = system_forces(list, x);
        const auto force = [&](int i) { return forces[static_cast<std::size_t>(i)][0]; };
        CHECK(force(low + stride) == Approx(expected).epsilon(1e-14));
        CHECK(force(low) == Approx(-expected).epsilon(1e-14));
      }
    }
  unsetenv("SIM_SIMD");
}

TEST_CASE("particles that are not tied do not feel each other, however far apart") {
  // Two chains of 6 and 10 particles; their ends are neighbours in the list, and infinitely far.
  Ties list = chain(16, false);
  list.erase(list.begin() + 5);
  std::vector<Vec3> x;
  for (int i = 0; i < 16; ++i) x.push_back({i < 6 ? 1.7e308 : -1.7e308, 0.3 * i, 0});
  for (const Vec3& f : system_forces(list, x)) CHECK(f.allFinite());
  CHECK(system_forces(list, x)[6][1] == Approx(200 * (0.3 - 0.1)));
}

TEST_CASE("a spring of length 0 gives no force, one of rest length 0 exactly -k d", "[particles]") {
  const std::vector<Vec3> same(16, Vec3(0.3, -0.2, 0.1));
  for (const Vec3& f : system_forces(chain(16, false), same)) CHECK(f.norm() == 0);
  const Vec3 d(0.1, -0.7, 1e-30);
  CHECK(spring_force(d, 3.0, 0.0) == Vec3(-3.0 * d));
  CHECK(spring_force(Vec3(1e-200, 0, 0), 3.0, 0.0) == Vec3(-3e-200, 0, 0));
  // A length so small that 1/|d| overflows.
  CHECK(spring_factor(Vec3(0, 1e-310, 0), 3.0, 0.5) == 0);
  std::vector<Vec3> tiny(16, Vec3(0, 0, 0));
  tiny[8] = {1e-310, 0, 0};
  for (const Vec3& f : system_forces(chain(16, false), tiny)) CHECK(f.norm() == 0);
  CHECK(length(Vec3(3e200, 4e200, 0)) == Approx(5e200));
  CHECK(length(Vec3(3e-200, 4e-200, 0)) == Approx(5e-200));
}
