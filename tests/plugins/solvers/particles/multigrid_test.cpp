// The preconditioner of implicit stages: patches, symmetry, and iterations that hardly grow.
#include <catch2/catch.hpp>
#include <cmath>

#include "core/particles/particle_system.h"
#include "core/particles/springs/springs.h"
#include "plugins/solvers/particles/float_springs.h"
#include "plugins/solvers/particles/linear_solver.h"
#include "plugins/solvers/particles/multigrid.h"
#include "plugins/solvers/particles/stage_equation.h"
#include "tests/support/scenes.h"

using namespace sim;

namespace {

// Springs of a sheet of n x n particles, or the same ones between shuffled numbers.
class Sheet final : public Force {
 public:
  Sheet(int n, bool shuffled, double k, std::size_t ways = 6)
      : n_(n), shuffled_(shuffled), k_(k), ways_(ways) {}
  int id(int i, int j) const {
    const int plain = i * n_ + j;
    return shuffled_ ? static_cast<int>(1L * plain * 7919 % (n_ * n_)) : plain;
  }
  void bind(const ParticleView& initial) override {
    springs_.emplace(initial.n, [&](const Springs::Visit& visit) {
      constexpr int kWays[][2] = {{0, 1}, {1, 0}, {1, 1}, {1, -1}, {0, 2}, {2, 0}};
      for (int i = 0; i < n_; ++i)
        for (int j = 0; j < n_; ++j)
          for (const auto& way : std::span(kWays).first(ways_)) {
            const int to = i + way[0], side = j + way[1];
            if (to < n_ && side >= 0 && side < n_)
              visit(id(i, j), id(to, side), k_, 0.98 * std::hypot(way[0], way[1]) / n_);
          }
    });
  }
  const Springs* springs() const override { return &*springs_; }
  double potential(const ParticleView& view, Tile tile) const override {
    return springs_->potential(view, tile);
  }

 private:
  int n_;
  bool shuffled_;
  double k_;
  std::size_t ways_;  // of the springs of a particle
  std::optional<Springs> springs_;
};

struct SheetStage {
  ThreadPool pool;
  Layout layout;
  Array x;
  std::unique_ptr<Particles> particles;
  std::unique_ptr<StageMatrix> matrix;

  SheetStage(int n, bool shuffled, double k, int threads = 1, std::size_t ways = 6)
      : pool(threads), layout(n * n), x(layout.size()) {
    auto sheet = std::make_unique<Sheet>(n, shuffled, k, ways);
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const int at = sheet->id(i, j);
        const double u = 1.0 * i / n, v = 1.0 * j / n;
        layout.block(x.data(), 0)[at] = u;
        layout.block(x.data(), 1)[at] = 0.1 * std::sin(5 * u) * std::cos(4 * v);
        layout.block(x.data(), 2)[at] = v;
      }
    std::vector<std::unique_ptr<Force>> forces;
    const int corner = sheet->id(0, n - 1);
    forces.push_back(std::move(sheet));
    const std::vector<double> masses(static_cast<std::size_t>(n * n), 1.0 / n / n);
    particles = std::make_unique<Particles>(masses, std::vector<int>{0, corner}, std::move(forces),
                                            x.data(), pool);
    matrix = std::make_unique<StageMatrix>(*particles);
    matrix->at(particles->view(0, x.data()), 0.01, {.clamped = false, .share = 0.9});
  }
  Array some(int seed) const {
    Array r(matrix->layout().size());
    const auto axes = matrix->layout().axes(r.data());
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < layout.n(); ++i)
        if (particles->masses()[static_cast<std::size_t>(i)] < HUGE_VAL)
          axes[static_cast<std::size_t>(axis)][i] = std::sin(1.3 * i * seed + axis + seed);
    return r;
  }
  int iterations(double eta) {
    ConjugateGradient solver(*matrix, 10000, std::make_unique<Multigrid>(*matrix, *particles));
    const Array b = some(1);
    Array d(b.size());
    const LinearResult result = solver.solve(b.data(), d.data(), eta);
    REQUIRE(result.solved);
    Array ad(b.size());
    matrix->apply(d.data(), ad.data());
    for (std::size_t i = 0; i < b.size(); ++i) ad[i] -= b[i];
    // In the norm that the solver promises.
    Array z(b.size());
    const double whole = matrix->precondition(b.data(), z.data());
    CHECK(std::sqrt(matrix->precondition(ad.data(), z.data()) / whole) <= 2 * eta);
    return result.iterations;
  }
};

}  // namespace

TEST_CASE("patches of a graph are connected, of about the wanted size, and leave nobody out") {
  std::vector<std::array<int, 2>> edges;
  constexpr int kSide = 30, kNodes = kSide * kSide;
  for (int i = 0; i < kNodes; ++i) {
    if (i % kSide + 1 < kSide) edges.push_back({i, i + 1});
    if (i + kSide < kNodes) edges.push_back({i + kSide, i});
  }
  std::vector<std::uint8_t> left_out(kNodes);
  left_out[7] = 1;
  const WeightedGraph graph = graph_of(kNodes, edges);
  const Aggregates aggregates = aggregate(graph, left_out, 16);
  CHECK(aggregates.of[7] == -1);
  CHECK(aggregates.count >= kNodes / 24);
  CHECK(aggregates.count <= kNodes / 10);
  std::vector<int> size(static_cast<std::size_t>(aggregates.count)), inner(size);
  for (int i = 0; i < kNodes; ++i) {
    if (i == 7) continue;
    const int own = aggregates.of[static_cast<std::size_t>(i)];
    REQUIRE(own >= 0);
    REQUIRE(own < aggregates.count);
    ++size[static_cast<std::size_t>(own)];
  }
  for (const int count : size) CHECK((count >= 8 && count <= 32));
  // Connected: what one node reaches along edges within its patch is all of it.
  std::vector<bool> seen(kNodes);
  for (int first = 0; first < kNodes; ++first) {
    const int own = aggregates.of[static_cast<std::size_t>(first)];
    if (own < 0 || inner[static_cast<std::size_t>(own)] > 0) continue;
    std::vector<int> stack{first};
    seen[static_cast<std::size_t>(first)] = true;
    while (!stack.empty()) {
      const auto at = static_cast<std::size_t>(stack.back());
      stack.pop_back();
      ++inner[static_cast<std::size_t>(own)];
      for (int e = graph.begin[at]; e < graph.begin[at + 1]; ++e) {
        const auto to = static_cast<std::size_t>(graph.to[static_cast<std::size_t>(e)]);
        if (aggregates.of[to] != own || seen[to]) continue;
        seen[to] = true;
        stack.push_back(static_cast<int>(to));
      }
    }
  }
  CHECK(inner == size);
}

TEST_CASE("the multilevel preconditioner is symmetric and positive, in runs and in nets") {
  for (const bool shuffled : {false, true}) {
    SheetStage stage(24, shuffled, 1e5);
    Multigrid multilevel(*stage.matrix, *stage.particles);
    REQUIRE(multilevel.prepare());
    const Array r = stage.some(1), s = stage.some(2);
    Array br(r.size()), bs(r.size());
    const double rbr = multilevel.solve(r.data(), br.data());
    const double sbs = multilevel.solve(s.data(), bs.data());
    CHECK(rbr > 0);
    CHECK(rbr == Approx(dot(r, br)));
    CHECK(std::abs(dot(r, bs) - dot(s, br)) <= 1e-4 * std::sqrt(rbr * sbs));
  }
}

TEST_CASE("springs that push leave the matrix in single precision positive definite") {
  for (const bool shuffled : {false, true}) {
    constexpr int n = 24;
    SheetStage stage(n, shuffled, 1e5, 1, 2);  // springs to the nearest alone
    // Flat, and half as wide as at rest: every spring pushes across the sheet.
    for (const int axis : {0, 1, 2})
      for (int i = 0; i < stage.layout.n(); ++i)
        stage.layout.block(stage.x.data(), axis)[i] *= axis == 1 ? 0.0 : 0.5;
    stage.matrix->at(stage.particles->view(0, stage.x.data()), 0.01, {});
    FloatSprings single(*stage.particles);
    single.take(*stage.matrix);
    const Sheet numbers(n, shuffled, 1);
    const Layout& layout = single.layout();
    for (const int pattern : {1, 2, 3}) {  // stripes along either side, and squares
      ArrayOf<float> zero(layout.size()), x(layout.size()), out(layout.size());
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) {
          const int at = numbers.id(i, j);
          const int sign = (pattern & 1 ? i : 0) + (pattern & 2 ? j : 0);
          if (stage.particles->masses()[static_cast<std::size_t>(at)] < HUGE_VAL)
            layout.block(x.data(), 1)[at] = sign % 2 ? -1.0F : 1.0F;
        }
      single.residual(zero.data(), x.data(), out.data());
      double energy = 0;
      for (std::size_t k = 0; k < x.size(); ++k) energy -= double{x[k]} * out[k];
      INFO(pattern);
      CHECK(energy > 0);
    }
  }
}

TEST_CASE("iterations hardly grow with a sheet and not with its stiffness") {
  for (const bool shuffled : {false, true}) {
    const int soft = SheetStage(24, shuffled, 1e5).iterations(1e-6);
    const int large = SheetStage(96, shuffled, 1e5).iterations(1e-6);
    const int stiff = SheetStage(96, shuffled, 1e7).iterations(1e-6);
    INFO(soft << " " << large << " " << stiff);
    CHECK(large <= 2 * soft);
    CHECK(stiff <= 2 * soft);
    CHECK(stiff <= 60);  // the blocks on the diagonal alone take 500
  }
}

TEST_CASE("the preconditioner gives the same bits on any number of threads") {
  SheetStage one(40, false, 1e6, 1), two(40, false, 1e6, 2);
  Array a(one.matrix->layout().size()), b(a.size());
  const Array r = one.some(3);
  for (auto [stage, z] : {std::pair{&one, &a}, std::pair{&two, &b}}) {
    Multigrid multilevel(*stage->matrix, *stage->particles);
    REQUIRE(multilevel.prepare());
    multilevel.solve(r.data(), z->data());
  }
  CHECK(std::equal(a.span().begin(), a.span().end(), b.span().begin()));
}
