// Parts that join points of bodies are of nodes, all others of particles as before.
#include "core/scene/body_attachments.h"

#include <catch2/catch.hpp>

#include "core/geometry/rigid_shape.h"
#include "core/particles/rigid/rigid_body.h"
#include "tests/lua/scene_text.h"

using namespace sim;

TEST_CASE("only parts with points of bodies are of nodes") {
  // A box of 2 x 2 x 2 m and 8 kg, whose four particles are 5 to 8; points 9 and 10.
  RigidShape shape;
  shape.form = RigidShape::Form::kBox;
  shape.half = {1, 1, 1};
  const std::vector<RigidBody> bodies{RigidBody(std::make_shared<RigidShape>(shape), 8, 5)};
  SystemSpec spec;
  constexpr int kParticles = 9;
  const auto of = [](std::vector<int> ids) {
    Elements elements;
    elements.ids = std::move(ids);
    return elements;
  };
  const Elements plain = of({0, 3, 3, 8});
  {
    const BodyAttachments without(plain, spec, bodies, kParticles);
    CHECK((&without.elements == &plain && without.nodes.empty()));
    CHECK(without.count == kParticles);
  }
  spec.points = {{.body = 0, .at = {1, 0, 0}}, {.body = 0, .at = {0, -0.5, 0.25}}};
  {
    const BodyAttachments particles(plain, spec, bodies, kParticles);
    CHECK((&particles.elements == &plain && particles.nodes.empty()));
    CHECK(particles.count == kParticles);
  }
  // Nodes come in the order in which they are named, each once.
  Elements mixed = of({3, 10, 10, 9, 3, 0});
  mixed.carried["m"] = {1, 2, 3};
  const BodyAttachments joined(mixed, spec, bodies, kParticles);
  CHECK(&joined.elements == &joined.own);
  CHECK(joined.own.carried.empty());  // numbers of particles
  CHECK(joined.own.ids == std::vector<int>{0, 1, 1, 2, 0, 3});
  CHECK(joined.count == 4);
  REQUIRE(joined.nodes.size() == 4);
  for (const auto& [node, particle] : {std::pair(0u, 3), {3u, 0}}) {
    CHECK(joined.nodes[node].count == 1);
    CHECK(joined.nodes[node].ids[0] == particle);
    CHECK(joined.nodes[node].weights[0] == 1);
  }
  for (const auto& [node, point] : {std::pair(1u, 1u), {2u, 0u}}) {
    CHECK(joined.nodes[node].count == 4);
    CHECK(joined.nodes[node].ids == std::array<int, 4>{5, 6, 7, 8});
    CHECK(joined.nodes[node].weights == bodies[0].weights(spec.points[point].at));
  }
  // The last point, the first, one beyond the last, which is left to others where it is alone.
  CHECK(BodyAttachments(of({0, 10}), spec, bodies, kParticles).count == 2);
  CHECK(BodyAttachments(of({0, 9}), spec, bodies, kParticles).count == 2);
  CHECK(BodyAttachments(of({0, 8}), spec, bodies, kParticles).nodes.empty());
  CHECK(BodyAttachments(of({0, 11}), spec, bodies, kParticles).nodes.empty());
  CHECK_THROWS_WITH(BodyAttachments(of({9, 11}), spec, bodies, kParticles),
                    Catch::Contains("a point of a body: it does not exist"));
  Elements grid = of({0, 9});
  grid.cells = true;
  CHECK_THROWS_WITH(BodyAttachments(grid, spec, bodies, kParticles),
                    Catch::Contains("not joined by grids or cells"));
}
