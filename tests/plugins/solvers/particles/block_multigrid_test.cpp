// Multigrid for elastic solids: a symmetric map, the same solution, iterations that hardly grow.
#include "plugins/solvers/particles/block_multigrid.h"

#include <catch2/catch.hpp>
#include <cmath>

#include "core/lua/scene/scene_file.h"
#include "core/particles/particle_system.h"
#include "tests/support/scenes.h"

using namespace sim;

namespace {

// The matrix of a step of 0.01 s of scenes/beam.lua at rest.
class Beam {
 public:
  Beam(int cells, int order, double poisson) : registry_(sim_test::make_registry()) {
    SceneOptions options{.search_path = {SIM_SOURCE_DIR "/scripts"}};
    options.settings = {{"cells", std::to_string(cells)}, {"order", std::to_string(order)}};
    SystemSpec spec = load_scene("scenes/beam.lua", registry_, options).systems.front();
    for (PartSpec& force : spec.forces)
      if (force.plugin == "fem") force.given["poisson"] = poisson;
    simulation_.emplace(spec, registry_,
                        RunOptions{.integrator = {"implicit_euler", {}}, .dt = 0.01});
    matrix_.emplace(particles());
    matrix_->at(particles().view(0, simulation_->state().data()), 0.01, {});
    pairs_ = *matrix_->others().couplings();
  }
  ParticleSystem& particles() { return dynamic_cast<ParticleSystem&>(simulation_->ode()); }
  StageMatrix& matrix() { return *matrix_; }
  BlockPairs pairs() const { return pairs_; }
  std::unique_ptr<BlockMultigrid> multigrid() {
    return std::make_unique<BlockMultigrid>(*matrix_, particles(), pairs_);
  }
  Array some(int seed) {
    Array r(matrix_->layout().size());
    const auto axes = matrix_->layout().axes(r.data());
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (int i = 0; i < matrix_->layout().n(); ++i)
        if (std::isfinite(particles().masses()[static_cast<std::size_t>(i)]))
          axes[axis][i] = std::sin(1.3 * i * seed + static_cast<double>(axis) + seed);
    return r;
  }
  // The number of iterations to eta under a load like that of a weight; checks the residual.
  int iterations(double eta) {
    Gmres solver(*matrix_, 100000, multigrid(), 0, true);
    Array b = some(1);
    for (double& value : b.span())
      if (value != 0) value = 1;
    Array d(b.size()), rest(b.size());
    const LinearResult result = solver.solve(b.data(), d.data(), eta);
    REQUIRE(result.solved);
    matrix_->apply(d.data(), rest.data());
    for (std::size_t i = 0; i < b.size(); ++i) rest[i] -= b[i];
    CHECK(dot(rest, rest) <= 1.001 * eta * eta * dot(b, b));
    return result.iterations;
  }

 private:
  Registry registry_;
  std::optional<Simulation> simulation_;
  std::optional<StageMatrix> matrix_;
  std::vector<std::array<int, 2>> pairs_;
};

}  // namespace

TEST_CASE("multigrid of blocks is a symmetric and positive map", "[linear]") {
  for (const double poisson : {0.3, 0.49}) {
    Beam beam(3, 1, poisson);
    const auto multigrid = beam.multigrid();
    REQUIRE(multigrid->prepare());
    const Array r = beam.some(1), s = beam.some(2);
    Array br(r.size()), bs(r.size());
    const double rbr = multigrid->solve(r.data(), br.data());
    const double sbs = multigrid->solve(s.data(), bs.data());
    CHECK(rbr > 0);
    CHECK(rbr == Approx(dot(r, br)));
    CHECK(std::abs(dot(r, bs) - dot(s, br)) <= 1e-6 * std::sqrt(rbr * sbs));
  }
}

TEST_CASE("iterations for a solid hardly grow with its mesh", "[linear]") {
  for (const double poisson : {0.3, 0.49})
    for (const int order : {1, 2}) {
      const int coarse = Beam(order == 1 ? 4 : 2, order, poisson).iterations(1e-3);
      const int fine = Beam(order == 1 ? 8 : 4, order, poisson).iterations(1e-3);
      INFO(poisson << " " << order << ": " << coarse << " " << fine);
      CHECK(fine <= 2 * coarse);
      CHECK(fine <= (poisson < 0.4 ? 40 : 200));  // the blocks on the diagonal alone: 600 and more
    }
}

TEST_CASE("rows of blocks have the same bits on any number of threads", "[linear]") {
  Beam beam(4, 1, 0.3);
  const int n = beam.matrix().layout().n();
  const std::vector<std::uint8_t> free(static_cast<std::size_t>(n), 1);
  const std::size_t size = static_cast<std::size_t>(n) * BlockRows::kRow;
  Array r(size), rest[2] = {Array(size), Array(size)}, x[2] = {Array(size), Array(size)};
  for (std::size_t i = 0; i < size; ++i) r[i] = std::sin(1.3 * static_cast<double>(i));
  for (const int threads : {1, 2}) {
    ThreadPool pool(threads);
    BlockRows rows(beam.matrix(), beam.pairs(), free, pool);
    REQUIRE(rows.take());
    Array &own = x[threads - 1], &left = rest[threads - 1];
    rows.relax(r.data(), 0.7, false, own.data());
    rows.residual(r.data(), own.data(), left.data());
    rows.relax(left.data(), 0.6, true, own.data());
  }
  CHECK(std::ranges::equal(x[0].span(), x[1].span()));
  CHECK(std::ranges::equal(rest[0].span(), rest[1].span()));
}

TEST_CASE("multigrid is not prepared for a matrix that is not finite", "[linear]") {
  Beam beam(2, 1, 0.3);
  const auto multigrid = beam.multigrid();
  CHECK(multigrid->prepare());
  std::vector<double> far(beam.particles().layout().size(), HUGE_VAL);
  beam.matrix().at(beam.particles().view(0, far.data()), 0.01, {});
  CHECK_FALSE(multigrid->prepare());
  const std::vector<std::uint8_t> free(beam.particles().masses().size(), 1);
  CHECK_FALSE(BlockRows(beam.matrix(), beam.pairs(), free, beam.particles().pool()).take());
}
