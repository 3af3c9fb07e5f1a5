// Runs side by side against the same runs alone, bit by bit.
#include "core/session/side_by_side.h"

#include <memory>

#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

std::string lorenz(double r, const std::string& integrator = "rk4") {
  return "return sim.scene { name = 'lorenz', state = { 1, " + std::to_string(r / 30) +
         ", 1 }, field = sim.field.formula { '10*(y - x)', 'x*(r - z) - y', 'x*y - 8/3*z', names = "
         "{'x', 'y', 'z'}, r = " +
         std::to_string(r) + " }, integrator = '" + integrator + "', dt = 0.01, duration = 10 }";
}

void take(Simulation& run, int count) {
  const std::int64_t end = run.step_count() + count;
  while (run.step_count() < end) REQUIRE(run.steps(end - run.step_count()) > 0);
}

}  // namespace

TEST_CASE("runs side by side have the bits of runs alone, whatever each is asked for") {
  std::vector<std::unique_ptr<TextRun>> runs, alone;
  std::vector<Simulation*> systems;
  for (int i = 0; i < 11; ++i) {
    runs.push_back(std::make_unique<TextRun>(lorenz(20.5 + i), "", 0.01));
    alone.push_back(std::make_unique<TextRun>(lorenz(20.5 + i), "", 0.01));
    systems.push_back(&runs.back()->system);
    CHECK(may_step_side_by_side(*systems.back()));
  }
  REQUIRE(step_side_by_side(systems));
  for (std::size_t i = 0; i < runs.size(); ++i) {
    Simulation &one = runs[i]->system, &other = alone[i]->system;
    for (const int count : {1, 7, 8, 300, 3, 64}) {
      take(one, count);
      take(other, count);
      CHECK(one.hash() == other.hash());
      // A look at another step, and back.
      const Snapshot here = one.snapshot();
      take(one, 5);
      one.restore(here);
    }
    // A changed state goes its own way, also back at a state of before.
    const Snapshot here = one.snapshot();
    for (Simulation* const run : {&one, &other}) {
      run->set_component(0, 3);
      take(*run, 20);
    }
    CHECK(one.hash() == other.hash());
    one.restore(here);
    other.restore(here);
    one.set_dt(0.005);
    other.set_dt(0.005);
    take(one, 40);
    take(other, 40);
    CHECK(one.hash() == other.hash());
  }
}

TEST_CASE("runs that differ in more than numbers, or choose their steps, go alone") {
  TextRun first(lorenz(28), "", 0.01), pair(lorenz(28, "dopri5"), "", 0.01);
  TextRun other(
      "return sim.scene { name = 'decay', state = { 1, 1, 1 }, field = sim.field.formula { '-x', "
      "'-y', '-z', names = {'x', 'y', 'z'} }, integrator = 'rk4', dt = 0.01, duration = 1 }",
      "", 0.01);
  CHECK_FALSE(may_step_side_by_side(pair.system));
  Simulation* const different[] = {&first.system, &other.system};
  CHECK_FALSE(step_side_by_side(different));
  Simulation* const adaptive[] = {&first.system, &pair.system};
  CHECK_FALSE(step_side_by_side(adaptive));
  Simulation* const single[] = {&first.system};
  CHECK_FALSE(step_side_by_side(single));
}
