// Malformed scenes by the thousand: each loads or ends in an error of the right kind.
#include "tests/lua/scene_text.h"

#include <random>

#include "core/scene/simulation.h"

using namespace sim;
using namespace sim::test;

namespace {

const char* const kValues[] = {"nil",
                               "true",
                               "0",
                               "1",
                               "-1",
                               "2.5",
                               "1e308",
                               "0/0",
                               "1/0",
                               "2^63",
                               "math.mininteger",
                               "'text'",
                               "''",
                               "{}",
                               "{1, 2, 3}",
                               "{{1, 2, 3}}",
                               "{x = {{1, 0, 0}}}",
                               "{nil, nil, 3}",
                               "{[0] = 1}",
                               "{[1.5] = 2}",
                               "{[{}] = 1}",
                               "print",
                               "function() end",
                               "sim",
                               "sim.particles()",
                               "grid",
                               "list",
                               "sim.force.gravity {}",
                               "sim.force.spring { stiffness = 1 }",
                               "sim.surface { grid = grid }",
                               "{ sim.surface { particles = list, triangles = { {0, 1, 2} } } }",
                               "{ {0, 1}, {1, 2, stiffness = 3} }",
                               "{ {0, 1, 1}, {1, 2, 0} }",
                               "sim.field.rotation {}",
                               "coroutine.create(print)",
                               "setmetatable({}, {__index = error})",
                               "'rk4'",
                               "0.01",
                               "{ sim.force.gravity {} }",
                               "'\\0'"};
const char* const kKeys[] = {
    "name",    "particles", "forces",   "state",     "field",  "exact",    "integrator",
    "dt",      "duration",  "surfaces", "mass",      "g",      "k",        "grid",
    "offsets", "stiffness", "rest",     "family",    "origin", "du",       "dv",
    "x",       "[1]",       "[2]",      "[{}]",      "[0.5]",  "['\\0']",  "omega",
    "f",       "velocity",  "surface",  "triangles", "ties",   "pressure", "[3]"};
const char* const kCalls[] = {"sim.scene",
                              "sim.world",
                              "sim.grid",
                              "sim.particles",
                              "sim.arg",
                              "sim.force.gravity",
                              "sim.force.spring",
                              "sim.force.drag",
                              "sim.force.expression",
                              "sim.force.lua",
                              "sim.field.rotation",
                              "sim.surface",
                              "sim.force.pressure",
                              "sim.force.bending",
                              "sim.field.lua",
                              "sim.force.none"};
const char* const kMethods[] = {"list:add", "list:pin",    "grid:id",     "grid:pin",
                                "grid:add", "springs:tie", "springs.tie", "list.add"};

class Generator {
 public:
  explicit Generator(unsigned seed) : random_(seed) {}

  template <std::size_t kCount>
  std::string pick(const char* const (&list)[kCount]) {
    return list[random_() % kCount];
  }

  std::string table(int depth) {
    std::string text = "{ ";
    for (auto entries = random_() % 5; entries > 0; --entries)
      text += pick(kKeys) + " = " + value(depth) + ", ";
    return text + "}";
  }

  std::string value(int depth) {
    const auto kind = random_() % 8;
    if (depth == 0 || kind < 5) return pick(kValues);
    if (kind < 7) return table(depth - 1);
    return pick(kCalls) + " " + table(depth - 1);
  }

  // Every line may fail by itself without hiding the next one.
  std::string scene() {
    std::string text =
        "local grid = sim.grid { 2, 3, du = {0, 0, 1}, dv = {1, 0, 0} }\n"
        "local list = sim.particles {}\nlist:add {0, 0, 0}\nlist:add {1, 0, 0}\n"
        "local springs = sim.force.spring { stiffness = 1 }\n"
        "local s = { particles = list, forces = { springs }, integrator = 'rk4', dt = 0.01, "
        "duration = 1 }\n";
    for (auto lines = random_() % 6; lines > 0; --lines)
      text += "pcall(function() " + pick(kMethods) + "(" + value(1) + ", " + value(1) + ", " +
              value(1) + ") end)\n";
    for (auto changes = random_() % 3; changes > 0; --changes)
      text +=
          "pcall(function() s." + std::string(kKeys[random_() % 10]) + " = " + value(2) + " end)\n";
    return text + (random_() % 4 ? "return sim.scene(s)\n" : "return " + value(3) + "\n");
  }

 private:
  std::mt19937 random_;
};

}  // namespace

TEST_CASE("malformed tables never crash", "[lua][fuzz]") {
  const SceneFolder folder;
  Registry registry({SIM_PLUGIN_DIR});
  int loaded = 0, refused = 0;
  for (unsigned seed = 0; seed < 3000; ++seed) {
    Generator generator(seed);
    const std::string text = "local sim = require 'sim'\n" + generator.scene();
    const std::string file = folder.write("scene.lua", text);
    try {
      const SceneSpec spec = load_scene(file, registry, {search_path(), {}, 0});
      ++loaded;
      for (const SystemSpec& system : spec.systems) {
        if (system.dt < 1e300) Simulation(system, registry);
        CHECK(system.dt > 0);
        CHECK((system.particles.has_value() != system.first_order.has_value()));
        if (system.particles) CHECK(system.particles->count() > 0);
      }
    } catch (const Error& error) {
      ++refused;
      INFO(text);
      INFO(error.what());
      CHECK(error.kind() == ErrorKind::kScene);
      CHECK(contains(error.text().where, "scene.lua"));
      CHECK_FALSE(error.text().what.empty());
    }
  }
  CHECK(loaded > 300);
  CHECK(refused > 300);
}

TEST_CASE("damaged text never crashes", "[lua][fuzz]") {
  std::ifstream stream(search_path()[0] / "scenes" / "cloth.lua", std::ios::binary);
  const std::string cloth((std::istreambuf_iterator<char>(stream)), {});
  REQUIRE(cloth.size() > 500);
  const SceneFolder folder;
  Registry registry({SIM_PLUGIN_DIR});
  std::mt19937 random(7);
  int loaded = 0, refused = 0;
  for (int i = 0; i < 1500; ++i) {
    std::string text = cloth;
    for (auto changes = 1 + random() % 3; changes > 0; --changes) {
      const std::size_t at = random() % text.size();
      switch (random() % 3) {
        case 0:
          text[at] = static_cast<char>(random() % 256);
          break;
        case 1:
          text.erase(at, 1 + random() % 20);
          break;
        default:
          text.insert(at, text.substr(random() % text.size(), random() % 20));
      }
    }
    try {
      load_scene(folder.write("scene.lua", text), registry, {search_path(), {}, 0});
      ++loaded;
    } catch (const Error& error) {
      ++refused;
      CHECK(error.kind() == ErrorKind::kScene);
    }
  }
  CHECK(loaded > 50);
  CHECK(refused > 50);
}
