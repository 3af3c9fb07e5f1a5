// The scenes of the project, and scene files as plain data.
#include "tests/lua/scene_text.h"

#include <cmath>

#include "core/scene/simulation.h"

using namespace sim;
using namespace sim::test;

TEST_CASE("circle.lua", "[lua][scenes]") {
  const SceneSpec spec = load("scenes/circle.lua");
  REQUIRE(spec.systems.size() == 1);
  CHECK_FALSE(spec.world);
  CHECK(spec.args.empty());
  const SystemSpec& circle = spec.systems[0];
  CHECK(circle.name == "circle");
  CHECK(circle.integrator.name == "trapezoid");
  CHECK(circle.dt == 0.01);
  CHECK(circle.duration == 10);
  CHECK_FALSE(circle.particles);
  REQUIRE(circle.first_order);
  CHECK(circle.first_order->dimension == 3);
  CHECK(circle.first_order->state == std::vector<double>{1, 0, 0});
  CHECK(circle.first_order->field.plugin == "rotation");
  REQUIRE(circle.exact);
  CHECK(circle.exact(2) == std::vector<double>{std::cos(2.0), std::sin(2.0), 0});
}

TEST_CASE("pendulum.lua", "[lua][scenes]") {
  const SystemSpec pendulum = load("scenes/pendulum.lua").systems[0];
  CHECK(pendulum.name == "pendulum");
  CHECK(pendulum.integrator.name == "rk4");
  CHECK(pendulum.dt == 0.005);
  CHECK(pendulum.duration == 10);
  REQUIRE(pendulum.particles);
  CHECK(pendulum.particles->count() == 4);
  CHECK(pendulum.particles->pinned == std::vector<int>{0});
  CHECK(pendulum.particles->at(3).position == Vec3(1.5, 0, 0));
  CHECK(pendulum.particles->at(3).mass == 1);
  REQUIRE(pendulum.forces.size() == 3);
  CHECK(std::get<Vec3>(pendulum.forces[0].given.at("g")) == Vec3(0, -9.81, 0));
  CHECK(std::get<double>(pendulum.forces[1].given.at("k")) == 0.5);
  const PartSpec& links = pendulum.forces[2];
  CHECK(links.plugin == "spring");
  CHECK(std::get<std::string>(links.given.at("family")) == "link");
  CHECK(std::get<std::int64_t>(links.given.at("stiffness")) == 200);
  CHECK(links.elements.ids == std::vector<int>{0, 1, 1, 2, 2, 3});
  CHECK(links.elements.values.empty());
  CHECK(load("scenes/pendulum.lua", {{"n", "7"}}).systems[0].particles->count() == 7);
}

TEST_CASE("damping of springs and of single ties", "[lua][scenes]") {
  const SystemSpec scene = load_text(R"(
local beads = sim.particles { mass = 1 }
for i = 0, 2 do beads:add { i, 0, 0 } end
local links = sim.force.spring { stiffness = 10, damping = 0.5 }
links:tie(0, 1):tie(1, 2, { damping = 2 })
return sim.scene { name = "beads", particles = beads, forces = { links },
  integrator = "verlet", dt = 0.01, duration = 1 })")
                               .systems[0];
  const PartSpec& links = scene.forces[0];
  CHECK(std::get<double>(links.given.at("damping")) == 0.5);
  const std::vector<double>& own = links.elements.values.at("damping");
  REQUIRE(own.size() == 2);
  CHECK(std::isnan(own[0]));
  CHECK(own[1] == 2);
}

TEST_CASE("cloth.lua", "[lua][scenes]") {
  const SceneSpec spec = load("scenes/cloth.lua");
  const SystemSpec& cloth = spec.systems[0];
  CHECK(cloth.integrator.name == "rk4");
  CHECK(cloth.dt == 0.005);
  CHECK(cloth.duration == 2);
  REQUIRE(cloth.particles);
  REQUIRE(cloth.particles->grid);
  CHECK(cloth.particles->list.empty());
  CHECK(cloth.particles->count() == 64);
  CHECK(cloth.particles->pinned == std::vector<int>{0, 7});
  CHECK(cloth.particles->at(12).position == Vec3(4.0 / 8, 0, 1.0 / 8));
  CHECK(cloth.particles->at(12).mass == 1.0 / 64);
  REQUIRE(cloth.forces.size() == 5);
  CHECK(std::get<double>(cloth.forces[1].given.at("k")) == 2.0 / 64);
  const std::size_t counts[] = {112, 98, 96};
  const double stiffness[] = {100, 50, 25};
  for (int i = 0; i < 3; ++i) {
    const PartSpec& force = cloth.forces[static_cast<std::size_t>(i) + 2];
    CHECK(force.elements.ids.empty());
    REQUIRE(force.elements.grids.size() == 2);
    CHECK(force.elements.count() == counts[i]);
    CHECK(static_cast<double>(std::get<std::int64_t>(force.given.at("stiffness"))) == stiffness[i]);
  }
  CHECK(cloth.forces[2].elements.grids[0].length == 0.125);
  CHECK(cloth.forces[3].elements.grids[1].length == std::sqrt(2.0 / 64));
  CHECK((cloth.forces[3].elements.grids[1].step == std::array<int, 3>{1, -1, 0}));
  CHECK(cloth.forces[4].elements.grids[1].length == 0.25);
  REQUIRE(spec.args.size() == 4);
  CHECK(spec.args[0].name == "n");
  CHECK(spec.args[0].doc == "particles a side");
  CHECK(std::get<double>(spec.args[0].default_value) == 8);

  for (const int n : {1, 2, 3, 17}) {
    const SystemSpec other = load("cloth", {{"n", std::to_string(n)}}).systems[0];
    const auto count = static_cast<std::size_t>(n);
    CHECK(other.forces[2].elements.count() == 2 * count * (count - 1));
    CHECK(other.forces[3].elements.count() == 2 * (count - 1) * (count - 1));
    CHECK(other.forces[4].elements.count() == (n < 2 ? 0 : 2 * count * (count - 2)));
  }
}

TEST_CASE("pendulum1.lua is one particle on a fixed point", "[lua][scenes]") {
  const SystemSpec pendulum = load("scenes/pendulum1").systems[0];
  CHECK(pendulum.particles->count() == 2);
  CHECK(pendulum.particles->pinned == std::vector<int>{0});
  CHECK(pendulum.forces.size() == 2);
  CHECK(load("scenes/pendulum1", {{"drag", "0.1"}}).systems[0].forces.size() == 3);
}

TEST_CASE("sample.lua holds the three systems in the order of their names", "[lua][scenes]") {
  const SceneSpec spec = load("scenes/sample.lua");
  CHECK(spec.world);
  REQUIRE(spec.systems.size() == 3);
  CHECK(spec.systems[0].name == "circle");
  CHECK(spec.systems[1].name == "cloth");
  CHECK(spec.systems[2].name == "pendulum");
  CHECK(spec.systems[0].first_order);
  CHECK(spec.systems[1].particles->count() == 64);
  CHECK(spec.systems[2].particles->count() == 4);
}

TEST_CASE("every scene of the project loads, compiles and steps", "[lua][scenes]") {
  const auto scenes = list_scenes(search_path());
  CHECK(scenes.size() >= 5);
  Registry registry({SIM_PLUGIN_DIR});
  for (const std::string& scene : scenes) {
    INFO(scene);
    for (const SystemSpec& system : load(scene).systems) {
      Simulation simulation(system, registry);
      CHECK(simulation.step());
    }
  }
}

TEST_CASE("scenes are found as given, without the ending, and below the search path",
          "[lua][scenes]") {
  const std::filesystem::path scripts = search_path()[0];
  const auto cloth = scripts / "scenes" / "cloth.lua";
  for (const char* name : {"scenes/cloth.lua", "scenes/cloth", "cloth", "cloth.lua"})
    CHECK(find_scene(name, search_path()) == cloth);
  const SceneFolder folder;
  const std::string own = folder.write("scenes/cloth.lua", "");
  CHECK(find_scene("cloth", {folder.path(), scripts}) == own);
  CHECK(find_scene(own, search_path()) == own);
  CHECK(find_scene(own.substr(0, own.size() - 4), search_path()) == own);
  CHECK(list_scenes({folder.path()}) == std::vector<std::string>{"scenes/cloth.lua"});
  CHECK(list_scenes({folder.path() / "missing"}).empty());
}

TEST_CASE("a required scene is a copy of its own", "[lua][scenes]") {
  const SceneFolder folder;
  folder.write("part.lua",
               "local sim = require 'sim'\n"
               "local particles = sim.particles {}\n"
               "particles:add { math.random(), 0, 0 }\n"
               "return sim.scene { particles = particles, forces = {}, integrator = 'rk4', "
               "dt = 0.1, duration = 1 }");
  const std::string world =
      folder.write("world.lua",
                   "local sim = require 'sim'\n"
                   "local before = math.random()\n"
                   "local a, b = require 'part', require 'part'\n"
                   "assert(a ~= b)\n"
                   "a.dt = 0.5\n"
                   "a.particles:add {5, 5, 5}\n"
                   "return sim.world { b = b, a = a, again = require 'part' }");
  const SceneSpec spec = load(world);
  REQUIRE(spec.systems.size() == 3);
  CHECK(spec.systems[0].dt == 0.5);
  CHECK(spec.systems[0].particles->count() == 2);
  CHECK(spec.systems[2].dt == 0.1);
  CHECK(spec.systems[2].particles->count() == 1);

  // The same random numbers in every copy, and when the scene is loaded by itself.
  const Vec3 alone =
      load((folder.path() / "part.lua").string()).systems[0].particles->at(0).position;
  for (const SystemSpec& system : spec.systems) CHECK(system.particles->at(0).position == alone);
}

TEST_CASE("one scene may stand in a world twice", "[lua][scenes]") {
  const SceneSpec spec =
      load_text("local s = require 'scenes.circle'\nreturn sim.world { left = s, right = s }");
  Registry registry({SIM_PLUGIN_DIR});
  Simulation left(spec.systems[0], registry), right(spec.systems[1], registry);
  REQUIRE(left.step());
  CHECK(left.hash() != right.hash());
  REQUIRE(right.step());
  CHECK(left.hash() == right.hash());
}

TEST_CASE("one table may describe two scenes", "[lua][scenes]") {
  const SceneSpec spec = load_text(
      "local t = { state = {1}, field = sim.field.lua { function(t, x) return x end }, "
      "integrator = 'rk4', dt = 1, duration = 1 }\n"
      "local a = sim.scene(t)\n"
      "t.dt = 2\n"
      "return sim.world { a = a, b = sim.scene(t) }");
  CHECK(spec.systems[0].dt == 1);
  CHECK(spec.systems[1].dt == 2);
}

TEST_CASE("particles keep what they are told", "[lua][scenes]") {
  const SystemSpec system =
      load_text(
          "local particles = sim.particles { mass = 2 }\n"
          "local v = {1, 2, 3}\n"
          "assert(particles:add(v) == 0)\n"
          "v[1] = 9\n"
          "assert(particles:add(v, { mass = 5, velocity = {0, 0, 7} }) == 1)\n"
          "assert(particles:add {0, 0, 0} == 2 and #particles == 3)\n"
          "particles:pin(2, 0.0, 2)\n"
          "local links = sim.force.spring { stiffness = 3, rest = 4 }\n"
          "links:tie(0, 1.0):tie(1, 2, { stiffness = 8 }):tie(0, 2, { rest = 0.5 })\n"
          "local forces = { links }\n" +
          kEnd)
          .systems[0];
  CHECK(system.particles->at(0).position == Vec3(1, 2, 3));
  CHECK(system.particles->at(0).mass == 2);
  CHECK(system.particles->at(0).velocity == Vec3(0, 0, 0));
  CHECK(system.particles->at(1).position == Vec3(9, 2, 3));
  CHECK(system.particles->at(1).mass == 5);
  CHECK(system.particles->at(1).velocity == Vec3(0, 0, 7));
  CHECK(system.particles->at(2).mass == 2);
  CHECK(system.particles->pinned == std::vector<int>{0, 2});
  Elements ties = system.forces[0].elements;
  CHECK(ties.ids == std::vector<int>{0, 1, 1, 2, 0, 2});
  REQUIRE((ties.values.size() == 2 && ties.values["rest"].size() == 3));
  CHECK(std::isnan(ties.values["stiffness"][0]));
  CHECK(ties.values["stiffness"][1] == 8);
  CHECK(std::isnan(ties.values["rest"][1]));
  CHECK(ties.values["rest"][2] == 0.5);
  CHECK(system.name == "scene");
  CHECK(system.forces[0].place.ends_with("scene.lua:9"));
}

TEST_CASE("a grid is passed on as a grid", "[lua][scenes]") {
  const SystemSpec system =
      load_text(
          "local particles = sim.grid { 3, 4, origin = {1, 2, 3}, du = {0, 0, 2}, dv = {1, 0, 0}, "
          "mass = 0.5 }\n"
          "assert(particles:id(2, 3) == 11 and particles:add {7, 7, 7} == 12 and #particles == "
          "13)\n"
          "local offsets = { {1, 2}, {-1, 2}, {0, 100} }\n"
          "local force = sim.force.spring { stiffness = 1, grid = particles, offsets = offsets }\n"
          "offsets[1][1] = 0\n"
          "force:tie(0, 12)\n"
          "local forces = { force }\n" +
          kEnd)
          .systems[0];
  REQUIRE(system.particles->grid);
  CHECK((system.particles->grid->size == std::array<int, 3>{3, 4, 1}));
  CHECK(system.particles->at(6).position == Vec3(3, 2, 5));
  CHECK(system.particles->at(6).mass == 0.5);
  CHECK(system.particles->at(12).position == Vec3(7, 7, 7));
  const auto& grids = system.forces[0].elements.grids;
  REQUIRE(grids.size() == 3);
  CHECK(grids[0].step[0] == 1);
  CHECK(grids[0].length == std::sqrt(8.0));
  CHECK(grids[1].step[0] == -1);
  CHECK(system.forces[0].elements.count() == 2 * 2 + 2 * 2 + 0 + 1);
}

TEST_CASE("rest lengths of a grid neither overflow nor vanish", "[lua][scenes]") {
  for (const double scale : {1e-200, 1e200}) {
    char du[64];
    std::snprintf(du, sizeof du, "{0, %g, 0}", scale);
    const std::string text = "local particles = sim.grid { 2, 2, du = " + std::string(du) +
                             ", dv = " + du +
                             " }\nlocal forces = { sim.force.spring { stiffness = 1, grid = "
                             "particles, offsets = { {1, 1} } } }\n" +
                             kEnd;
    const double rest = load_text(text).systems[0].forces[0].elements.grids[0].length;
    CHECK(rest == Approx(2 * scale).epsilon(1e-14));
  }
}

TEST_CASE("beam.lua and jelly_fem.lua", "[lua][scenes]") {
  const SystemSpec beam = load("scenes/beam.lua").systems[0];
  CHECK(beam.forces[0].elements.arity == 10);
  CHECK(beam.forces[0].elements.listed() == 60);
  CHECK(beam.particles->pinned.size() == 9);
  double mass = 0;
  for (int i = 0; i < beam.particles->count(); ++i) mass += beam.particles->at(i).mass;
  CHECK(mass == Approx(2).epsilon(1e-13));
  CHECK(load("scenes/beam.lua", {{"order", "1"}}).systems[0].forces[0].elements.arity == 4);

  const SystemSpec jelly = load("scenes/jelly_fem.lua").systems[0];
  CHECK(jelly.forces[2].elements.listed() == 6 * 5 * 5 * 5);
  CHECK(jelly.particles->pinned.size() == 36);
}

TEST_CASE("dam.lua and fountain.lua", "[lua][scenes]") {
  const SystemSpec dam = load("scenes/dam.lua").systems[0];
  CHECK(dam.particles->count() == 8 * 16 * 8);
  CHECK(dam.particles->at(0).mass == Approx(1000 * 0.025 * 0.025 * 0.025));
  REQUIRE(dam.forces[1].plugin == "fluid");
  CHECK(std::get<Colliders>(dam.forces[1].given.at("boundary")).size() == 1);
  CHECK(dam.forces[1].elements.listed() == 8 * 16 * 8);
  const SystemSpec flat = load("scenes/dam.lua", {{"depth", "0"}, {"layers", "10"}}).systems[0];
  CHECK(flat.particles->count() == 10 * 20);
  CHECK(flat.particles->at(7).position.z() == 0);

  // Each runs, and nothing leaves: whatever their parameters are.
  Registry registry({SIM_PLUGIN_DIR});  // outlives the colliders that it makes
  using Sets = std::map<std::string, std::string>;
  const auto loaded = [&](const std::string& file, const Sets& sets) {
    return load_scene(file, registry, {search_path(), sets, 0}).systems[0];
  };
  for (const Sets& sets : {Sets{{"layers", "3"}},
                           {{"layers", "1"}},
                           {{"layers", "4"}, {"depth", "0"}, {"alpha", "0"}},
                           {{"layers", "4"}, {"alpha", "2"}},
                           {{"layers", "3"}, {"length", "0.2"}},
                           {{"layers", "2"}, {"height", "2"}, {"length", "5"}}}) {
    Simulation water(loaded("scenes/dam.lua", sets), registry);
    for (int n = 0; n < 400; ++n) REQUIRE(water.step());
    for (int i = 0; i < water.particles(); ++i) CHECK(water.position(i).y() > -1e-12);
    CHECK(water.energy().kinetic < 1.2 * water.particles() * 9.81 * 2 * 1000);
  }
  for (const Sets& sets : {Sets{{"layers", "2"}, {"side", "0.3"}},
                           {{"layers", "3"}, {"jet", "2"}},
                           {{"layers", "2"}, {"side", "0.2"}, {"depth", "0.4"}}}) {
    Simulation water(loaded("scenes/fountain.lua", sets), registry);
    for (int n = 0; n < 300; ++n) REQUIRE(water.step());
    for (int i = 0; i < water.particles(); ++i) CHECK(water.position(i).y() > -1e-12);
  }
}

TEST_CASE("a fluid's boundary is a list of colliders", "[lua][scenes]") {
  const auto with = [](const std::string& boundary) {
    return "local p = sim.particles { mass = 1 }\np:add {0, 5, 0}\nlocal c = sim.collider.plane "
           "{}\n"
           "return sim.scene { particles = p, colliders = { c }, integrator = 'rk4', dt = 0.01, "
           "duration = 1, forces = { sim.force.fluid { boundary = " +
           boundary + " } } }\n";
  };
  const auto count = [&](const std::string& boundary) {
    return std::get<Colliders>(load_text(with(boundary)).systems[0].forces[0].given.at("boundary"))
        .size();
  };
  CHECK(count("{ c }") == 1);
  CHECK(count("{ c, sim.collider.sphere { radius = 1 } }") == 2);
  CHECK(count("{}") == 0);
  for (const std::string bad : {"{ 3 }", "{ c, p }", "{ a = c }"}) {
    try {
      load_text(with(bad));
      FAIL("accepted " << bad);
    } catch (const Error& error) {
      CHECK(std::string(error.what()).find("boundary") != std::string::npos);
    }
  }
}

TEST_CASE("float.lua floats as Archimedes says", "[lua][scenes]") {
  Registry registry({SIM_PLUGIN_DIR});
  const auto height = [&](const char* density) {
    const SystemSpec spec =
        load("scenes/float.lua", {{"layers", "4"}, {"density", density}, {"height", "0"}})
            .systems[0];
    Simulation system(spec, registry);
    const int block = system.particles() - 64;
    double sum = 0;
    int looks = 0;
    while (system.t() < 1.5) {
      REQUIRE(system.step());
      if (system.t() < 0.9 || system.step_count() % 20 != 0) continue;
      ++looks;
      for (int i = block; i < system.particles(); ++i) sum += system.position(i).y() / 64;
    }
    return sum / looks;
  };
  // `density`/1000 of the block is below the level, which it lifts. Particles are 5 cm apart.
  const double light = height("300"), heavy = height("700");
  CHECK(light == Approx(0.355).margin(0.03));
  CHECK(heavy == Approx(0.295).margin(0.03));
  CHECK(light - heavy == Approx(0.06).margin(0.006));
}

TEST_CASE("every word of a look is read, alone and as a list", "[lua][scenes]") {
  const auto look = [](const std::string& words) {
    return load_text(
               "local p = sim.grid { 3, 3, du = {1, 0, 0}, dv = {0, 1, 0}, mass = 1 }\n"
               "return sim.scene { particles = p, forces = { sim.force.spring { family = "
               "'edge', stiffness = 1, grid = p, offsets = { {0, 1} } } }, integrator = "
               "'rk4', dt = 0.01, duration = 1, look = { " +
               words + " } }")
        .systems[0]
        .look;
  };
  using Words = std::vector<std::string>;
  CHECK(look("").empty());
  CHECK(look("trail = 4").trails == Words{"4"});
  CHECK(look("trail = 'none'").trails == Words{"none"});
  CHECK(look("trail = {1, 8, 2}").trails == Words{"1", "8", "2"});
  CHECK(look("springs = 'edge'").springs == Words{"edge"});
  CHECK(look("springs = {3, 'edge'}").springs == Words{"3", "edge"});
  CHECK(look("color = 'speed:2'").color == "speed:2");
  CHECK(look("size = '320x200'").size == "320x200");
  CHECK(look("wireframe = true").wireframe);
  CHECK(look("wireframe = false").empty());
  CHECK(look("surface = true").surface);
  CHECK(look("eye = {1, 2, 3}, up = {0, 0, 1}, fov = 50").camera == "eye=1,2,3 up=0,0,1 fov=50");
  CHECK(contains(text_error("local p = sim.particles { mass = 1 }\np:add {0, 0, 0}\nreturn "
                            "sim.scene { particles = p, forces = {}, integrator = 'rk4', dt = "
                            "0.01, duration = 1, look = { trail = {} , wireframe = 1 } }")
                     ->what(),
                 "bad wireframe of look"));
}
