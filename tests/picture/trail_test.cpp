// Trails of chosen particles and bodies.
#include "core/picture/trail.h"

#include <cmath>
#include <set>

#include "core/picture/scenery.h"
#include "tests/lua/scene_text.h"

using namespace sim;
using namespace sim::test;

namespace {

// Two beads that run around the origin, with steps of 0.4 rad, and a box that falls.
const std::string kRound =
    "local particles = sim.particles { mass = 1 }\n"
    "particles:add({1, 0, 0}, { velocity = {0, 1, 0} })\n"
    "particles:add({2, 0, 0}, { velocity = {0, 2, 0} })\n"
    "local box = sim.rigid { shape = sim.box { half = {0.1, 0.2, 0.3} }, mass = 1,\n"
    "  position = {0, 0, 5}, angular_velocity = {1, 2, 3}, touches = false }\n"
    "return sim.scene { particles = particles, bodies = { box },\n"
    "  forces = { sim.force.expression { fx = '-x', fy = '-y', particles = {0, 1} } },\n"
    "  integrator = 'dopri5', dt = 0.4, duration = 6 }\n";

Look look_at(std::initializer_list<const char*> trails) {
  LookSpec spec;
  for (const char* trail : trails) spec.trails.emplace_back(trail);
  return make_look(spec);
}

std::string refused(const Model& model, const Look& look) {
  try {
    check_trails({&model, 1}, look);
  } catch (const Error& error) {
    CHECK(error.kind() == ErrorKind::kUsage);
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("a trail bends between steps as the motion does", "[trail]") {
  TextRun run(kRound, "dopri5", 0.4);
  const Look look = look_at({"1", "body:0", "0"});
  const Model model = make_model(run.spec.systems[0], run.system);
  const std::vector<Trail> trails = trails_of(model, look);
  REQUIRE(trails.size() == 3);
  CHECK(std::set<unsigned>{trails[0].colour, trails[1].colour, trails[2].colour}.size() == 3);
  TrailRecorder recorder(model, look);
  std::vector<std::vector<Vec3>> ways(3);
  const auto& points = recorder.follow(run.system);
  for (std::size_t k = 0; k < 3; ++k)
    for (const auto& point : points[k]) ways[k].push_back(point.x);
  for (int step = 0; step < 15; ++step) {
    REQUIRE(run.system.step());
    const auto& more = recorder.follow(run.system);
    for (std::size_t k = 0; k < 3; ++k)
      for (const auto& point : more[k]) ways[k].push_back(point.x);
  }
  CHECK(ways[0].size() > 60);  // of 6 rad in 15 steps
  double off = 0, longest = 0;
  for (std::size_t k = 0; k < ways[0].size(); ++k) {
    off = std::max(off, std::fabs(ways[0][k].norm() - 2));
    if (k > 0) longest = std::max(longest, (ways[0][k] - ways[0][k - 1]).norm());
  }
  CHECK(off < 2 * std::pow(0.4, 4) / 384 * 1.05);  // of the cubic
  CHECK(longest < 0.2);
  for (const Vec3& x : ways[2]) CHECK(x.norm() == Approx(1).epsilon(1e-4));
  for (const Vec3& x : ways[1]) CHECK((x - Vec3(0, 0, 5)).norm() < 1e-12);
}

TEST_CASE("where few particles move the last free one leaves a trail of its own", "[trail]") {
  const auto own = [](int particles, std::vector<int> pinned, auto change) {
    Model model;
    model.particles = particles;
    model.pinned = std::move(pinned);
    Look look;
    change(model, look);
    return own_trail(model, look);
  };
  const auto as_it_is = [](Model&, Look&) {};
  CHECK(own(5, {}, as_it_is) == 4);
  CHECK(own(5, {4}, as_it_is) == 3);
  CHECK(own(5, {1, 3, 4}, as_it_is) == 2);
  CHECK(own(5, {0, 1, 2, 3, 4}, as_it_is) == -1);
  CHECK(own(0, {}, as_it_is) == -1);
  CHECK(own(5, {}, [](Model&, Look& look) { look.own_trails = true; }) == -1);
  CHECK(own(5, {}, [](Model& model, Look&) { model.triangles = {{0, 1, 2}}; }) == -1);
  CHECK(own(5, {}, [](Model& model, Look&) { model.in_bodies = {0, 1, 2, 3}; }) == -1);
  int most = 5;
  while (own(most + 1, {}, as_it_is) == most) ++most;
  CHECK(most < 1000);
  CHECK(own(most + 3, {0, 1, 2}, as_it_is) == most + 2);  // it counts those that are free
  CHECK(own(most + 4, {0, 1, 2}, as_it_is) == -1);
}

TEST_CASE("the first numbers of a flat state leave a trail", "[trail]") {
  TextRun run(
      "return sim.scene { state = {1, -2, 3}, dt = 0.5, duration = 2, integrator = 'rk4',\n"
      "  field = sim.field.formula { '1', '0', '0', names = {'x', 'y', 'z'} } }\n",
      "rk4", 0.5);
  const Model model = make_model(run.spec.systems[0], run.system);
  TrailRecorder recorder(model, look_at({"0"}));
  const auto begins = recorder.follow(run.system);
  REQUIRE((begins.size() == 1 && begins[0].size() == 1));
  CHECK((begins[0][0].x - Vec3(1, -2, 3)).norm() < 1e-15);
  REQUIRE(run.system.step());
  CHECK((recorder.follow(run.system)[0].back().x - Vec3(1.5, -2, 3)).norm() < 1e-12);
}

TEST_CASE("a trail of what is not there is refused", "[trail]") {
  TextRun run(kRound, "dopri5", 0.4);
  const Model model = make_model(run.spec.systems[0], run.system);
  CHECK(refused(model, look_at({"0", "body:0"})).empty());
  CHECK(contains(refused(model, look_at({"body:1"})), "from 0 to 0"));
  CHECK(contains(refused(model, look_at({"77"})), "no particle of that number"));
  CHECK_THROWS_AS(look_at({"box"}), Error);
  CHECK_THROWS_AS(look_at({"-1"}), Error);
  CHECK(look_at({"none"}).own_trails);
}

TEST_CASE("pictures draw each trail in its own colour", "[trail]") {
  TextRun run(kRound, "dopri5", 0.4);
  const std::vector<Model> models{make_model(run.spec.systems[0], run.system)};
  const Look look = look_at({"0", "1"});
  TrailRecorder recorder(models[0], look);
  std::vector<Moment> moments;
  for (int k = 0; k < 2; ++k) {
    Frame frame = take_frame(run.system);
    for (const auto& way : recorder.follow(run.system)) {
      frame.paths.emplace_back();
      for (const auto& point : way) frame.paths.back().push_back(point.x);
    }
    moments.push_back({frame});
    REQUIRE(run.system.step());
  }
  const auto lines = [&](const Look& of) {
    return Scenery(models, moments, of).picture(1).lines.size();
  };
  const std::size_t none = lines(look_at({"none"}));
  CHECK(lines(look) >= none + 2 * 5);
  // Nobody followed them: from moment to moment.
  for (Moment& moment : moments) moment[0].paths.clear();
  CHECK(lines(look) == none + 2);
}
