// sim.arg: declared by scenes, set from outside, strict about types.
#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

const std::string kScene =
    "local number = sim.arg('number', 2.5, 'a number')\n"
    "local count = sim.arg('count', 3, 'a whole number')\n"
    "local flag = sim.arg('flag', false)\n"
    "local word = sim.arg('word', 'abc', 'some text')\n"
    "local particles = sim.particles {}\n"
    "particles:add { number, count, flag and 1 or 0 }\n"
    "assert(math.type(count) == 'integer' or count % 1 ~= 0)\n"
    "local forces = {}\n"
    "return sim.scene { name = word, particles = particles, forces = forces, integrator = 'rk4', "
    "dt = 1, duration = 1 }\n";

}  // namespace

TEST_CASE("settings reach the scene with their type", "[lua][args]") {
  const SceneSpec plain = load_text(kScene);
  CHECK(plain.systems[0].particles->at(0).position == Vec3(2.5, 3, 0));
  CHECK(plain.systems[0].name == "abc");

  const SceneSpec set =
      load_text(kScene, {{"number", "-1e-3"}, {"count", "1e3"}, {"flag", "true"}, {"word", "x y"}});
  CHECK(set.systems[0].particles->at(0).position == Vec3(-1e-3, 1000, 1));
  CHECK(set.systems[0].name == "x y");
  CHECK(load_text(kScene, {{"count", "2.5"}}).systems[0].particles->at(0).position.y() == 2.5);

  REQUIRE(set.args.size() == 4);
  CHECK(set.args[0].name == "number");
  CHECK(std::get<double>(set.args[0].default_value) == 2.5);
  CHECK(std::get<double>(set.args[0].value) == -1e-3);
  CHECK(set.args[1].doc == "a whole number");
  CHECK(std::get<bool>(set.args[2].value));
  CHECK(set.args[2].doc.empty());
  CHECK(std::get<std::string>(set.args[3].default_value) == "abc");
}

TEST_CASE("bad settings are usage errors", "[lua][args]") {
  const struct {
    const char *name, *value, *says;
  } cases[] = {
      {"number", "abc", "expected a number; its default is 2.5"},
      {"number", "", "expected a number"},
      {"number", "nan", "expected a number"},
      {"number", "inf", "expected a number"},
      {"number", "1e400", "expected a number"},
      {"number", "1 ", "expected a number"},
      {"count", "3x", "expected a number"},
      {"count", "0x10", "expected a number"},
      {"flag", "yes", "expected true or false"},
      {"flag", "1", "expected true or false"},
      {"numbr", "1", "did you mean 'number'?"},
      {"Word", "x", "did you mean 'word'?"},
      {"", "1", "unknown parameter"},
      {"scene.numer", "1", "unknown parameter"},
      {"other.number", "1", "unknown parameter"},
  };
  for (const auto& [name, value, says] : cases) {
    INFO(name << '=' << value);
    const auto error = text_error(kScene, {{name, value}});
    REQUIRE(error);
    INFO(error->what());
    CHECK(error->kind() == ErrorKind::kUsage);
    CHECK(contains(error->text().where, "--set " + std::string(name)));
    CHECK(contains(error->what(), says));
  }
}

TEST_CASE("bad declarations are scene errors", "[lua][args]") {
  const struct {
    const char *text, *says;
  } cases[] = {
      {"sim.arg('n', 4)\nsim.arg('n', 5)", "5 here, 4 at "},
      {"sim.arg('n', 4)\nsim.arg('n', '4')", "two defaults"},
      {"\nsim.arg('n')", "got nothing"},
      {"\nsim.arg('n', {})", "got a table"},
      {"\nsim.arg('n', 0/0)", "got nan"},
      {"\nsim.arg('n m', 1)", "a word of letters"},
      {"\nsim.arg('', 1)", "a word of letters"},
      {"\nsim.arg(1, 1)", "a word of letters"},
      {"\nsim.arg('n', 1, 2)", "bad description"},
  };
  for (const auto& [text, says] : cases) {
    INFO(text);
    const auto error = text_error(text);
    REQUIRE(error);
    INFO(error->what());
    CHECK(error->kind() == ErrorKind::kScene);
    CHECK(error->text().where == "scene.lua:3");
    CHECK(contains(error->what(), says));
  }
}

TEST_CASE("scenes of a world share settings by name", "[lua][args]") {
  const auto counts = [](const sim::test::Settings& settings) {
    const SceneSpec spec = load("scenes/sample.lua", settings);
    return std::pair{spec.systems[1].particles->count(), spec.systems[2].particles->count()};
  };
  CHECK(counts({}) == std::pair{64, 4});
  CHECK(counts({{"n", "5"}}) == std::pair{25, 5});
  CHECK(counts({{"cloth_ball.n", "5"}}) == std::pair{25, 4});
  CHECK(counts({{"cloth_ball.n", "5"}, {"n", "6"}}) == std::pair{25, 6});

  std::vector<std::string> names;
  for (const SceneArg& arg : load("scenes/sample.lua").args) names.push_back(arg.name);
  CHECK(names == std::vector<std::string>{"cloth_ball.n", "radius", "friction", "period",
                                          "stiffness", "pendulum.n"});

  const SceneSpec twice = load_text(
      "return sim.world { a = require 'scenes.cloth', b = require 'scenes.cloth' }", {{"n", "3"}});
  CHECK(twice.args.size() == 4);
  CHECK(twice.systems[1].particles->count() == 9);
}
