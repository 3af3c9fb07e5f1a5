// Elements of a scene: ties of any arity, grids of three directions, surfaces, groups.
#include <cmath>

#include "core/geometry/triangle_mesh.h"
#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

const std::string kBlock =
    "local particles = sim.grid { 3, 2, 4, origin = {1, 0, 0}, du = {0.5, 0, 0}, dv = {0, 2, 0}, "
    "dw = {0, 0, 1}, mass = 3 }\n";

std::shared_ptr<const TriangleMesh> surface_of(const PartSpec& force) {
  return std::get<std::shared_ptr<const TriangleMesh>>(force.given.at("surface"));
}

}  // namespace

TEST_CASE("a grid of three directions has its ids layer by layer", "[lua][elements]") {
  const SystemSpec system =
      load_text(kBlock +
                "assert(particles:id(2, 1, 3) == (2 * 2 + 1) * 4 + 3 and #particles == 24)\n"
                "particles:pin(particles:id(0, 0, 0), particles:id(1, 1, 2))\n"
                "local forces = { sim.force.spring { stiffness = 1, grid = particles, offsets = { "
                "{0, 0, 1}, {1, -1, 2}, {-1, 0, 0}, {0, 7, 0} } } }\n" +
                kEnd)
          .systems[0];
  REQUIRE(system.particles->grid);
  CHECK((system.particles->grid->size == std::array<int, 3>{3, 2, 4}));
  CHECK(system.particles->count() == 24);
  CHECK(system.particles->pinned == std::vector<int>{0, 14});
  CHECK(system.particles->at(14).position == Vec3(1.5, 2, 2));
  CHECK(system.particles->at(23).position == Vec3(2, 2, 3));
  CHECK(system.particles->at(23).mass == 3);
  const Elements& springs = system.forces[0].elements;
  REQUIRE(springs.grids.size() == 4);
  CHECK(springs.ids.empty());
  CHECK(springs.grids[1].length == std::sqrt(0.25 + 4 + 4));
  CHECK(springs.count() == 3 * 2 * 3 + 2 * 1 * 2 + 2 * 2 * 4 + 0);

  // One by one, as the offsets say.
  std::size_t count = 0;
  springs.for_each([&](const Element& tie) {
    const Vec3 d =
        system.particles->at(tie.ids[1]).position - system.particles->at(tie.ids[0]).position;
    CHECK(d.norm() == tie.length);
    ++count;
  });
  CHECK(count == springs.count());
}

TEST_CASE("offsets have as many directions as their grid", "[lua][elements]") {
  const auto says = [](const std::string& offsets, const std::string& what) {
    const auto error = text_error(kBlock + "local forces = { sim.force.spring { stiffness = 1, " +
                                  "grid = particles, offsets = " + offsets + " } }\n" + kEnd);
    REQUIRE(error);
    INFO(error->what());
    CHECK(contains(error->what(), what));
    CHECK(error->text().where == "scene.lua:3");
  };
  says("{ {0, 1} }", "expected {di, dj, dk}");
  says("{ {0, 0, 0} }", "to itself");
  says("{ {0, 1, 2}, {0, -1, -2} }", "before it");
  says("{ {0, 1, 0.5} }", "whole numbers {di, dj, dk}");
  // The one that is wrong is named by its place in the list.
  says("{ {0, 0, 0} }", "offset 1");
  says("{ {0, 1, 2}, {1, 0, 0}, {0, -1, -2} }", "bad offset 3");
  says("{ {1, 0, 0}, {0, 1, 0.5} }", "offset 2");
}

TEST_CASE("ties come one by one or as a list, with numbers of their own", "[lua][elements]") {
  const std::string first =
      "local particles = sim.particles()\nfor i = 0, 4 do particles:add {i, 0, 0} end\n";
  const Elements listed =
      load_text(first +
                "local forces = { sim.force.spring { stiffness = 5, ties = { {0, 1}, {1, 2, rest = "
                "3}, {4, 2, stiffness = 7, rest = 0} } }:tie(3, 4) }\n" +
                kEnd)
          .systems[0]
          .forces[0]
          .elements;
  CHECK(listed.arity == 2);
  CHECK(listed.ids == std::vector<int>{0, 1, 1, 2, 4, 2, 3, 4});
  const std::vector<double>& rest = listed.values.at("rest");
  REQUIRE(rest.size() == 4);
  CHECK((std::isnan(rest[0]) && rest[1] == 3 && rest[2] == 0 && std::isnan(rest[3])));
  CHECK(listed.values.at("stiffness")[2] == 7);
}

TEST_CASE("a force of a plugin joins as many particles as it says", "[lua][elements]") {
  Registry registry({SIM_PLUGIN_DIR});
  registry.load(std::string(SIM_FIXTURE_DIR) + "/angle/angle.so");
  const auto compile = [&](const std::string& force) {
    const SceneFolder folder;
    const std::string file =
        folder.write("scene.lua",
                     "local sim = require 'sim'\nlocal particles = sim.particles()\n"
                     "for i = 0, 4 do particles:add {i * i, 0, 0} end\nlocal forces = { " +
                         force + " }\n" + kEnd);
    const SceneSpec spec = load_scene(file, registry, {search_path(), {}, 0});
    return Simulation(spec.systems[0], registry);
  };
  // x = 0, 1, 4, 9, 16: every second difference is 2.
  CHECK(compile("sim.force.angle { k = 3, ties = { {0, 1, 2} } }").energy().potential == 1.5 * 4);
  CHECK(compile("sim.force.angle { k = 3 }:tie(0, 1, 2, { k = 5 }):tie(1, 2, 3)")
            .energy()
            .potential == 2.5 * 4 + 1.5 * 4);
  CHECK(compile("sim.force.angle { k = 1, bow = 1 }:tie(0, 1, 2, { bow = 2 }):tie(2, 3, 4)")
            .energy()
            .potential == 0.5);

  const auto refuses = [&](const std::string& force, const std::string& why) {
    INFO(force);
    CHECK_THROWS_WITH(compile(force), Catch::Contains(why));
  };
  refuses("sim.force.angle { k = 1 }:tie(0, 1)", "joins 3 particles by each, not 2");
  refuses("sim.force.angle { k = 1 }:tie(0, 1, 2, 3)", "joins 3 particles by each, not 4");
  refuses("sim.force.angle {}:tie(0, 1, 2, { k = 1 }):tie(0, 1, 3)", "missing 'k'");
  refuses("sim.force.angle { k = 1 }:tie(0, 1, 2, { bov = 1 })", "did you mean 'bow'?");
  refuses("sim.force.angle { k = 1, grid = 3, offsets = {} }", "no parameter 'grid'");
}

TEST_CASE("a surface is the sheet or the boundary of a grid, or listed", "[lua][elements]") {
  const SystemSpec block =
      load_text(kBlock +
                "local skin = sim.surface { grid = particles }\n"
                "local forces = { sim.force.pressure { surface = skin, pressure = 2 },\n"
                "  sim.force.bending { surface = skin, stiffness = 1 } }\n" +
                kEnd)
          .systems[0];
  REQUIRE(block.surfaces.size() == 1);
  CHECK(surface_of(block.forces[0]) == block.surfaces[0]);
  CHECK(surface_of(block.forces[1]) == block.surfaces[0]);
  CHECK(block.surfaces[0]->closed());
  CHECK(block.surfaces[0]->triangles().size() == 2 * 2 * (2 * 1 + 1 * 3 + 3 * 2));

  // Potential -p V of the block of 1 x 2 x 3 m, whichever way round its directions are.
  Registry registry({SIM_PLUGIN_DIR});
  const auto energy = [&](SystemSpec spec) {
    spec.forces.resize(1);
    return Simulation(spec, registry).energy().potential;
  };
  CHECK(energy(block) == Approx(-12).epsilon(1e-14));
  const SystemSpec mirrored =
      load_text(
          "local particles = sim.grid { 2, 2, 2, du = {0, 0, 1}, dv = {0, 1, 0}, dw = {1, 0, 0} }\n"
          "local forces = { sim.force.pressure { surface = sim.surface { grid = particles }, "
          "pressure = 2 } }\n" +
          kEnd)
          .systems[0];
  CHECK(energy(mirrored) == Approx(-2).epsilon(1e-14));

  const SystemSpec listed =
      load_text(
          "local particles = sim.particles()\nlocal a, b, c = {0, 0, 0}, {1, 0, 0}, {0, 1, 0}\n"
          "particles:add(a) particles:add(b) particles:add(c)\n"
          "return sim.scene { particles = particles, forces = {}, surfaces = { sim.surface { "
          "particles = particles, triangles = { {0, 1, 2} } } }, integrator = 'rk4', dt = 0.1, "
          "duration = 1 }\n")
          .systems[0];
  REQUIRE(listed.surfaces.size() == 1);
  CHECK((listed.surfaces[0]->triangles()[0] == TriangleMesh::Triangle{0, 1, 2}));
}

TEST_CASE("surfaces that a scene cannot have", "[lua][elements]") {
  const struct {
    const char* surface;
    const char* says;
  } cases[] = {
      {"sim.surface {}", "either grid, or particles and triangles"},
      {"sim.surface { grid = particles, triangles = {} }", "either grid"},
      {"sim.surface { particles = particles }", "either grid"},
      {"sim.surface { gird = particles }", "did you mean 'grid'?"},
      {"sim.surface { grid = 3 }", "expected a sim.grid, got 3"},
      {"sim.surface { grid = sim.particles() }", "expected a sim.grid"},
      {"sim.surface { grid = sim.grid { 2, 2, du = {1, 0, 0}, dv = {0, 1, 0} } }",
       "not the particles of this scene"},
      {"sim.surface { particles = particles, triangles = 3 }", "expected a list"},
      {"sim.surface { particles = particles, triangles = { 3 } }", "three ids"},
      {"sim.surface { particles = particles, triangles = { {0, 1} } }", "three ids"},
      {"sim.surface { particles = particles, triangles = { {0, 1, 2.5} } }", "whole number"},
      {"sim.surface { particles = particles, triangles = {} }", "it has no triangle"},
      {"sim.surface { particles = particles, triangles = { {0, 1, 24} } }", "no particle 24"},
      {"sim.surface { particles = particles, triangles = { {0, 1, 1} } }", "a particle twice"},
      {"sim.surface { particles = particles, triangles = { {0, 1, 4}, {0, 1, 5} } }",
       "same direction"},
      {"sim.surface { particles = particles, triangles = { {0, 1, 4}, {1, 0, 2} } }",
       "bad triangle 2 of a surface"},
      {"sim.force.gravity {}", "expected a sim.surface"},
  };
  for (const auto& [surface, says] : cases) {
    const auto error =
        text_error(kBlock + "local skin = " + surface +
                   "\nreturn sim.scene { particles = particles, forces = {}, surfaces = { skin }, "
                   "integrator = 'rk4', dt = 1, duration = 1 }\n");
    INFO(surface);
    REQUIRE(error);
    INFO(error->what());
    CHECK(error->kind() == ErrorKind::kScene);
    CHECK(contains(error->what(), says));
    CHECK(contains(error->text().where, contains(says, "expected a sim.surface") ? ":4" : ":3"));
  }
}

TEST_CASE("a force may be kept to some particles", "[lua][elements]") {
  const SystemSpec system =
      load_text(
          "local particles = sim.particles()\nfor i = 0, 4 do particles:add {i, 0, 0} end\n"
          "local forces = { sim.force.gravity { g = {0, -1, 0}, particles = {3, 1, 3} },\n"
          "  sim.force.drag { k = 1, particles = particles }, sim.force.drag { k = 1, particles = "
          "{} } }\n" +
          kEnd)
          .systems[0];
  CHECK(system.forces[0].particles == std::vector<int>{1, 3});
  CHECK_FALSE(system.forces[1].particles);
  CHECK(system.forces[2].particles == std::vector<int>{});
}

TEST_CASE("cells fill a grid, or are listed, and density weighs their particles",
          "[lua][elements]") {
  const std::string bar =
      "local particles = sim.grid { 5, 3, 3, du = {1, 0, 0}, dv = {0, 1, 0}, dw = {0, 0, 1} }\n";
  const auto solid = [](const std::string& cells) {
    return "local forces = { sim.force.fem { young = 10, density = 3, cells = sim.cells {" + cells +
           "} } }\n" + kEnd;
  };
  const SystemSpec linear = load_text(bar + solid("grid = particles")).systems[0];
  CHECK(linear.forces[0].elements.cells);
  CHECK(linear.forces[0].elements.arity == 4);
  CHECK(linear.forces[0].elements.listed() == 6 * 4 * 2 * 2);
  const SystemSpec quadratic = load_text(bar + solid("grid = particles, order = 2")).systems[0];
  CHECK(quadratic.forces[0].elements.arity == 10);
  CHECK(quadratic.forces[0].elements.listed() == 6 * 2);
  for (const SystemSpec* spec : {&linear, &quadratic}) {
    double mass = 0;
    for (int i = 0; i < 45; ++i) mass += spec->particles->at(i).mass;
    CHECK(mass == Approx(3 * 16).epsilon(1e-14));
  }
  const std::string corners =
      "local particles = sim.particles()\nparticles:add {0, 0, 0} particles:add {1, 0, 0}\n"
      "particles:add {0, 1, 0} particles:add {0, 0, 1}\n";
  const SystemSpec one =
      load_text(corners + solid("particles = particles, tetrahedra = { {0, 1, 2, 3} }")).systems[0];
  CHECK(one.forces[0].elements.ids == std::vector<int>{0, 1, 2, 3});
  CHECK(one.particles->at(3).mass == Approx(3.0 / 24).epsilon(1e-14));
  // Without a density particles have masses of their own; a tie is a cell, too.
  const SystemSpec tied =
      load_text(corners + "local body = sim.force.fem { young = 1 }\nbody:tie(3, 2, 1, 0)\n" +
                "local forces = { body }\n" + kEnd)
          .systems[0];
  CHECK(tied.forces[0].elements.ids == std::vector<int>{3, 2, 1, 0});
  CHECK(tied.particles->at(3).mass == 1);
}

TEST_CASE("cells that a scene cannot have", "[lua][elements]") {
  const struct {
    const char* cells;
    const char* says;
  } cases[] = {
      {"sim.cells {}", "either grid, or particles and tetrahedra"},
      {"sim.cells { grid = particles, tetrahedra = {} }", "either grid"},
      {"sim.cells { grid = 3 }", "expected a sim.grid of three directions, got 3"},
      {"sim.cells { grid = sim.grid { 2, 2, du = {1, 0, 0}, dv = {0, 1, 0} } }",
       "three directions"},
      {"sim.cells { grid = particles, order = 3 }", "order of sim.cells"},
      {"sim.cells { grid = particles, order = 2 }", "an odd number"},
      {"sim.cells { particles = particles, tetrahedra = {} }", "expected a list"},
      {"sim.cells { particles = particles, tetrahedra = { {0, 1, 2} } }", "four ids"},
      {"sim.cells { particles = particles, tetrahedra = { {0, 1, 2, 1.5} } }", "whole number"},
      {"sim.cells { particles = particles, tetrahedra = { {0, 1, 2, 99} } }", "no particle 99"},
      {"sim.cells { particles = particles, tetrahedra = { {0, 1, 2, 2} } }", "different particles"},
      {"sim.cells { particles = particles, tetrahedra = { {0, 0, 1, 2} } }", "different particles"},
      {"sim.cells { grid = sim.grid { 2, 2, 2, du = {1, 0, 0}, dv = {0, 1, 0}, dw = {0, 0, 1} } }",
       "not the particles of this scene"},
      {"3", "expected a sim.cells"},
  };
  for (const auto& [cells, says] : cases) {
    const auto error = text_error(
        kBlock + "local forces = { sim.force.fem { young = 1, cells = " + cells + " } }\n" + kEnd);
    INFO(cells);
    REQUIRE(error);
    INFO(error->what());
    CHECK(error->kind() == ErrorKind::kScene);
    CHECK(contains(error->what(), says));
  }
  const std::string grid =
      "{ 2, 2, 2, du = {1, 0, 0}, dv = {0, 1, 0}, dw = {0, 0, 1}, mass = 2 }\n";
  const auto twice =
      text_error("local particles = sim.grid " + grid +
                 "local forces = { sim.force.fem { young = 1, density = 1, cells = sim.cells { "
                 "grid = particles } } }\n" +
                 kEnd);
  REQUIRE(twice);
  CHECK(contains(twice->what(), "a mass of its own"));
}
