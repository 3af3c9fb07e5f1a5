// Dragging by a user: particles follow a line in every method, the work is in the balance, and the
// actions are replayed with the same bits.
#include <catch2/catch.hpp>
#include <sstream>

#include "core/base/error.h"
#include "core/session/replay.h"
#include "core/session/timeline.h"
#include "core/study/accuracy/error_estimator.h"
#include "core/study/energy_balance.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::Action;
using sim::Simulation;
using sim::Timeline;
using sim::Vec3;

namespace {

const auto kOn = [] { return true; };

// Parses the lines of a recording.
sim::Recording recording(const std::string& text) { return sim::parse_recording(text, "r"); }

void replay(
    Simulation& simulation, const std::string& text,
    const std::function<void(std::optional<double>)>& look = [](auto) {}) {
  const sim::Recording all = recording(text);
  const sim::RecordedSystem& hands = all.systems.at("");
  sim::Replay replay(hands.actions);
  look(replay.perform(simulation));
  while (simulation.step_count() < hands.end) {
    REQUIRE(simulation.steps(
                std::min(replay.due(simulation), hands.end - simulation.step_count())) > 0);
    look(replay.perform(simulation));
  }
}

std::string refusal(const std::string& text) {
  try {
    recording(text);
  } catch (const sim::Error& error) {
    return error.what();
  }
  return "";
}

}  // namespace

TEST_CASE("actions are text that reads back to the last bit") {
  for (const char* text :
       {"grab 3", "move 3 0.1 -1e-09 2 over 16", "release 3", "pin 3", "unpin 3", "switch wind off",
        "switch wind on", "dt 0.001", "integrator dopri5:rtol=1e-9", "position 3 0 1 0",
        "velocity 3 0 1 0", "component 0 1.5", "reset"})
    CHECK(sim::to_text(sim::parse_action(text)) == text);
  const Action third{.what = Action::What::kPosition, .particle = 1, .x = {1.0 / 3, -0.0, 1e-310}};
  CHECK(same_bits({sim::parse_action(sim::to_text(third)).x[0]}, {1.0 / 3}));
  for (const char* text :
       {"", "grasp 3", "grab", "grab -1", "grab 1.5", "grab 3 4", "grab nan", "grab 1e99",
        "move 3 0 0 over 5", "move 3 0 0 0 over 0", "move 3 0 0 0 for 4", "move 3 0 0 inf over 4",
        "switch wind", "switch wind maybe", "dt", "dt x", "position 3 0 1e999 0"}) {
    INFO(text);
    CHECK_THROWS_AS(sim::parse_action(text), sim::Error);
  }
}

TEST_CASE("a hand leads a particle along a line, with every method") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec cloth = make_cloth(6);
  for (const std::string& name : methods_for(cloth, registry)) {
    INFO(name);
    Simulation simulation(cloth, registry, {.integrator = name, .dt = 0.002});
    const Vec3 from = simulation.position(33), to = from + Vec3(0.05, -0.02, 0.1);
    std::ostringstream text;
    text << "+0 grab 33\n+0 "
         << sim::to_text({.what = Action::What::kMove, .particle = 33, .x = to, .steps = 20})
         << "\n+10 pin 30\n+30 unpin 30\n";
    replay(simulation, text.str(), [&](auto) {
      const double share = std::min(1.0, static_cast<double>(simulation.step_count()) / 20);
      CHECK((simulation.position(33) - (from + share * (to - from))).norm() < 1e-14);
    });
    CHECK(simulation.velocity(33) == Vec3::Zero());
    CHECK((simulation.position(33) - to).norm() < 1e-14);
    CHECK((simulation.position(32) - from).norm() > 1e-4);  // others follow
  }
}

TEST_CASE("a particle that is let go flies on, and rests where it is pinned") {
  sim::Registry registry = make_registry();
  Simulation simulation(make_falling(2, 0), registry, {.integrator = "verlet", .dt = 0.01});
  replay(simulation, "+0 position 0 0 0 0\n+0 grab 0\n+0 move 0 1 0 0 over 10\n+5 release 0\n");
  CHECK(simulation.velocity(0)[0] == Approx(10));
  REQUIRE(run(simulation, 5));
  CHECK(simulation.position(0)[0] == Approx(1));
  CHECK(simulation.velocity(0)[1] == Approx(-0.05 * kGravity));
  CHECK_THROWS_AS(sim::apply(simulation, sim::parse_action("move 0 1 1 1 over 3")), sim::Error);
  CHECK_THROWS_AS(sim::apply(simulation, sim::parse_action("grab 1")), sim::Error);

  Simulation cloth(make_cloth(4), registry, {.integrator = "rk4", .dt = 0.005});
  replay(cloth, "+0 grab 0\n+0 move 0 0.1 0.1 0.1 over 9\n+5 release 0\n");
  const Vec3 there = cloth.position(0);
  CHECK(there.norm() > 0.05);
  REQUIRE(cloth.steps(20) > 0);
  CHECK(cloth.position(0) == there);
}

TEST_CASE("the work of a hand is in the balance of energy") {
  // With damping, drag and a moved hand: E + W stays, the better the smaller the step.
  sim::Registry registry = make_registry();
  double before = 0;
  for (const int finer : {1, 2, 4}) {
    const double dt = 0.004 / finer;
    Simulation simulation(make_cloth(6), registry, {.integrator = "rk4", .dt = dt});
    sim::study::EnergyBalance balance(simulation);
    const auto steps = [&](int n) { return std::to_string(n * finer); };
    const std::string text = "+" + steps(10) + " grab 33\n+0 move 33 0.5 -0.5 0.9 over " +
                             steps(50) + "\n+" + steps(30) + " move 33 0.9 -0.2 0.6 over " +
                             steps(40) + "\n+" + steps(60) + " release 33\n+" + steps(50) +
                             " pin 20\n";
    double start = simulation.energy().total(), pulled = 0;
    const sim::Recording all = recording(text);
    sim::Replay hands(all.systems.at("").actions);
    while (simulation.step_count() < all.systems.at("").end) {
      if (const auto energy = hands.perform(simulation)) {
        balance.touched(*energy);
        start += *energy;
      }
      REQUIRE(simulation.step());
      balance.advance();
      balance.look();
      pulled = std::min(pulled, balance.taken());
    }
    const double off = std::abs(simulation.energy().total() + balance.taken() - start);
    INFO(dt << " s: off by " << off << " J, of " << pulled << " J that the hand gave");
    CHECK(pulled < -0.5);
    CHECK(std::abs(balance.error()) < -1e-3 * pulled);
    if (before > 0) CHECK(off < 0.4 * before);
    before = off;
  }
}

TEST_CASE("a timeline keeps what hands did: every step comes again bit for bit") {
  sim::Registry registry = make_registry();
  for (const char* method : {"rk4", "verlet", "dopri5", "trbdf2", "bdf2"}) {
    INFO(method);
    Simulation simulation(make_cloth(5), registry, {.integrator = method, .dt = 0.002});
    Timeline timeline(simulation);
    std::vector<std::uint64_t> hashes;
    const auto act = [&](const std::string& text) {
      timeline.act(simulation, sim::parse_action(text));
    };
    for (int n = 0; n <= 300; ++n) {
      if (n == 20) timeline.part(simulation), act("grab 24");
      if (n >= 20 && n < 150 && n % 4 == 0)
        act("move 24 " + std::to_string(0.8 + 0.001 * n) + " -0.2 0.9 over 4");
      if (n == 160) act("release 24");
      if (n == 200) timeline.part(simulation), act("dt 0.001");
      if (n == 220) act("pin 12");
      hashes.push_back(simulation.hash());
      REQUIRE(timeline.step(simulation));
    }
    for (const int step : {300, 0, 21, 150, 149, 20, 64, 128, 199, 200, 201, 220, 153, 152, 290}) {
      INFO(step);
      REQUIRE(timeline.go_to(simulation, step, kOn));
      CHECK(simulation.hash() == hashes[static_cast<std::size_t>(step)]);
    }
    REQUIRE(timeline.go_to(simulation, 250, kOn));
    CHECK(timeline.edits() == 2);
    // One undo takes back one drag.
    REQUIRE(timeline.undo(simulation));
    CHECK(simulation.step_count() == 200);
    CHECK(simulation.h() == 0.002);
    REQUIRE(timeline.undo(simulation));
    CHECK(simulation.step_count() == 20);
    CHECK(simulation.settings().held.empty());
    CHECK_FALSE(timeline.undo(simulation));
  }
}

TEST_CASE("a minute of dragging keeps the start within reach") {
  sim::Registry registry = make_registry();
  Simulation simulation(make_cloth(24), registry, {.integrator = "verlet", .dt = 0.002});
  Timeline timeline(simulation, std::size_t{1} << 20);
  const std::uint64_t start = simulation.hash();
  timeline.act(simulation, sim::parse_action("grab 575"));
  for (int n = 0; n < 1200; ++n) {
    timeline.act(simulation,
                 sim::parse_action("move 575 0.9 " + std::to_string(-0.0001 * n) + " 0.9 over 3"));
    REQUIRE(timeline.steps(simulation, 3) > 0);
  }
  CHECK(timeline.first() == 0);
  CHECK(timeline.bytes() <= std::size_t{1} << 20);
  REQUIRE(timeline.undo(simulation));
  CHECK(simulation.hash() == start);
}

TEST_CASE("a recording of a session with steps back, undo and reset leads to the same bits") {
  sim::Registry registry = make_registry();
  const auto made = [&] {
    return Simulation(make_cloth(5), registry, {.integrator = "verlet", .dt = 0.005});
  };
  Simulation session = made();
  Timeline timeline(session);
  std::string text;
  sim::RecordingWriter writer([&](std::string_view lines) { text += lines; }, {{"scene", "cloth"}},
                              false);
  const auto act = [&](const std::string& words) {
    const Action action = sim::parse_action(words);
    writer.action("", session.step_count(), action);
    timeline.act(session, action);
  };
  const auto steps = [&](int n) {
    while (n > 0) n -= timeline.steps(session, n);
  };
  const auto back = [&](std::int64_t to) {
    writer.back("", session.step_count(), to);
    REQUIRE(timeline.go_to(session, to, kOn));
  };
  const auto undo = [&] {
    const std::int64_t from = session.step_count();
    const std::size_t before = timeline.actions();
    REQUIRE(timeline.undo(session));
    writer.undo("", before - timeline.actions(), from, session.step_count());
  };
  steps(10), act("grab 24"), act("move 24 1 -0.3 1 over 8"), steps(30);
  timeline.part(session), act("pin 12"), steps(5), undo(), steps(3);
  act("release 24"), steps(20), back(30), steps(10), act("pin 7");
  // A reset keeps settings, and nothing else.
  writer.reset("", session.step_count());
  session.reset();
  timeline = Timeline(session);
  steps(12), timeline.part(session), act("grab 20"), act("move 20 0.9 0.2 0.1 over 30"), steps(8);
  timeline.part(session), act("unpin 7"), steps(1), undo(), steps(40), back(50);
  writer.end("", session.step_count(), session.hash());

  const sim::Recording read = recording(text);
  CHECK(read.whole);
  REQUIRE(read.systems.at("").hash);
  CHECK(*read.systems.at("").hash == session.hash());
  Simulation again = made();
  replay(again, text);
  CHECK(again.hash() == session.hash());
}

TEST_CASE("a recording may be cut off anywhere") {
  sim::Registry registry = make_registry();
  const std::string text =
      "# a recording\nscene x\nset n=3\n+12 grab 8\n+0 move 8 0.1 -0.25 0.125 over 12\n"
      "+12 release 8\n+3 back 2\n+1 switch wind off\n+5 undo 1\n+0 end 0123456789abcdef\n";
  std::int64_t last = 0;
  for (std::size_t length = 0; length <= text.size(); ++length) {
    const sim::Recording read = recording(text.substr(0, length));
    CHECK(read.whole == (length == text.size()));
    if (read.systems.empty()) continue;
    const sim::RecordedSystem& hands = read.systems.at("");
    for (const auto& each : hands.actions) CHECK(each.step <= hands.end);
    if (text.substr(0, length).find("back") == std::string::npos) {
      CHECK(hands.end >= last);
      last = hands.end;
    }
  }
  CHECK(recording(text).systems.at("").end == 26);
}

TEST_CASE("what is no recording is refused with its line") {
  const auto says = [](const std::string& text, const std::string& part) {
    const std::string why = refusal(text);
    INFO(text << " -> " << why);
    CHECK(why.find(part) != std::string::npos);
  };
  says("+1 grab 1\n+x grab\n", "r:2");
  says("+1 grab\n", "grab PARTICLE");
  says("+1 grabb 1\n", "did you mean 'grab'");
  says("+-1 grab 1\n", "no number of steps");
  says("+99999999999999999999 grab 1\n", "no number of steps");
  says("+9000000000000000 grab 1\n+9000000000000000 grab 1\n", "too many steps");
  says("grab 1\n", "neither +STEPS nor a word of the header");
  says("+1 grab 1\nscene x\n", "belongs above");
  says("scene\n", "no value");
  says("+1 back 2\n", "back");
  says("+1 undo 1\n", "takes back");
  says("+1 undo 18446744073709551615\n", "takes back");
  says("+1 end abc\n", "16 digits");
  says("+1 end 0123456789abcdef\n+1 grab 1\n", "has ended");
  says(std::string("\x7f\x45LF\0\1\2\n", 8), "r:1");
  says("+1 move 1 2 3 4 over 99999999999999\n", "number of steps");
}

// The place, why, and what to do, in this order.
TEST_CASE("refusals of a recording are whole sentences") {
  const std::pair<const char*, const char*> cases[] = {
      {"+x grab 1\n", "bad line: r:1: '+x' is no number of steps; write +STEPS ACTION"},
      {"\ngrab 1\n",
       "bad line: r:2: 'grab' is neither +STEPS nor a word of the header; write +STEPS ACTION"},
      {"+1 grab 1\nscene x\n",
       "bad line: r:2: 'scene' belongs above the first +STEPS; put it there"},
      {"scene\n", "bad line: r:1: 'scene' has no value; give one, or remove it"},
      {"+1 end 0123456789abcdef\n+1 grab 1\n",
       "bad line: r:2: the recording has ended before it; remove what comes after the end"},
      {"+9000000000000000 grab 1\n+9000000000000000 grab 1\n",
       "bad line: r:2: too many steps; write fewer"},
      {"+1 end abc\n",
       "bad line: r:1: the end has no hash of 16 digits; remove the line to replay without it"},
      {"+1 back 2\n", "bad line: r:1: it goes back '2' steps of 1; write +STEPS back N"},
      {"+1 undo 1\n", "bad line: r:1: it takes back '1' actions of 0; write +STEPS undo N"}};
  for (const auto& [text, whole] : cases) CHECK(refusal(text) == whole);
}

// Whole with the hash of every system at its end.
TEST_CASE("a recording is whole when all of its systems have ended") {
  const auto whole = [](const std::string& text) { return recording(text).whole; };
  const std::string end = "end 0123456789abcdef\n";
  CHECK_FALSE(whole(""));
  CHECK_FALSE(whole("+1 grab 1\n"));
  CHECK(whole("+1 grab 1\n+2 " + end));
  CHECK_FALSE(whole("+1 grab 1\n+2 end 0123456789abcdef"));  // a line that was cut off
  CHECK(whole("+1 a: " + end + "+1 b: " + end));
  CHECK_FALSE(whole("+1 a: " + end + "+1 b: grab 1\n"));
  CHECK_FALSE(whole("+1 a: grab 1\n+1 b: " + end));
}

// A live view informs the companion before and after an action of a user.
TEST_CASE("errors are known while hands pull, for their companion is under the same hands") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec cloth = make_cloth(6);
  Simulation run(cloth, registry), exact(cloth, registry, {.dt = cloth.dt / 16});
  sim::study::ErrorEstimator told(cloth, run, registry), untold(cloth, run, registry);
  Timeline timeline(run);
  bool behind = false;
  const auto before = [&] {
    if (behind) told.follow(run);
    told.advance(run);
    behind = true;
  };
  timeline.before_touch(before);
  sim::Moves moves;
  const auto act = [&](const std::string& text) {
    before();
    timeline.act(run, sim::parse_action(text));
    told.follow(run);
    behind = false;
    sim::Action finer = sim::parse_action(text);
    finer.steps *= 16;
    sim::apply(exact, finer);
    moves.note(finer, exact.step_count());
  };
  const auto go = [&](int steps) {
    for (int k = 0; k < steps; ++k) {
      REQUIRE(timeline.step(run));
      for (int j = 0; j < 16; ++j) {
        REQUIRE(exact.step());
        moves.end_due(exact);
      }
    }
  };
  go(30);
  act("grab 35");
  act("move 35 0.9 -0.3 0.6 over 25");
  go(40);
  act("pin 10");
  act("move 35 0.8 -0.2 0.7 over 10");
  go(12);
  act("release 35");
  go(30);
  const auto most = [](const std::vector<double>& errors) { return std::ranges::max(errors); };
  double off = 0;
  for (int i = 0; i < run.particles(); ++i)
    off = std::max(off, (run.position(i) - exact.position(i)).norm());
  CHECK(off > 1e-9);
  CHECK(most(told.errors(run)) == Approx(off).epsilon(0.5));
  CHECK(most(untold.errors(run)) > 100 * off);
}
