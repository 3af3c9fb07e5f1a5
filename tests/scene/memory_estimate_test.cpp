// Memory that a scene will take: what counts, and that it counts in proportion.
#include "core/scene/memory_estimate.h"

#include <catch2/catch.hpp>

#include "core/geometry/triangle_mesh.h"
#include "tests/support/scenes.h"

using namespace sim;

namespace {

double part(const MemoryEstimate& estimate, const std::string& name) {
  for (const auto& [each, bytes] : estimate.parts)
    if (each == name) return bytes;
  return 0;
}

}  // namespace

TEST_CASE("files of frames take a model each, one more while they are made, and frames") {
  const SystemSpec cloth = sim_test::make_cloth(20);
  const MemoryEstimate none = memory_estimate_of_files(cloth, 0),
                       one = memory_estimate_of_files(cloth, 1),
                       three = memory_estimate_of_files(cloth, 3);
  CHECK(none.parts.empty());
  CHECK(none.total() == 0);
  const double model = part(one, "models of the scene");
  CHECK(model > 0);
  CHECK(part(three, "models of the scene") == 2 * model);
  CHECK(part(three, "frames") == part(one, "frames"));
  CHECK(one.total() == model + part(one, "frames"));
  // Four times the particles.
  const MemoryEstimate four = memory_estimate_of_files(sim_test::make_cloth(40), 1);
  CHECK(part(four, "frames") == 4 * part(one, "frames"));
  CHECK(part(four, "models of the scene") == Approx(4 * model).epsilon(0.1));
  // A state without particles is small.
  CHECK(memory_estimate_of_files(sim_test::make_circle(), 3).parts.empty());
}

TEST_CASE("files that have no room are refused at the place of the system") {
  SystemSpec cloth = sim_test::make_cloth(20);
  cloth.place = "scene.lua:7";
  require_room_for_files(cloth, 3);
  try {
    require_room_for_files(cloth, 2'000'000'000);
    FAIL("no machine has so much");
  } catch (const Error& error) {
    CHECK(error.kind() == ErrorKind::kIo);
    CHECK(error.text().what == "too little memory");
    CHECK(error.text().where == "scene.lua:7");
    CHECK(error.text().why.starts_with("the files of '" + cloth.name + "' need "));
    CHECK(error.text().remedy == "write fewer of them in one run");
  }
}

TEST_CASE("stages, ties and implicit vectors count where they are") {
  Registry registry = sim_test::make_registry();
  const SystemSpec cloth = sim_test::make_cloth(20);
  const auto of = [&](const IntegratorInfo& info) {
    return memory_estimate(cloth, info, registry);
  };
  const MemoryEstimate plain = of({.evaluations = 1}), four = of({.evaluations = 4}),
                       adaptive = of({.evaluations = 4, .adaptive = true}),
                       implicit = of({.evaluations = 4, .implicit = true});
  CHECK(part(plain, "particles") == part(implicit, "particles"));
  CHECK(part(four, "the method") == 4 * part(plain, "the method"));
  CHECK(part(adaptive, "the method") > 10 * part(four, "the method"));
  CHECK(part(implicit, "the method") > part(adaptive, "the method"));
  CHECK(part(implicit, "their derivatives") > 0);
  CHECK(part(four, "their derivatives") == 0);
  CHECK(part(implicit, "vectors of GMRES") == 0);
  CHECK(part(plain, "constraints") == 0);
  CHECK(plain.total() > 0);
}

// All is counted in proportion; constants are measured, and stand in the estimate alone.
TEST_CASE("each part of a scene counts by its number, and nothing else does") {
  Registry registry = sim_test::make_registry();
  const IntegratorInfo verlet{.evaluations = 1}, implicit{.evaluations = 1, .implicit = true};
  const auto of = [&](const SystemSpec& spec, const IntegratorInfo& info) {
    return memory_estimate(spec, info, registry);
  };
  const auto row = [](int n, std::size_t springs, std::size_t rods) {
    SystemSpec spec;
    spec.particles.emplace();
    for (int i = 0; i < n; ++i) spec.particles->list.push_back({.position = Vec3(i, 0, 0)});
    spec.forces = {sim_test::make_gravity(), sim_test::make_springs("edge", 10)};
    for (std::size_t i = 0; i < 2 * springs; ++i) spec.forces[1].elements.ids.push_back(int(i));
    spec.forces[1].elements.arity = 2;
    spec.constraints = {sim_test::make_part("distance"), sim_test::make_part("plane")};
    for (std::size_t i = 0; i < 2 * rods; ++i) spec.constraints[0].elements.ids.push_back(int(i));
    spec.constraints[0].elements.arity = 2;
    if (rods == 0) spec.constraints.clear();
    return spec;
  };
  const char* const ties = "springs and other ties";
  const MemoryEstimate one = of(row(100, 10, 10), implicit);
  REQUIRE(part(one, "particles") >= 100 * (sizeof(double) * 12 + sizeof(ParticleSpec)) * 0.9);
  CHECK(part(of(row(300, 10, 10), implicit), "particles") == 3 * part(one, "particles"));
  CHECK(part(of(row(300, 10, 10), implicit), "the method") == 3 * part(one, "the method"));
  CHECK(part(of(row(300, 10, 10), implicit), "vectors of GMRES") ==
        3 * part(one, "vectors of GMRES"));
  CHECK(part(of(row(300, 10, 10), implicit), ties) == part(one, ties));
  CHECK(part(of(row(100, 30, 10), implicit), ties) == 3 * part(one, ties));
  CHECK(part(of(row(100, 30, 10), implicit), "their derivatives") ==
        3 * part(one, "their derivatives"));
  CHECK(part(of(row(100, 10, 30), implicit), "constraints") == 3 * part(one, "constraints"));
  for (const char* const each : {ties, "their derivatives", "constraints", "vectors of GMRES"}) {
    CHECK(part(one, each) > 0);
    CHECK(part(of(row(100, 0, 0), implicit), each) == 0);
  }
  CHECK(part(of(row(100, 10, 10), verlet), "vectors of GMRES") == 0);
  // A method that does not say its evaluations has none.
  CHECK(part(of(row(100, 0, 0), {.evaluations = -1}), "the method") == 0);
  CHECK(part(of(row(100, 0, 0), implicit), "the method") ==
        part(of(row(100, 0, 0), {.evaluations = 9, .implicit = true}), "the method"));
  // Places of a grid are not listed, and neither are its springs; pieces of a solid have memory of
  // their own.
  const SystemSpec grid = sim_test::make_cloth(10);
  CHECK(part(of(grid, verlet), "particles") < part(one, "particles"));
  CHECK(part(of(grid, verlet), ties) == 0);
  CHECK(part(of(grid, implicit), "their derivatives") > 0);
  SystemSpec solid = row(100, 10, 0);
  const double as_springs = part(of(solid, verlet), ties);
  solid.forces[1].plugin = "solid";
  CHECK(part(of(solid, verlet), ties) - as_springs ==
        Approx(10 * registry.get<Force>("solid", {}).element_bytes));
  CHECK(registry.get<Force>("solid", {}).element_bytes > 0);
}

TEST_CASE("components count by their number, and contact by the triangles that may meet") {
  Registry registry = sim_test::make_registry();
  SystemSpec circle = sim_test::make_circle();
  const MemoryEstimate three = memory_estimate(circle, {}, registry);
  REQUIRE(three.parts.size() == 1);
  const std::size_t before = circle.first_order->state.size();
  CHECK(three.total() >= static_cast<double>(2 * sizeof(double) * before));
  circle.first_order->state.resize(5 * before);
  CHECK(memory_estimate(circle, {}, registry).total() == 5 * three.total());

  SystemSpec cloth = sim_test::make_cloth(4);
  CHECK(part(memory_estimate(cloth, {}, registry), "contact") == 0);
  cloth.contact.emplace(ContactSpec{.plugin = "surfaces"});
  double last = 0;
  for (const int triangles : {5, 12, 1}) {
    std::vector<TriangleMesh::Triangle> list;
    for (int i = 0; i < triangles; ++i) list.push_back({3 * i, 3 * i + 1, 3 * i + 2});
    cloth.contact->surfaces.push_back(std::make_shared<TriangleMesh>(3 * triangles, list));
    last += triangles * registry.get<StepCorrection>("surfaces", {}).element_bytes;
    CHECK(part(memory_estimate(cloth, {}, registry), "contact") == Approx(last));
  }
  CHECK(last > 0);
}

TEST_CASE("an estimate names its largest parts first and leaves out what does not matter") {
  const MemoryEstimate estimate{{{"a", 2e6}, {"b", 1e4}, {"c", 7e6}, {"d", 2e5}}};
  CHECK(estimate.total() == 9.21e6);
  CHECK(estimate.text() == "c 7 MB, a 2 MB, d 1 MB");
}

TEST_CASE("surfaces in contact take memory for each triangle, of bodies that touch them, too") {
  Registry registry = sim_test::make_registry();
  SystemSpec cloth = sim_test::make_cloth(20);
  cloth.contact.emplace();
  cloth.contact->plugin = "surfaces";
  const auto contact = [&] {
    return part(memory_estimate(cloth, sim_test::info_of("verlet", registry), registry), "contact");
  };
  CHECK(contact() == 0);
  const std::vector<TriangleMesh::Triangle> triangles = grid_triangles({20, 20, 1}, false);
  cloth.contact->surfaces.push_back(std::make_shared<const TriangleMesh>(400, triangles));
  const double each = contact() / static_cast<double>(triangles.size());
  CHECK(each > 100);
  RigidShape box{.form = RigidShape::Form::kBox, .half = {0.1, 0.1, 0.1}}, ball{.radius = 0.1};
  for (const RigidShape& shape : {box, ball, make_compound({box, ball}), mesh_of(box)})
    cloth.bodies.push_back({.shape = std::make_shared<const RigidShape>(shape), .mass = 1});
  CHECK(contact() == Approx(each * (static_cast<double>(triangles.size()) + 12 + 1 + 13 + 12)));
  for (RigidSpec& body : cloth.bodies) body.touches = false;
  CHECK(contact() == each * static_cast<double>(triangles.size()));
}
