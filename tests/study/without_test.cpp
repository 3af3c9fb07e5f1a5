// Parts that are left out of scenes and worlds, and switches that are off.
#include "core/study/without.h"

#include <catch2/catch.hpp>

#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::study;
using Catch::Contains;
using Names = std::vector<std::string>;

namespace {

// Two systems with gravity, springs of two families and drag; the second has no drag.
SceneSpec scene(bool world) {
  SceneSpec spec;
  spec.world = world;
  for (const char* name : {"left", "right"}) {
    SystemSpec& system = spec.systems.emplace_back(sim_test::make_falling(1, 0));
    system.name = name;
    system.forces = {sim_test::make_gravity(), sim_test::make_springs("edge", 10),
                     sim_test::make_springs("fold", 1)};
    if (std::string(name) == "left") system.forces.push_back(sim_test::make_drag(1));
    system.colliders = {sim_test::make_part("plane")};
    if (!world) break;
  }
  return spec;
}

Names parts_of(const SystemSpec& system) {
  Names names;
  for (const PartSpec& part : system.forces) names.push_back(part.plugin);
  for (const PartSpec& part : system.colliders) names.push_back(part.plugin);
  return names;
}

}  // namespace

TEST_CASE("a part is left out by its name or its family, and nothing else") {
  const auto left = [](const std::string& name) {
    SceneSpec spec = scene(false);
    leave_out(name, spec);
    return parts_of(spec.systems[0]);
  };
  CHECK(left("gravity") == Names{"spring", "spring", "drag", "plane"});
  CHECK(left("drag") == Names{"gravity", "spring", "spring", "plane"});
  CHECK(left("plane") == Names{"gravity", "spring", "spring", "drag"});
  SceneSpec spec = scene(false);
  leave_out("edge", spec);
  CHECK(parts_of(spec.systems[0]) == Names{"gravity", "spring", "drag", "plane"});
  CHECK_THROWS_WITH(leave_out("edge", spec), Contains("--without edge"));
  CHECK_NOTHROW(leave_out("fold", spec));
  CHECK_THROWS_WITH(left("gravty"),
                    Contains("--without gravty") && Contains("did you mean 'gravity'?"));
  CHECK_THROWS_WITH(left("left.gravity"), Contains("nothing to leave out"));
  CHECK_THROWS_WITH(left("xxxxxxxx"), Contains("known: drag, edge, fold, gravity, plane, spring") &&
                                          !Contains("left."));
}

TEST_CASE("in a world a part is left out of all systems, or of the one that is named") {
  SceneSpec all = scene(true);
  leave_out("gravity", all);
  CHECK(parts_of(all.systems[0]) == Names{"spring", "spring", "drag", "plane"});
  CHECK(parts_of(all.systems[1]) == Names{"spring", "spring", "plane"});
  SceneSpec one = scene(true);
  leave_out("right.gravity", one);
  CHECK(parts_of(one.systems[0]) == Names{"gravity", "spring", "spring", "drag", "plane"});
  CHECK(parts_of(one.systems[1]) == Names{"spring", "spring", "plane"});
  leave_out("drag", one);  // one has it
  CHECK(parts_of(one.systems[0]) == Names{"gravity", "spring", "spring", "plane"});
  CHECK_THROWS_WITH(leave_out("right.drag", one), Contains("--without right.drag"));
  CHECK_THROWS_WITH(leave_out("left.gravty", one), Contains("did you mean 'left.gravity'?"));
}

TEST_CASE("a switch that is off turns off all of its parts") {
  SceneSpec spec = scene(true);
  spec.systems[0].forces[0].switch_name = "weight";
  spec.systems[1].forces[0].switch_name = "weight";
  spec.systems[1].colliders[0].switch_name = "floor";
  turn_off("weight", spec);
  for (const SystemSpec& system : spec.systems) {
    CHECK_FALSE(system.forces[0].on);
    CHECK((system.forces[1].on && system.forces[2].on && system.colliders[0].on));
  }
  turn_off("floor", spec);
  CHECK_FALSE(spec.systems[1].colliders[0].on);
  CHECK_THROWS_WITH(turn_off("flor", spec),
                    Contains("--off flor") && Contains("did you mean 'floor'?"));
  SceneSpec none = scene(false);
  CHECK_THROWS_WITH(turn_off("", none), Contains("it names them in switches"));
}
