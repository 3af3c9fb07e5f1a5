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
    // Where the pointer is, the particle is to be: nowhere else if the pointer rests.
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
