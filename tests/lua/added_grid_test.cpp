// Scenes with several grids.
#include "core/picture/model.h"
#include "tests/lua/scene_text.h"

namespace {

using namespace sim;
using namespace sim::test;

// `grid` makes the particles `p` and the grid `g`; a block of cells stands behind two cloths.
std::string sheet(const std::string& grid) {
  return grid +
         "\np:pin(g:id(0, 0), g:id(0, 3))\n"
         "return sim.scene { particles = p, surfaces = { sim.surface { grid = g } },\n"
         "  forces = { sim.force.gravity {}, sim.force.wind { surface = sim.surface { grid = g } "
         "},\n"
         "    sim.force.spring { stiffness = 50, grid = g, offsets = { {0, 1}, {1, 0}, {1, -1} } "
         "},\n"
         "    sim.force.expression { '-3*r', grid = g, offsets = { {0, 2} } } },\n"
         "  constraints = { sim.constraint.distance { grid = g, offsets = { {0, 3} } },\n"
         "    sim.constraint.on_plane { particles = { g:id(2, 2) }, normal = {0, 0, 1},\n"
         "      point = {0, 0, 0.2} } },\n"
         "  integrator = 'verlet', dt = 0.002, duration = 0.1 }\n";
}

const std::string kSize = "4, 4, origin = {0.1, 0, 0}, du = {0, 0, 0.1}, dv = {0.1, 0, 0.03}";

std::vector<Vec3> places_after(const std::string& text, int from) {
  TextRun run(text, "verlet", 0.002);
  run.run_to(0.1);
  std::vector<Vec3> list;
  for (int i = from; i < run.system.particles(); ++i) list.push_back(run.system.position(i));
  return list;
}

}  // namespace

TEST_CASE("a grid that is added to a list moves as a grid of its own", "[lua]") {
  const auto alone =
      places_after(sheet("local p = sim.grid { " + kSize + ", mass = 0.02 }\nlocal g = p"), 0);
  CHECK(places_after(sheet("local p = sim.particles { mass = 0.02 }\nlocal g = p:add_grid { " +
                           kSize + " }"),
                     0) == alone);
  // Behind a grid and a particle, which nothing ties to it.
  const auto behind =
      places_after(sheet("local p = sim.grid { 2, 2, du = {1, 0, 0}, dv = {0, 1, 0} }\n"
                         "p:add { 5, 5, 5 }\nlocal g = p:add_grid { " +
                         kSize + ", mass = 0.02 }"),
                   5);
  REQUIRE(behind.size() == alone.size());
  for (std::size_t i = 0; i < alone.size(); ++i) CHECK((behind[i] - alone[i]).norm() < 1e-12);
}

TEST_CASE("one force acts in many grids", "[lua]") {
  const auto scene = [](const std::string& forces) {
    return "local p = sim.particles {}\nlocal list = {}\nfor i = 1, 3 do\n"
           "  list[i] = p:add_grid { 2 + i, 3, origin = {0, i, 0}, du = {0, 0, 1}, dv = {1, 0, 0} "
           "}\n"
           "end\np:pin(0, list[3]:id(0, 0))\nlocal forces = { sim.force.gravity {} }\n" +
           forces +
           "\nreturn sim.scene { particles = p, forces = forces, integrator = 'verlet', "
           "dt = 0.01, duration = 1 }\n";
  };
  TextRun one(scene("forces[2] = sim.force.spring { stiffness = 9, grid = list, "
                    "offsets = { {0, 1}, {1, 1} } }"),
              "verlet", 0.01);
  TextRun many(
      scene("for i = 1, 3 do forces[i + 1] = sim.force.spring { stiffness = 9, grid = list[i], "
            "offsets = { {0, 1}, {1, 1} } } end"),
      "verlet", 0.01);
  one.run_to(0.5);
  many.run_to(0.5);
  CHECK((one.system.position(8) - Vec3(2, 1, 2)).norm() > 0.1);
  for (int i = 0; i < one.system.particles(); ++i)
    CHECK((one.system.position(i) - many.system.position(i)).norm() < 1e-12);

  const ParticlesSpec& particles = *one.spec.systems.front().particles;
  CHECK(particles.grid_of(13)->at(13) == std::array{1, 1, 0});
  // Sheets of all of them.
  CHECK(make_model(one.spec.systems.front(), one.system).triangles.size() == 2 * 2 * (2 + 3 + 4));
}

TEST_CASE("cells fill a grid that is added, and forces act on its particles alone", "[lua]") {
  const SystemSpec spec =
      load_text(
          "local p = sim.grid { 3, 3, du = {1, 0, 0}, dv = {0, 0, 1} }\n"
          "local block = p:add_grid { 2, 2, 2, du = {1, 0, 0}, dv = {0, 1, 0}, dw = {0, 0, 1} }\n"
          "block:pin(block:id(0, 0, 0))\n"
          "block:prescribe(block:id(1, 1, 1), function(t) return {1, 1 + t, 1} end)\n"
          "return sim.scene { particles = p, integrator = 'verlet', dt = 0.01, duration = 1,\n"
          "  forces = { sim.force.gravity { particles = block },\n"
          "    sim.force.spring { stiffness = 1, grid = p, offsets = { {0, 1} } },\n"
          "    sim.force.fem { cells = sim.cells { grid = block }, young = 1e4, poisson = 0.3,\n"
          "      density = 9 } } }\n")
          .systems.front();
  CHECK(spec.forces[0].particles == std::vector<int>{9, 10, 11, 12, 13, 14, 15, 16});
  CHECK(std::ranges::minmax(spec.forces[2].elements.ids).min == 9);
  CHECK(std::ranges::minmax(spec.forces[2].elements.ids).max == 16);
  CHECK(spec.particles->pinned == std::vector<int>{9, 16});
  Registry registry({SIM_PLUGIN_DIR});
  Simulation system(spec, registry);
  // The skin of the block, and the sheet.
  CHECK(make_model(spec, system).triangles.size() == 12 + 8);
}

TEST_CASE("cells move wherever their particles stand in a list", "[lua]") {
  const auto block = [](const std::string& before) {
    return before +
           "local g = p:add_grid { 3, 3, 3, du = {1, 0, 0}, dv = {0, 1, 0}, dw = {0, 0, 1} }\n"
           "p:pin(g:id(0, 0, 0), g:id(0, 2, 0), g:id(0, 0, 2))\n"
           "return sim.scene { particles = p, integrator = 'verlet', dt = 0.002, duration = 1,\n"
           "  forces = { sim.force.gravity { particles = g }, sim.force.fem { young = 300, \n"
           "    cells = sim.cells { grid = g }, poisson = 0.3, density = 2 } } }\n";
  };
  const auto alone = places_after(block("local p = sim.particles {}\n"), 0);
  CHECK((alone[26] - Vec3(2, 2, 2)).norm() > 1e-3);
  CHECK(places_after(block("local p = sim.particles {}\nfor i = 1, 13 do p:add { i, 9, 9 } end\n"),
                     13) == alone);
}

TEST_CASE("a grid that is added wrongly is named", "[lua][errors]") {
  const std::string grid = "{ 2, 2, du = {1, 0, 0}, dv = {0, 1, 0} }";
  const std::string added = "local p = sim.particles {}\nlocal g = p:add_grid " + grid + "\n";
  const auto scene = [](const std::string& with) {
    return "return sim.scene { forces = { sim.force.gravity {} }, integrator = 'rk4', dt = 1, "
           "duration = 1, " +
           with + " }";
  };
  const auto spring = [&](const std::string& of) {
    return scene("particles = p, forces = { sim.force.spring { offsets = { {0, 1} }, grid = " + of +
                 " } }");
  };
  const struct {
    std::string text, says;
  } cases[] = {
      {added + scene("particles = g"), "give the particles that it was added to"},
      {added + "g.id(0, 0)", "it was not called on what :add_grid returned"},
      {added + "g:id(2, 0)", "from 0 to 1, got 2"},
      {added + "g:add {0, 0, 0}", "unknown name 'add'"},
      {added + "p.add_grid " + grid, "write it with a colon"},
      {added + "p:add_grid { 2, 2, du = {1, 0, 0}, dv = {0, 1, 0}, orign = {} }", "'origin'"},
      {added + "p:add_grid { 2, 2 }", "bad du"},
      {added + "p:add_grid { 2, 2, du = {1e308, 0, 0}, dv = {1e308, 0, 0} }\n" +
           scene("particles = p"),
       "not at a finite place"},
      {added + "local q = sim.particles {}\nq:add {0, 0, 0}\n" + spring("q"),
       "not the particles of"},
      {added + spring("{ g, g }"), "entry 2 is a grid before it"},
      {added + spring("{ g, 5 }"), "expected a sim.grid, got 5"},
      {added + spring("p"), "got a sim.particles"},
      {added + "local q = sim.particles {}\nlocal h = q:add_grid " + grid + "\n" + spring("h"),
       "not the particles of this scene"},
  };
  for (const auto& each : cases) {
    CAPTURE(each.text);
    CHECK_THAT(said(each.text), Catch::Contains(each.says));
  }
}
