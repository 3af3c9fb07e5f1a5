// The account of a live scene: energies while users act and time goes back and forth.
#include "cli/view/account.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "tests/support/scenes.h"

namespace {

using sim::Action;
using What = Action::What;

// A live scene of one system, whose energies are looked at as often as they ask for.
struct Live {
  explicit Live(sim::SystemSpec scene) : spec(std::move(scene)) {
    player.before_touch(0, [this] { account.look(); });
  }
  void advance(std::int64_t steps) {
    while (steps > 0) {
      const std::int64_t due = account.due();
      REQUIRE((due >= 1 && due <= 64));
      const std::int64_t taken = player.advance(std::min(due, steps));
      REQUIRE(taken > 0);
      steps -= taken;
      account.stepped();
    }
  }
  void act(const Action& action) {
    player.act(0, action);
    account.stepped();
  }
  void go_to(std::int64_t step) {
    REQUIRE(player.go_to(step));
    account.travelled();
  }
  double drift() { return account.sample().drift; }
  double momentum() { return account.verdict({}).figures.momentum; }

  sim::Registry registry = sim_test::make_registry();
  sim::SystemSpec spec;
  std::vector<sim::Simulation> systems = [this] {
    std::vector<sim::Simulation> list;
    list.emplace_back(spec, registry, sim::RunOptions{.integrator = {"rk4"}, .dt = 1e-3});
    return list;
  }();
  sim::Player player{systems, false};
  sim::cli::EnergyAccount account{player, 0, spec, registry};
};

}  // namespace

// Some 20 J are in play. Without drag and hands nothing has to be looked at in between.
TEST_CASE("energy and work add up while hands act and time goes back and forth") {
  for (const double drag : {0.0, 0.7}) {
    CAPTURE(drag);
    Live live(sim_test::make_elastic_pendulum(drag));
    CHECK(live.account.due() == (drag > 0 ? 1 : 64));
    CHECK(live.drift() == Approx(0).margin(1e-12));
    live.advance(300);
    CHECK(std::abs(live.drift()) < 1e-4);
    live.act({.what = What::kVelocity, .particle = 1, .x = {1, 2, 3}});
    CHECK(std::abs(live.drift()) < 1e-4);
    live.advance(100);
    CHECK(std::abs(live.drift()) < 1e-4);
    live.act({.what = What::kGrab, .particle = 1});
    CHECK(live.account.due() == 1);  // a hand works
    live.act({.what = What::kMove, .particle = 1, .x = {1, -1.5, 0.2}, .steps = 200});
    live.advance(150);
    CHECK(std::abs(live.drift()) < 1e-3);
    live.go_to(450);  // while it is held
    CHECK(live.account.due() == 1);
    live.advance(250);
    live.act({.what = What::kRelease, .particle = 1});
    live.advance(200);
    CHECK(std::abs(live.drift()) < 1e-3);
    for (const std::int64_t step : {250, 700, 0, 900}) {
      live.go_to(step);
      CHECK(std::abs(live.drift()) < 1e-3);
    }
    const auto& samples = live.account.samples();
    CHECK(std::ranges::is_sorted(samples, {}, &sim::EnergySample::step));
    CHECK(live.account.last_good() == -1);
  }
}

// Free particles keep their momentum until a hand changes it, and after a travel that is not
// forgotten.
TEST_CASE("momentum is judged until a hand has acted") {
  sim::SystemSpec pair = sim_test::make_row();
  pair.particles->pinned.clear();
  pair.particles->list[3].velocity = {0, 1, 0};
  Live live(pair);
  live.advance(50);
  CHECK(live.momentum() < 1e-10);
  live.go_to(20);
  live.advance(10);
  CHECK(live.momentum() < 1e-10);
  live.act({.what = What::kVelocity, .particle = 2, .x = {0, 0, 1}});
  live.advance(20);
  live.go_to(40);
  live.advance(20);
  CHECK(std::isnan(live.momentum()));
}
