// Every mistake in a scene: its line, what was expected, and the nearest name that exists.
#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

struct Broken {
  const char* text;   // its first line is line 2 of the file
  const char* where;  // place expected
  const char* says;   // part of the error expected
};

void check_all(std::initializer_list<Broken> cases) {
  for (const Broken& broken : cases) {
    INFO(broken.text);
    const auto error = text_error(broken.text);
    REQUIRE(error);
    INFO(error->what());
    CHECK(error->kind() == ErrorKind::kScene);
    CHECK(error->text().where == broken.where);
    CHECK(contains(error->what(), broken.says));
  }
}

void check_scenes(std::initializer_list<Broken> cases) {
  for (const Broken& broken : cases) {
    const std::string text =
        std::string(
            "local particles = sim.particles { mass = 1 }\n"
            "particles:add {0, 0, 0}\nparticles:add {1, 0, 0}\n"
            "local grid = sim.grid { 2, 3, du = {0, 0, 1}, dv = {1, 0, 0} }\n") +
        broken.text;
    check_all({{text.c_str(), broken.where, broken.says}});
  }
}

}  // namespace

TEST_CASE("names that do not exist", "[lua][errors]") {
  check_all({
      {"local c = sim.collider.plane { }\nc.point = 1", "scene.lua:3",
       "cannot set 'point' of sim.collider"},
      {"return sim.scen {}", "scene.lua:2", "did you mean 'scene'?"},
      {"\nlocal p = sim.partciles {}", "scene.lua:3", "did you mean 'particles'?"},
      {"sim.extra = 1", "scene.lua:2", "cannot set 'sim.extra'"},
      {"local k = stifness", "scene.lua:2", "unknown name 'stifness'"},
      {"local k = maht.pi", "scene.lua:2", "did you mean 'math'?"},
      {"local p = sim.particles { mas = 1 }", "scene.lua:2", "did you mean 'mass'?"},
      {"sim.particles():ad {0, 0, 0}", "scene.lua:2", "did you mean 'add'?"},
      {"local p = sim.particles()\np.mass = 3", "scene.lua:3", "cannot set 'mass'"},
      {"sim.particles():add({0, 0, 0}, { velocty = {0, 0, 1} })", "scene.lua:2",
       "did you mean 'velocity'?"},
      {"local f = sim.force.spring {}\nf:tye(0, 1)", "scene.lua:3", "did you mean 'tie'?"},
      {"local g = sim.grid { 2, 2, du = {1, 0, 0}, dv = {0, 1, 0}, orgin = {0, 0, 0} }",
       "scene.lua:2", "did you mean 'origin'?"},
      {"return sim.scene {\n  nam = 'x' }", "scene.lua:2", "did you mean 'name'?"},
      {"local scene = sim.scene\nlocal s = scene { durration = 1 }\nreturn s", "scene.lua:3",
       "did you mean 'duration'?"},
  });
}

TEST_CASE("particles with bad values", "[lua][errors]") {
  check_all({
      {"sim.particles { mass = 0 }", "scene.lua:2", "> 0 kg, got 0"},
      {"sim.particles { mass = 1/0 }", "scene.lua:2", "got inf"},
      {"sim.particles { mass = '1' }", "scene.lua:2", "got '1'"},
      {"sim.particles(3)", "scene.lua:2", "expected a table, got 3"},
      {"sim.particles():add {0, 0}", "scene.lua:2", "expected a vector"},
      {"sim.particles():add {0, 0, 0, 0}", "scene.lua:2", "4 entries"},
      {"sim.particles():add {0, 0, 0, mass = 2}", "scene.lua:2", "4 entries"},
      {"sim.particles():add {0, 0/0, 0}", "scene.lua:2", "got nan"},
      {"sim.particles():add {0, '1', 0}", "scene.lua:2", "got '1'"},
      {"sim.particles():add(1, 2, 3)", "scene.lua:2", "got 1"},
      {"sim.particles():add()", "scene.lua:2", "got nothing"},
      {"sim.particles():add({0, 0, 0}, 5)", "scene.lua:2", "got 5"},
      {"sim.particles():add({0, 0, 0}, { mass = -1 })", "scene.lua:2", "got -1"},
      {"sim.particles():add({0, 0, 0}, { velocity = {1, 2} })", "scene.lua:2", "velocity"},
      {"sim.particles().add {0, 0, 0}", "scene.lua:2", "write it with a colon"},
      {"sim.particles():pin()", "scene.lua:2", "at least one"},
      {"sim.particles():pin(-1)", "scene.lua:2", "got -1"},
      {"sim.particles():pin(0.5)", "scene.lua:2", "got 0.5"},
      {"sim.particles():pin({0})", "scene.lua:2", "got a table"},
      {"sim.particles():pin(1e300)", "scene.lua:2", "got 1e+300"},
      {"sim.particles():id(0, 0)", "scene.lua:2", "no rows"},
      {"sim.grid { 2 }", "scene.lua:2", "number of columns"},
      {"sim.grid { 0, 2, du = {1, 0, 0}, dv = {1, 0, 0} }", "scene.lua:2", "from 1 to"},
      {"sim.grid { 2, 2, dv = {1, 0, 0} }", "scene.lua:2", "bad du"},
      {"sim.grid { 1e9, 1e9, du = {1, 0, 0}, dv = {1, 0, 0} }", "scene.lua:2",
       "too many particles"},
      {"sim.grid { 2, 2, du = {1, 0, 0}, dv = {1, 0, 0} }:id(2, 0)", "scene.lua:2", "from 0 to 1"},
      {"sim.force.spring {}:tie(1, 1)", "scene.lua:2", "tied to itself"},
      {"sim.force.spring {}:tie(0, -1)", "scene.lua:2", "got -1"},
      {"sim.force.spring {}:tie(0)", "scene.lua:2", "got nothing"},
      {"sim.force.spring {}:tie(0, '1')", "scene.lua:2", "got '1'"},
      {"sim.force.spring {}:tie(0, 1, 2, 3, 4)", "scene.lua:2", "expected a table"},
      {"sim.force.spring {}:tie(0, 1, 2, 1)", "scene.lua:2", "particle 1 is tied to itself"},
      {"sim.force.spring {}:tie(0, 1):tie(0, 1, 2)", "scene.lua:2", "those before it 2"},
      {"sim.force.spring { ties = 3 }", "scene.lua:2", "expected a list"},
      {"sim.force.spring { ties = { 3 } }", "scene.lua:2", "bad tie 1"},
      {"sim.force.spring { ties = { {0} } }", "scene.lua:2", "got nothing"},
      {"sim.force.spring { ties = { {0, 1, rest = 'a'} } }", "scene.lua:2", "bad rest of a tie"},
      {"sim.grid { 2, 2, 0, du = {1, 0, 0}, dv = {0, 1, 0} }", "scene.lua:2", "number of layers"},
      {"sim.grid { 2, 2, 2, du = {1, 0, 0}, dv = {0, 1, 0} }", "scene.lua:2", "bad dw"},
      {"sim.grid { 2, 2, du = {1, 0, 0}, dv = {0, 1, 0}, dw = {0, 0, 1} }", "scene.lua:2",
       "give three numbers"},
      {"sim.grid { 9e4, 9e4, 9e4, du = {1, 0, 0}, dv = {0, 1, 0}, dw = {0, 0, 1} }", "scene.lua:2",
       "more than 2^31 - 1"},
      {"sim.grid { 2, 2, 2, du = {1, 0, 0}, dv = {0, 1, 0}, dw = {0, 0, 1} }:id(1, 1)",
       "scene.lua:2", "bad layer of id"},
      {"sim.grid { 2, 2, du = {1, 0, 0}, dv = {1, 0, 0} }:id(1, 1, 1)", "scene.lua:2",
       "two coordinates"},
      {"sim.force.spring {}:tie(0, 1, { stiffness = 0/0 })", "scene.lua:2", "got nan"},
      {"sim.force.spring {}.tie(0, 1)", "scene.lua:2", "write it with a colon"},
      {"sim.force.spring(5)", "scene.lua:2", "expected a table of parameters, got 5"},
      {"sim.force.spring(sim.particles())", "scene.lua:2", "expected a table of parameters"},
  });
}

TEST_CASE("a list of particles that does not fit its pins, ties or machine", "[lua][errors]") {
  check_scenes({
      {"particles:pin(0)\nparticles:pin(2)\nlocal forces = {}\n"
       "return sim.scene { particles = particles, forces = forces, integrator = 'rk4', dt = 1, "
       "duration = 1 }",
       "scene.lua:7", "there is no particle 2; the ids of the scene are 0 to 1"},
      {"local f = sim.force.spring { stiffness = 1 }\nf:tie(0, 1)\nf:tie(1, 2)\n"
       "return sim.scene { particles = particles, forces = { f }, integrator = 'rk4', dt = 1, "
       "duration = 1 }",
       "scene.lua:8", "there is no particle 2"},
      {"local big = sim.grid { 46000, 46000, du = {0, 0, 1}, dv = {1, 0, 0} }\n"
       "return sim.scene { particles = big, forces = {}, integrator = 'rk4', dt = 1, "
       "duration = 1 }",
       "scene.lua:6", "too many particles"},
      {"local far = sim.grid { 3, 2, du = {1e308, 0, 0}, dv = {1, 0, 0} }\n"
       "return sim.scene { particles = far, forces = {}, integrator = 'rk4', dt = 1, "
       "duration = 1 }",
       "scene.lua:6", "not at a finite place"},
      {"return sim.scene { particles = sim.particles(), forces = {}, integrator = 'rk4', dt = 1, "
       "duration = 1 }",
       "scene.lua:6", "no particles"},
  });
}

TEST_CASE("forces that a scene cannot use", "[lua][errors]") {
  const struct {
    const char* force;
    const char* says;
  } cases[] = {
      {"sim.force.sprng {}", "did you mean 'spring'?"},
      {"sim.force.gravity", "write sim.force.NAME"},
      {"sim.force.gravity { gg = {0, 0, 0} }", "did you mean 'g'?"},
      {"sim.force.gravity { g = {0, 0} }", "got 2 values"},
      {"sim.force.gravity { g = {0, 0, 0/0} }", "got nan"},
      {"sim.force.gravity { g = 9.81 }", "vector"},
      {"sim.force.gravity { {0, 0, 0} }", "every parameter has a name"},
      {"sim.force.expression { [2] = 'x' }", "every parameter has a name, found the key 2"},
      {"sim.force.expression { [0] = 'x' }", "every parameter has a name, found the key 0"},
      {"sim.force.expression { [-1] = 'x' }", "every parameter has a name, found the key -1"},
      {"sim.force.expression { [1.5] = 'x' }", "every parameter has a name, found the key 1.5"},
      {"sim.force.expression { [true] = 'x' }", "every parameter has a name, found the key true"},
      {"sim.force.gravity { grid = grid, offsets = { {0, 1} } }", "no parameter 'grid'"},
      {"sim.force.drag { k = -1 }", "at least 0"},
      {"sim.force.drag { k = print }", "got a function"},
      {"sim.force.drag { k = 'x' }", "number"},
      {"sim.force.gravity {}:tie(0, 1)", "takes no ties"},
      {"sim.force.spring { stifness = 1 }", "did you mean 'stiffness'?"},
      {"sim.force.spring { stiffness = -1 }", "at least 0"},
      {"sim.force.spring { stiffness = 1/0 }", "got inf"},
      {"sim.force.spring { stiffness = 1, damping = -1 }", "at least 0"},
      {"sim.force.spring { family = 3 }", "text"},
      {"sim.force.spring {}:tie(0, 1, { stifness = 2 })", "did you mean 'stiffness'?"},
      {"sim.force.spring {}:tie(0, 1, { family = 2 })", "unknown key 'family'"},
      {"sim.force.spring { stiffness = 1 }:tie(0, 1, { rest = -1 })", "at least 0"},
      {"sim.force.spring { stiffness = 1 }:tie(0, 1, { damping = -1 })", "at least 0"},
      {"sim.force.spring { stiffness = 1 }:tie(0, 1, 2)", "joins 2 particles by each, not 3"},
      {"sim.force.spring { stiffness = 1, ties = { {0, 6} } }", "no particle 6"},
      {"sim.force.spring { stiffness = 1, particles = {0} }", "no parameter 'particles'"},
      {"sim.force.drag { k = 1, particles = 3 }", "expected a list, got 3"},
      {"sim.force.drag { k = 1, particles = {0, 6} }", "no particle 6"},
      {"sim.force.drag { k = 1, particles = {0, 0.5} }", "no particle 0.5"},
      {"sim.force.drag { k = 1, particles = particles }", "not the particles"},
      {"sim.force.drag { k = 1, particles = sim.force.drag { k = 1 } }", "got a sim.force"},
      {"sim.force.drag { k = sim.surface { grid = grid } }", "k is a surface; give a number"},
      {"sim.force.drag { k = grid }", "expected a value or a sim.surface, got a sim.particles"},
      {"sim.force.pressure { pressure = 1, surface = {1, 2, 3} }", "give a surface"},
      {"sim.force.spring {}:tie(0, 1)", "missing 'stiffness'"},
      {"sim.force.spring {}:tie(0, 1, { stiffness = 1 }):tie(1, 2)", "missing 'stiffness'"},
      {"sim.force.spring { grid = grid, offsets = { {0, 1} } }", "missing 'stiffness'"},
      {"sim.force.spring { grid = grid }", "missing 'offsets'"},
      {"sim.force.spring { offsets = { {0, 1} } }", "missing 'grid'"},
      {"sim.force.spring { grid = particles, offsets = { {0, 1} } }", "not the particles"},
      {"sim.force.spring { grid = 5, offsets = { {0, 1} } }", "expected a sim.grid"},
      {"sim.force.spring { grid = grid, offsets = {} }", "empty"},
      {"sim.force.spring { grid = grid, offsets = { {0, 0} } }", "to itself"},
      {"sim.force.spring { grid = grid, offsets = { {0, 0.5} } }", "whole numbers"},
      {"sim.force.spring { grid = grid, offsets = { {0, 1e10} } }", "whole numbers"},
      {"sim.force.spring { grid = grid, offsets = { {1} } }", "expected {di, dj}"},
      {"sim.force.spring { grid = grid, offsets = { {1, 0, 0} } }", "expected {di, dj}"},
      {"sim.force.spring { grid = grid, offsets = { {} } }", "expected {di, dj}"},
      {"sim.force.spring { grid = grid, offsets = { 1 } }", "{di, dj}"},
      {"sim.force.spring { grid = grid, offsets = 1 }", "expected a list"},
      {"sim.force.spring { grid = grid, offsets = { x = {0, 1} } }", "without names"},
      {"sim.force.spring { grid = grid, offsets = { {0, 1}, {0, -1} } }", "before it"},
      {"sim.field.rotation {}", "got a sim.field"},
      {"grid", "got a sim.particles"},
      {"'gravity'", "got 'gravity'"},
  };
  for (const auto& [force, says] : cases) {
    const std::string text = "local force = " + std::string(force) +
                             "\nreturn sim.scene { particles = grid, forces = { force }, "
                             "integrator = 'rk4', dt = 1, duration = 1 }";
    const bool part = contains(force, "sim.force.") && std::string(force).back() != 'y';
    check_scenes({{text.c_str(), part ? "scene.lua:6" : "scene.lua:7", says}});
  }
}

TEST_CASE("scene entries that are missing, wrong or of two kinds", "[lua][errors]") {
  const std::string good = "particles = particles, forces = {}, ";
  const std::string field = "field = sim.field.rotation {}, ";
  const struct {
    std::string entries;
    const char* says;
  } cases[] = {
      {good + "dt = 1, duration = 1", "missing 'integrator'"},
      {good + "integrator = 'rk4', duration = 1", "missing 'dt'"},
      {good + "integrator = 'rk4', dt = 1", "missing 'duration'"},
      {good + "integrator = 'rk44', dt = 1, duration = 1", "did you mean 'rk4'?"},
      {good + "integrator = 4, dt = 1, duration = 1", "got 4"},
      {good + "integrator = 'rk4', dt = 0, duration = 1", "> 0 s, got 0"},
      {good + "integrator = 'rk4', dt = 0/0, duration = 1", "got nan"},
      {good + "integrator = 'rk4', dt = '1', duration = 1", "got '1'"},
      {good + "integrator = 'rk4', dt = 1, duration = -1", ">= 0 s, got -1"},
      {good + "integrator = 'rk4', dt = 1, duration = 1, name = 'a,b'", "bad name"},
      {good + "integrator = 'rk4', dt = 1, duration = 1, name = {}", "bad name"},
      {good + "integrator = 'rk4', dt = 1, duration = 1, exact = 5", "function(t)"},
      {good + "integrator = 'rk4', dt = 1, duration = 1, 5", "found the key 1"},
      {good + field + "integrator = 'rk4', dt = 1, duration = 1", "particles and field"},
      {"integrator = 'rk4', dt = 1, duration = 1", "neither particles nor state"},
      {"particles = particles, integrator = 'rk4', dt = 1, duration = 1", "missing 'forces'"},
      {"forces = {}, integrator = 'rk4', dt = 1, duration = 1", "missing 'particles'"},
      {"particles = {}, forces = {}, integrator = 'rk4', dt = 1, duration = 1", "bad particles"},
      {"particles = particles, forces = sim.force.gravity {}, integrator = 'rk4', dt = 1, "
       "duration = 1",
       "expected a list, got a sim.force"},
      {"particles = particles, forces = { nil, 1 }, integrator = 'rk4', dt = 1, duration = 1",
       "hole"},
      {"state = {1}, integrator = 'rk4', dt = 1, duration = 1", "missing 'field'"},
      {field + "integrator = 'rk4', dt = 1, duration = 1", "missing 'state'"},
      {field + "state = {}, integrator = 'rk4', dt = 1, duration = 1", "empty"},
      {field + "state = 1, integrator = 'rk4', dt = 1, duration = 1", "got 1"},
      {field + "state = { 1, '2' }, integrator = 'rk4', dt = 1, duration = 1", "entry 2"},
      {field + "state = { 1, 2, v = 3 }, integrator = 'rk4', dt = 1, duration = 1", "key 'v'"},
      {field + "state = { y = {{1, 0, 0}} }, integrator = 'rk4', dt = 1, duration = 1", "'y'"},
      {field + "state = { x = {{1, 0}} }, integrator = 'rk4', dt = 1, duration = 1", "2 values"},
      {field + "state = { x = {{1, 0, 1/0}} }, integrator = 'rk4', dt = 1, duration = 1",
       "got inf"},
      {field + "state = particles, integrator = 'rk4', dt = 1, duration = 1",
       "got a sim.particles"},
      {"state = {1}, field = sim.field.lua { 5 }, integrator = 'rk4', dt = 1, duration = 1",
       "function"},
      {"state = {1}, field = sim.field.lua {}, integrator = 'rk4', dt = 1, duration = 1",
       "'f' is missing"},
      {"state = {1}, field = sim.field.rotaton {}, integrator = 'rk4', dt = 1, duration = 1",
       "did you mean 'rotation'?"},
      {"state = {1}, field = sim.force.gravity {}, integrator = 'rk4', dt = 1, duration = 1",
       "got a sim.force"},
  };
  for (const auto& [entries, says] : cases) {
    const std::string text = "return sim.scene { " + entries + " }";
    check_scenes({{text.c_str(), "scene.lua:6", says}});
  }
}

TEST_CASE("what a file may not return", "[lua][errors]") {
  check_all({
      {"", "scene.lua", "returned nothing"},
      {"return 5", "scene.lua", "returned 5"},
      {"return { particles = 1 }", "scene.lua", "returned a table"},
      {"return sim.particles()", "scene.lua", "returned a sim.particles"},
      {"return sim.world {}", "scene.lua:2", "empty sim.world"},
      {"return sim.world { require 'scenes.circle' }", "scene.lua:2", "found the key 1"},
      {"return sim.world { a = 5 }", "scene.lua:2", "expected a sim.scene, got 5"},
      {"return sim.world { ['a,b'] = require 'scenes.circle' }", "scene.lua:2", "got 'a,b'"},
      {"return sim.world { a = sim.world { b = require 'scenes.circle' } }", "scene.lua:2",
       "cannot be nested"},
      {"\nreturn sim.world { a = require 'scenes.crcle' }", "scene.lua:3",
       "did you mean 'scenes.circle'?"},
  });
}

TEST_CASE("files that cannot be read are environment errors", "[lua][errors]") {
  const SceneFolder folder;
  const auto missing = load_error(folder, "scenes/clot.lua");
  REQUIRE(missing);
  CHECK(missing->kind() == ErrorKind::kIo);
  CHECK(missing->text().remedy == "did you mean 'scenes/cloth.lua'?");
  const auto short_name = load_error(folder, "penduluum");
  REQUIRE(short_name);
  CHECK(short_name->text().remedy == "did you mean 'pendulum'?");
  CHECK(load_error(folder, "")->kind() == ErrorKind::kIo);
  CHECK(load_error(folder, folder.path().string())->kind() == ErrorKind::kIo);
  CHECK(load_error(folder, std::string("a\0b", 3))->kind() == ErrorKind::kIo);

  const std::string big = folder.write("big.lua", "return 1");
  std::filesystem::resize_file(big, (std::uintmax_t{64} << 20) + 1);
  const auto too_big = load_error(folder, big);
  REQUIRE(too_big);
  CHECK(too_big->kind() == ErrorKind::kIo);
  CHECK(contains(too_big->text().why, "64 MB"));

  Registry registry({SIM_PLUGIN_DIR});
  const std::string scene = folder.write("scene.lua", "local sim = require 'sim'");
  try {
    load_scene(scene, registry, {{folder.path()}, {}, 0});
    FAIL("no error without the scene language");
  } catch (const Error& error) {
    CHECK(error.kind() == ErrorKind::kIo);
    CHECK(contains(error.what(), "the scene language is missing"));
  }
}

TEST_CASE("a force that is tied and in no scene is told with its line", "[lua][errors]") {
  check_scenes({
      {"local spring = sim.force.spring { stiffness = 1, rest = 1 }\nspring:tie(0, 1)\n"
       "return sim.scene { particles = particles, forces = {}, integrator = 'rk4', dt = 1, "
       "duration = 1 }",
       "scene.lua:6", "unused force 'spring'"},
      {"local spring = sim.force.spring { stiffness = 1, rest = 1, ties = { {0, 1} } }\n"
       "return sim.scene { particles = particles, forces = { sim.force.gravity {} }, "
       "integrator = 'rk4', dt = 1, duration = 1 }",
       "scene.lua:6", "put it into forces"},
  });
  // One that joins nothing yet is none of that, nor one that is added later.
  for (const char* text :
       {"local s = sim.force.spring { stiffness = 1, rest = 1 }\nlocal scene = sim.scene { "
        "particles = "
        "particles, forces = {}, integrator = 'rk4', dt = 1, duration = 1 }\nreturn scene",
        "local s = sim.force.spring { stiffness = 1, rest = 1 }\ns:tie(0, 1)\nlocal scene = "
        "sim.scene "
        "{ particles = particles, forces = {}, integrator = 'rk4', dt = 1, duration = 1 }\n"
        "scene.forces = { s }\nreturn scene"}) {
    const auto error = text_error(
        "local particles = sim.particles { mass = 1 }\n"
        "particles:add {0, 0, 0}\nparticles:add {1, 0, 0}\n" +
        std::string(text));
    CHECK_FALSE(error);
  }
}

// A name ends at no zero within it: the file before it is not the one that was asked for.
TEST_CASE("a name that is empty, endless or has a zero in it is no scene", "[lua]") {
  using namespace std::string_literals;
  const auto path = sim::test::search_path();
  CHECK(sim::find_scene("scenes/cloth.lua", path).filename() == "cloth.lua");
  for (const std::string& name : {""s, "scenes/cloth.lua\0.lua"s, "scenes/cloth.lua\0"s,
                                  "scenes/cloth\0"s, "scenes/" + std::string(5000, 'c') + ".lua"})
    CHECK_THROWS_WITH(sim::find_scene(name, path), Catch::Contains("not found"));
}
