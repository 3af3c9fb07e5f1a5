// Frames of a live page, read back as their description says: words, positions, values.
#include "core/output/page/live_page.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "tests/cli/json_check.h"
#include "tests/lua/scene_text.h"
#include "tests/support/scenes.h"

namespace {

template <class T>
T number_at(const std::string& bytes, std::size_t at) {
  T value;
  REQUIRE(at + sizeof value <= bytes.size());
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

}  // namespace

TEST_CASE("a frame of a live page has the positions of all systems, and values where it says so",
          "[output]") {
  using sim_test::Json;
  sim::Registry registry = sim_test::make_registry();
  const sim::SystemSpec specs[] = {sim_test::make_cloth(3), sim_test::make_cloth(4)};
  std::vector<sim::Model> models;
  sim::Moment moment;
  for (const sim::SystemSpec& spec : specs) {
    sim::Simulation system(spec, registry);
    for (int n = 0; n < 20; ++n) REQUIRE(system.step());
    models.push_back(sim::make_model(spec, system));
    moment.push_back(sim::take_frame(system));
    for (int i = 0; i < system.particles(); ++i)
      moment.back().values.push_back(0.25 * (i + 1) + (models.size() == 2 ? 1 : 0));
  }
  const std::vector<sim::Moment> preview{moment};
  sim::LivePage page({.models = models, .preview = preview}, false);
  for (const std::string measured : {"", "error", "energy", ""}) {
    INFO(measured);
    sim::ViewState state;
    state.measured = measured;
    const std::string bytes = page.frame(moment, state);
    const auto length = number_at<std::uint32_t>(bytes, 0);
    CHECK(length % 4 == 0);
    const Json words = sim_test::JsonReader(bytes.substr(4, length)).read();
    CHECK(words.has("values") == !measured.empty());
    const double most = measured.empty() ? 0 : words.at("values").at("most").number;
    std::size_t at = 4 + length;
    for (std::size_t m = 0; m < models.size(); ++m) {
      const auto n = static_cast<std::size_t>(models[m].particles);
      float low[3];
      for (std::size_t axis = 0; axis < 3; ++axis)
        low[axis] = number_at<float>(bytes, at + 4 * axis);
      const double quantum = number_at<float>(bytes, at + 12);
      at += 16;
      std::vector<sim::Vec3> shown(n);
      for (std::size_t i = 0; i < n; ++i, at += 6)
        for (std::size_t axis = 0; axis < 3; ++axis)
          shown[i][static_cast<int>(axis)] =
              low[axis] + quantum * (number_at<std::int16_t>(bytes, at + 2 * axis) + 32768.0);
      // The ways from the first to the others, with y up, all to one scale.
      const auto way = [&](std::size_t i) {
        return moment[m].at(static_cast<int>(i)) - moment[m].at(0);
      };
      const double scale = (shown[n - 1] - shown[0]).norm() / way(n - 1).norm();
      CHECK((scale > 0.5 && scale < 2));
      for (std::size_t i = 0; i < n; ++i) {
        const sim::Vec3 found = shown[i] - shown[0];
        CHECK(found.y() == Approx(scale * way(i).y()).margin(4 * quantum));
        CHECK(found.norm() == Approx(scale * way(i).norm()).margin(4 * quantum));
      }
      for (std::size_t i = 0; i < n && !measured.empty(); ++i, ++at) {
        if (measured != "error") continue;
        const double share = moment[m].values[i] / most;
        CHECK(static_cast<unsigned char>(bytes.at(at)) == std::floor(255 * share + 0.5));
      }
      at = (at + 3) / 4 * 4;
    }
    CHECK(bytes.size() == at);
    if (measured == "error") CHECK(most >= 2.25);
  }
}

// The scale begins with its values, grows at once, and shrinks where less than a fifth is used.
TEST_CASE("the scale of values of a live page is that of its frames, and steady", "[output]") {
  sim::Registry registry = sim_test::make_registry();
  const sim::SystemSpec spec = sim_test::make_cloth(3);
  sim::Simulation system(spec, registry);
  const std::vector<sim::Model> models{sim::make_model(spec, system)};
  sim::Moment moment{sim::take_frame(system)};
  sim::LivePage page({.models = models, .preview = {&moment, 1}}, false);
  const auto most = [&](double largest) {
    moment[0].values.assign(9, 0.5 * largest);
    moment[0].values[4] = largest;
    sim::ViewState state;
    state.measured = "error";
    const std::string bytes = page.frame(moment, state);
    const std::string words = bytes.substr(4, number_at<std::uint32_t>(bytes, 0));
    return sim_test::JsonReader(words).read().at("values").at("most").number;
  };
  CHECK(most(0.3) == Approx(0.3));
  CHECK(most(0.29) == Approx(0.3));
  CHECK(most(0.061) == Approx(0.3));  // rounded up to 0.1
  CHECK(most(0.05) == Approx(0.05));
  CHECK(most(0.012) == Approx(0.05));
  CHECK(most(0.5) == Approx(0.5));
  CHECK(most(0.2) == Approx(0.5));
  page.frame(moment, {});  // without values
  CHECK(most(0.2) == Approx(0.2));
}

TEST_CASE("a live page tells bodies from other solids", "[output]") {
  sim::Registry registry = sim_test::make_registry();
  const sim::SystemSpec spec =
      sim::test::load_text(
          "local p = sim.particles { mass = 1 }\np:add {0, 3, 0}\n"
          "return sim.scene { particles = p, integrator = 'verlet', dt = 0.01, duration = 1,\n"
          "  forces = { sim.force.gravity {} }, colliders = { sim.collider.sphere { center = "
          "{4, 0, 0}, radius = 1 } },\n"
          "  bodies = { sim.rigid { shape = sim.sphere { radius = 0.5 }, mass = 2 } } }")
          .systems[0];
  sim::Simulation system(spec, registry);
  const std::vector<sim::Model> models{sim::make_model(spec, system)};
  const sim::Moment moment{sim::take_frame(system)};
  const std::string html =
      sim::LivePage({.models = models, .preview = {&moment, 1}}, false).html("/socket", "n");
  std::vector<std::string> bodies;  // whether each sphere is one
  for (auto at = html.find("\"form\":\"sphere\""); at != std::string::npos;
       at = html.find("\"form\":\"sphere\"", at + 1)) {
    const std::string solid = html.substr(at, html.find('}', at) - at);
    bodies.push_back(solid.find("\"body\":1") != std::string::npos ? "body" : "collider");
    CHECK(solid.find("\"1\":") == std::string::npos);
  }
  std::ranges::sort(bodies);
  CHECK(bodies == std::vector<std::string>{"body", "collider"});
  // The four particles of the body, behind the free one, are not drawn beside it.
  CHECK(html.find("\"covered\":[1,4]") != std::string::npos);

  // Each is where it is at a moment, whatever else is known.
  std::vector<sim::Moment> moments{moment};
  for (int i = 0; i < 20; ++i) REQUIRE(system.step());
  moments.push_back({sim::take_frame(system)});
  const sim::Page page(models, sim::Moments(moments.data(), 2), {});
  std::vector<double> heights;
  for (const sim::Moment& each : moments)
    for (const sim_test::Json& solid : sim_test::read_json(page.solids(each, 0)).list) {
      REQUIRE(solid.at("at").list.size() == 1);
      heights.push_back(solid.at("at").list[0].list.at(1).number);
    }
  REQUIRE(heights.size() == 4);
  CHECK(heights[0] == heights[2]);  // the collider
  CHECK(heights[1] > heights[3]);   // the body falls
}

TEST_CASE("bodies that share a shape with triangles have them written once", "[output]") {
  sim::Registry registry = sim_test::make_registry();
  const sim::SystemSpec spec =
      sim::test::load_text(
          "local hook = sim.compound { { sim.box { half = {1, 0.1, 0.1} } }, { sim.box { half = "
          "{0.1, 0.5, 0.1} }, at = {1, 0.5, 0} } }\nlocal function at(shape, y) return sim.rigid { "
          "shape = shape, mass = 1, position = {0, y, 0} } end\nlocal other = sim.compound { { "
          "sim.box { half = {1, 1, 1} } } }\nreturn sim.scene { bodies = { at(hook, 0), at(other, "
          "4), at(hook, 8), at(hook, 12) }, forces = {}, integrator = 'verlet', dt = 0.01, "
          "duration = 1 }")
          .systems[0];
  sim::Simulation system(spec, registry);
  const std::vector<sim::Model> models{sim::make_model(spec, system)};
  const sim::Moment moment{sim::take_frame(system)};
  const sim::Page page(models, sim::Moments(&moment, 1), {});
  std::string written;
  const sim_test::Json solids = sim_test::read_json(page.solids(moment, 0));
  for (const sim_test::Json& solid : solids.list)
    written +=
        solid.has("mesh") ? "mesh " : "like " + std::to_string(solid.at("like").number) + " ";
  CHECK(written == "mesh mesh like 0.000000 like 0.000000 ");
}
