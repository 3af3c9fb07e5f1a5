// At the extremes every verdict is right: never trusted and wrong.
#include "plugins/studies/extremes/extreme_cells.h"

#include <catch2/catch.hpp>

#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::Trust;

TEST_CASE("no integrator is trusted and wrong at any extreme") {
  sim::Registry registry = make_registry();
  const auto all =
      sim::study::extremes(registry, {}, [](std::string_view, double) { return true; });
  CHECK(all.complete);
  CHECK(all.maps.size() >= 8);
  for (const auto& map : all.maps) {
    int trusted = 0, wrong = 0;
    for (const auto& cell : map.cells) {
      trusted += cell.run && cell.trust == Trust::kTrusted;
      wrong += cell.silently_wrong();
      if (!cell.silently_wrong()) continue;
      UNSCOPED_INFO(map.method.name << " k " << cell.stiffness << " m " << cell.mass << " dt "
                                    << cell.dt << " offset " << cell.offset << " off by "
                                    << cell.error << ": " << cell.reason);
    }
    INFO(map.method.name << ": " << trusted << " trusted");
    CHECK(wrong == 0);
    CHECK(trusted > 50);
  }
}

TEST_CASE("the map knows where a method is stable, and that nothing moves in no time") {
  sim::Registry registry = make_registry();
  const auto all =
      sim::study::extremes(registry, {{"rk4"}}, [](std::string_view, double) { return true; });
  for (const auto& cell : all.maps.front().cells) {
    const double h_omega = cell.dt * std::sqrt(cell.stiffness / cell.mass);
    INFO("k " << cell.stiffness << " m " << cell.mass << " dt " << cell.dt << ": " << cell.reason);
    if (h_omega > 10) CHECK(cell.trust == Trust::kDiverged);
    if (h_omega < 0.1 && cell.offset == 0) CHECK(cell.trust == Trust::kTrusted);
  }
}
