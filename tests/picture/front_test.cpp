// Keys and mouse of a window or a terminal become words, and what is under the pointer is picked.
#include "core/output/front.h"

#include <catch2/catch.hpp>

#include "core/picture/raster/raster.h"
#include "tests/support/scenes.h"

namespace {

using sim::Front;
using sim::FrontEvent;
using Words = std::vector<std::string>;

constexpr int kWidth = 640, kHeight = 360;

// A cloth that has fallen for a while, and the front that shows it.
struct Seen {
  sim::Registry registry = sim_test::make_registry();
  sim::SystemSpec spec = sim_test::make_cloth(8);
  sim::Simulation system{spec, registry};
  std::vector<sim::Model> models{sim::make_model(spec, system), sim::make_model(spec, system)};
  std::vector<sim::Moment> preview;
  sim::ViewState state;
  std::unique_ptr<Front> front;

  explicit Seen(bool world = false) {
    models.resize(world ? 2 : 1);
    REQUIRE(sim_test::run(system, 40));
    const sim::Frame frame = sim::take_frame(system);
    preview.push_back(sim::Moment(models.size(), frame));
    models[0].name = "one";
    for (std::size_t m = 0; m < models.size(); ++m)
      state.systems.push_back({.h = 0.005, .method = "rk4", .pinned = {0, 7}});
    state.systems[0].switches = {{"ball", true}, {"wind", false}};
    front = std::make_unique<Front>(
        sim::ViewScene{.world = world, .models = models, .preview = preview}, 8);
    front->resize(kWidth, kHeight);
    front->show(preview[0], state);
    front->picture();
  }

  Words at(FrontEvent::What what, float x, float y, bool shift = false, bool control = false) {
    return front->take({.what = what, .x = x, .y = y, .shift = shift, .control = control});
  }
  Words key(const std::string& key) { return front->take({.key = key}); }
  std::int64_t covered() {
    sim::Raster raster(kWidth, kHeight);
    raster.draw(front->picture());
    return raster.covered();
  }
};

sim::Vec3 place_in(const std::string& words) {
  sim::Vec3 place;
  int particle = -1;
  REQUIRE(std::sscanf(words.c_str(), "pull %d %lf %lf %lf", &particle, &place[0], &place[1],
                      &place[2]) == 4);
  return place;
}

}  // namespace

TEST_CASE("a drag pulls the particle under the pointer, along the screen") {
  using What = FrontEvent::What;
  Seen seen;
  int grabbed = 0;
  for (int i = 0; i < 64; ++i) {
    const sim::V3 p = seen.front->pixel(0, i);
    const Words words = seen.at(What::kPress, p.x, p.y);
    REQUIRE(words.size() == 1);
    grabbed += words[0] == "grab " + std::to_string(i);
    const int held = *seen.front->picked();
    // The particle has to be at the pointer: nowhere else if the pointer rests.
    const sim::V3 own = seen.front->pixel(0, held);
    const sim::Vec3 there = place_in(seen.at(What::kMove, own.x, own.y)[0]);
    CHECK((there - seen.system.position(held)).norm() < 1e-5);
    const sim::Vec3 aside = place_in(seen.at(What::kMove, own.x + 50, own.y - 30)[0]);
    CHECK((aside - there).norm() > 0.02);
    CHECK(aside.y() > there.y());
    CHECK(seen.at(What::kRelease, 0, 0) == Words{"release " + std::to_string(held)});
  }
  CHECK(grabbed > 32);  // the others are behind folds

  const sim::V3 p = seen.front->pixel(0, 63);
  CHECK(seen.at(What::kPress, p.x, p.y, false, true) == Words{"pin 63"});
  const sim::V3 pin = seen.front->pixel(0, 7);
  CHECK(seen.at(What::kPress, pin.x, pin.y, false, true) == Words{"unpin 7"});
  seen.at(What::kPress, p.x, p.y, true);
  CHECK(seen.at(What::kRelease, p.x, p.y) == Words{"pin 63", "release 63"});
}

TEST_CASE("a drag elsewhere turns, the other button moves, and Home leads back") {
  using What = FrontEvent::What;
  Seen seen;
  const auto corner = [&] { return seen.front->pixel(0, 63); };
  const sim::V3 start = corner();
  CHECK(seen.at(What::kPress, 3, 3).empty());
  CHECK(seen.at(What::kMove, 90, 20).empty());
  CHECK(seen.at(What::kRelease, 90, 20).empty());
  seen.front->picture();
  CHECK(std::abs(corner().x - start.x) > 3);
  seen.front->take({.what = What::kPress, .x = start.x, .y = start.y, .moves = true});
  CHECK(seen.at(What::kMove, start.x + 40, start.y).empty());
  seen.at(What::kRelease, 0, 0);
  seen.front->zoom(0.5F);
  seen.key("Home");
  seen.front->picture();
  CHECK(corner().x == Approx(start.x).margin(0.1));
  CHECK(corner().y == Approx(start.y).margin(0.1));
}

// However it was turned, the eye is at the same distance, looks at the same place and stands
// upright; its axes are a right-handed frame, and places in the picture are those that it sees.
TEST_CASE("an eye that turns keeps its frame, its distance and what it looks at") {
  using What = FrontEvent::What;
  Seen seen;
  const sim::Eye first = seen.front->picture().eye;
  const sim::V3 up = seen.front->picture().ground.value_or(sim::Ground{}).up;
  // The place where the first line of sight and that after a turn meet.
  std::optional<sim::V3> target;
  std::pair<float, float> from{3, 3};
  for (const auto& [x, y] :
       {std::pair{90.0F, 20.0F}, {200.0F, 5.0F}, {430.0F, 90.0F}, {20.0F, 40.0F}, {310.0F, 3.0F}}) {
    CAPTURE(x, y);
    seen.at(What::kPress, from.first, from.second);
    seen.at(What::kMove, from.first + x - 90, from.second + y);
    seen.at(What::kRelease, from.first + x - 90, from.second + y);
    const sim::Picture picture = seen.front->picture();
    const sim::Eye& eye = picture.eye;
    for (const sim::V3& axis : {eye.right, eye.up, eye.forward})
      CHECK(dot(axis, axis) == Approx(1).epsilon(1e-5));
    CHECK(dot(eye.right, eye.forward) == Approx(0).margin(1e-5));
    CHECK(dot(eye.right, up) == Approx(0).margin(1e-5));
    CHECK(dot(eye.up, eye.forward) == Approx(0).margin(1e-5));
    CHECK(dot(eye.up, up) > 0);
    const sim::V3 across = sim::raster::cross(eye.right, eye.up) + eye.forward;
    CHECK(dot(across, across) == Approx(0).margin(1e-9));
    if (!target && std::abs(dot(eye.forward, first.forward)) < 0.99F) {
      const float c = dot(eye.forward, first.forward);
      const sim::V3 d = eye.at - first.at;
      target = first.at +
               (dot(d, first.forward) - c * dot(d, eye.forward)) / (1 - c * c) * first.forward;
    }
    if (target) {
      const sim::V3 to = *target - eye.at, at_first = *target - first.at;
      CHECK(dot(to, eye.forward) == Approx(dot(at_first, first.forward)).epsilon(1e-3));
      CHECK(dot(to, to) == Approx(dot(at_first, at_first)).epsilon(1e-3));
    }
    for (const int particle : {0, 7, 20, 63}) {
      const sim::V3 d = picture.points[static_cast<std::size_t>(particle)] - eye.at;
      const float z = dot(d, eye.forward), scale = eye.focal * kHeight / 2 / z;
      const sim::V3 pixel = seen.front->pixel(0, particle);
      CHECK(pixel.x == Approx(kWidth / 2 + dot(d, eye.right) * scale).margin(0.01));
      CHECK(pixel.y == Approx(kHeight / 2 - dot(d, eye.up) * scale).margin(0.01));
      CHECK(pixel.z == Approx(z).epsilon(1e-5));
    }
  }
  REQUIRE(target);
}

TEST_CASE("keys are words, or another look at the same moment") {
  Seen seen;
  CHECK(seen.key("Space") == Words{"pause"});
  seen.state.playing = false;
  seen.front->show(seen.preview[0], seen.state);
  CHECK(seen.key("Space") == Words{"play"});
  CHECK(seen.key("R") == Words{"reset"});
  CHECK(seen.key("Left") == Words{"back 1"});
  CHECK(seen.key("Right") == Words{"step 1"});
  CHECK(seen.key("u") == Words{"undo"});
  CHECK(seen.key("w") == Words{"switch wind on"});
  CHECK(seen.key("[") == Words{"dt 0.0025"});
  CHECK(seen.key("]") == Words{"dt 0.01"});
  const std::int64_t plain = seen.covered();
  REQUIRE(plain > 2000);
  CHECK(seen.key("f").empty());
  const std::int64_t wires = seen.covered();
  CHECK(wires < plain);
  CHECK(wires > 500);
  seen.key("f");
  CHECK(seen.covered() >= plain);
  seen.key("f");
  seen.key("s");
  CHECK(seen.covered() == plain);
  Words asked;
  for (int k = 0; k < 6; ++k)
    for (const std::string& words : seen.key("c")) asked.push_back(words);
  CHECK(asked == Words{"colour strain", "colour speed", "colour energy", "colour error",
                       "colour mode", "colour none"});
  CHECK_FALSE(seen.front->closed());
  seen.key("q");
  CHECK(seen.front->closed());
}

TEST_CASE("errors are shown once they are there, and systems can be hidden") {
  Seen seen(true);
  CHECK(seen.key("[") == Words{"one: dt 0.0025"});
  for (int k = 0; k < 4; ++k) seen.key("c");
  CHECK(seen.front->picture().colours.empty());
  seen.state.measured = "error";
  sim::Moment moment = seen.preview[0];
  for (sim::Frame& frame : moment) frame.values.assign(64, 0.5);
  moment[0].values[9] = 1;
  seen.front->show(moment, seen.state);
  const sim::Picture coloured = seen.front->picture();
  REQUIRE(coloured.colours.size() == coloured.points.size());
  CHECK(coloured.colours[9].x != coloured.colours[10].x);
  const std::size_t both = coloured.triangles.size();
  seen.key("2");
  CHECK(seen.front->picture().triangles.size() == both / 2);
  seen.key("1");
  CHECK(seen.front->picture().triangles.empty());
  seen.key("2");
  CHECK(seen.covered() > 500);
}
