// Checkpoints: bit for bit, and refused when they are not what they should be.
#include "core/session/checkpoint.h"

#include <bit>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <random>

#include "core/base/hash.h"

#include "core/base/error.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::Simulation;

namespace {

sim::Checkpoint checkpoint_of(const Simulation& simulation, const sim::SystemSpec& spec) {
  return {"scene.lua", {{"n", "4"}}, 3, {sim::checkpoint(simulation, spec, 0.5)}};
}

sim::ErrorKind kind_of(const std::string& bytes) {
  try {
    sim::decode(bytes, "file");
  } catch (const sim::Error& error) {
    CHECK(error.text().what == "cannot resume");
    CHECK(error.text().where == "file");
    return error.kind();
  }
  return sim::ErrorKind::kInternal;
}

}  // namespace

TEST_CASE("a run goes on bit for bit from a checkpoint, with every integrator") {
  sim::Registry registry = make_registry();
  int count = 0;
  for (const sim::SystemSpec& spec : {make_cloth(5), make_circle()})
    for (const std::string& name : registry.names<sim::Integrator>()) {
      std::optional<Simulation> first;
      try {
        first.emplace(spec, registry, sim::RunOptions{.integrator = name, .dt = 1e-4});
      } catch (const sim::Error&) {
        continue;  // it does not fit
      }
      INFO(name);
      REQUIRE(run(*first, 37));
      if (first->second_order()) first->set_pinned(12, true);
      first->set_dt(5e-5);
      REQUIRE(run(*first, 10));
      const std::string bytes = encode(checkpoint_of(*first, spec));
      const sim::Checkpoint read = sim::decode(bytes, "file");
      CHECK(read.scene == "scene.lua");
      CHECK(read.settings == std::map<std::string, std::string>{{"n", "4"}});
      CHECK(read.seed == 3);
      CHECK(read.systems[0].start_energy == 0.5);

      Simulation second(spec, registry);
      sim::resume(second, spec, read.systems[0], registry);
      CHECK(second.t() == first->t());
      CHECK(second.hash() == first->hash());
      REQUIRE(run(*first, 100));
      REQUIRE(run(second, 100));
      CHECK(second.hash() == first->hash());
      ++count;
    }
  CHECK(count >= 8);
}

TEST_CASE("numbers that are left out of a checkpoint are 0 at any place, and no others") {
  constexpr std::size_t kCount = 777;  // a few blocks of the writer, and some
  std::vector<double> numbers(kCount);
  for (std::size_t i = 0; i < kCount; ++i) numbers[i] = 1.0 + static_cast<double>(i);
  sim::Checkpoint saved;
  saved.systems.emplace_back().live = numbers;
  const auto check = [&] {
    std::vector<double> expected = numbers;
    for (const std::size_t i : saved.systems[0].zeros) expected[i] = 0;
    const sim::Checkpoint::System read = sim::decode(encode(saved), "file").systems.at(0);
    CHECK(read.x == expected);
    CHECK(read.memory.empty());
  };
  check();
  for (std::size_t i = 0; i < kCount; ++i) {
    INFO(i);
    saved.systems[0].zeros = {i};
    check();
  }
  for (std::size_t every : {1, 2, 3, 255, 256, 257}) {
    INFO("every " << every);
    saved.systems[0].zeros.clear();
    for (std::size_t i = 0; i < kCount; i += every) saved.systems[0].zeros.push_back(i);
    check();
  }
}

TEST_CASE("a checkpoint of another scene is refused, and nothing is changed") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec cloth = make_cloth(5);
  Simulation from(cloth, registry);
  REQUIRE(run(from, 10));
  const sim::Checkpoint saved = checkpoint_of(from, cloth);
  sim::SystemSpec other = make_cloth(5, {.drag = 1});
  Simulation simulation(other, registry);
  const std::uint64_t hash = simulation.hash();
  CHECK_THROWS_AS(sim::resume(simulation, other, saved.systems[0], registry), sim::Error);
  CHECK(simulation.hash() == hash);

  for (const auto& spoil : std::vector<std::function<void(sim::Checkpoint::System&)>>{
           [](auto& s) { s.h = 0; }, [](auto& s) { s.h = INFINITY; }, [](auto& s) { s.step = -1; },
           [](auto& s) { s.pinned = {99}; },
           [](auto& s) {
             s.pinned = {3, 1};
           },
           [](auto& s) { s.x[20] = NAN; }, [](auto& s) { s.x.pop_back(); }}) {
    sim::Checkpoint::System spoilt = saved.systems[0];
    spoil(spoilt);
    CHECK_THROWS_AS(sim::resume(from, cloth, spoilt, registry), sim::Error);
  }
}

TEST_CASE("contents of a checkpoint are taken up to their bounds, and refused beyond them") {
  sim::Registry registry = make_registry();
  sim::SystemSpec cloth = make_cloth(4);
  cloth.forces.back().given["break_strain"] = 5.0;
  cloth.forces.back().switch_name = "flex";
  cloth.forces[1].switch_name = "air";
  Simulation from(cloth, registry);
  REQUIRE(run(from, 10));
  const sim::Checkpoint::System saved = sim::checkpoint(from, cloth, 0.5);
  const int ties = 2 * 4 * 2;  // flex springs of 4 x 4 particles: two in each row and column
  REQUIRE(from.breakable_ties() == ties);
  using Change = std::function<void(sim::Checkpoint::System&)>;
  constexpr std::int64_t kMost = std::int64_t{1} << 53;
  const double nan = std::nan("");
  const std::vector<Change> taken = {
      [](auto&) {},
      [](auto& s) { s.n0 = s.step; },
      [](auto& s) { s.n0 = 0, s.step = 0; },
      [](auto& s) { s.step = kMost - 1, s.n0 = kMost - 3; },
      [](auto& s) { s.t0 = 0; },
      [](auto& s) { s.h = 1e-300; },
      [](auto& s) { s.pinned = {}; },
      [](auto& s) {
        s.pinned = {0, 15};
      },
      [ties](auto& s) {
        s.broken = {0, ties - 1};
      },
      [](auto& s) {
        s.off = {"air", "flex"};
      },
      [](auto& s) { s.off = {"flex"}; },
      [](auto& s) { s.identity.clear(); },  // of an older version
      [](auto& s) { s.start_energy = 7; },
  };
  const std::vector<Change> refused = {
      [](auto& s) { s.h = 0; },
      [](auto& s) { s.h = -s.h; },
      [](auto& s) { s.h = HUGE_VAL; },
      [nan](auto& s) { s.h = nan; },
      [](auto& s) { s.h = 1e308, s.step = 11, s.n0 = 0; },  // its time is not finite
      [](auto& s) { s.t0 = -1e-300; },
      [nan](auto& s) { s.t0 = nan; },
      [](auto& s) { s.t0 = HUGE_VAL; },
      [](auto& s) { s.n0 = -1; },
      [](auto& s) { s.n0 = s.step + 1; },
      [](auto& s) { s.step = kMost, s.n0 = kMost; },
      [](auto& s) {
        s.pinned = {-1, 3};
      },
      [](auto& s) {
        s.pinned = {3, 16};
      },
      [](auto& s) {
        s.pinned = {3, 3};
      },
      [](auto& s) {
        s.pinned = {4, 3};
      },
      [](auto& s) { s.broken = {-1}; },
      [ties](auto& s) { s.broken = {ties}; },
      [](auto& s) {
        s.broken = {2, 2};
      },
      [](auto& s) {
        s.broken = {5, 2};
      },
      [nan](auto& s) { s.broken_energy = nan; },
      [](auto& s) { s.off = {"wind"}; },
      [](auto& s) {
        s.off = {"air", "air"};
      },
      [](auto& s) {
        s.off = {"flex", "air"};
      },
      [nan](auto& s) { s.x.front() = nan; },
      [](auto& s) { s.x.back() = -HUGE_VAL; },
      [](auto& s) { s.x.push_back(0); },
      [](auto& s) { s.x.pop_back(); },
      [](auto& s) { s.memory.push_back(1); },  // rk4 has none
      [nan](auto& s) { s.work.push_back(nan); },
      [](auto& s) { s.identity.begin()->second ^= 1; },
      [](auto& s) { s.identity.erase(s.identity.begin()); },
      [](auto& s) { s.identity["more"] = 1; },
  };
  for (std::size_t i = 0; i < taken.size() + refused.size(); ++i) {
    const bool good = i < taken.size();
    INFO((good ? "taken " : "refused ") << (good ? i : i - taken.size()));
    sim::Checkpoint::System other = saved;
    (good ? taken[i] : refused[i - taken.size()])(other);
    Simulation to(cloth, registry);
    REQUIRE(run(to, 3));
    const std::uint64_t hash = to.hash();
    if (!good) {
      try {
        sim::resume(to, cloth, other, registry);
        FAIL("it is taken");
      } catch (const sim::Error& error) {
        CHECK(error.kind() == sim::ErrorKind::kCheckpoint);
        CHECK(error.text().where == "system 'cloth'");
      }
      CHECK(to.hash() == hash);
      CHECK(to.step_count() == 3);
      CHECK(run(to, 1));
      continue;
    }
    sim::resume(to, cloth, other, registry);
    CHECK(same_bits({to.state().begin(), to.state().end()}, other.x));
    CHECK(to.step_count() == other.step);
    CHECK(to.h() == other.h);
    CHECK(to.t() == other.t0 + static_cast<double>(other.step - other.n0) * other.h);
    CHECK(to.settings().pinned == other.pinned);
    CHECK(to.settings().off == other.off);
    CHECK(to.settings().broken == other.broken);
  }
  // A list of numbers has no particles to pin.
  const sim::SystemSpec circle = make_circle();
  Simulation flat(circle, registry);
  sim::Checkpoint::System pinned = sim::checkpoint(flat, circle, 0);
  pinned.pinned = {0};
  CHECK_THROWS_AS(sim::resume(flat, circle, pinned, registry), sim::Error);
}

TEST_CASE("damaged files are refused") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec cloth = make_cloth(4);
  const Simulation simulation(cloth, registry);
  const std::string bytes = encode(checkpoint_of(simulation, cloth));
  CHECK_NOTHROW(sim::decode(bytes, "file"));
  CHECK(kind_of("") == sim::ErrorKind::kCheckpoint);
  CHECK(kind_of("SIMSNAP\n") == sim::ErrorKind::kCheckpoint);
  CHECK(kind_of(bytes + "x") == sim::ErrorKind::kCheckpoint);
  for (std::size_t size = 0; size < bytes.size(); size += 97)
    CHECK(kind_of(bytes.substr(0, size)) == sim::ErrorKind::kCheckpoint);
  std::minstd_rand random(1);
  for (int i = 0; i < 300; ++i) {
    std::string spoilt = bytes;
    spoilt[random() % spoilt.size()] ^= static_cast<char>(1 + random() % 255);
    CHECK(kind_of(spoilt) == sim::ErrorKind::kCheckpoint);
  }
}

namespace {

// A file as version 3 wrote it, of a system without pins and switches. tag: of the value of a
// parameter; 0: there is none.
std::string version_3(const sim::Checkpoint& checkpoint, std::uint64_t tag = 0) {
  std::string bytes = "SIMSNAP\n";
  const auto word = [&](auto value) {
    static_assert(sizeof value == 8);
    bytes.append(reinterpret_cast<const char*>(&value), 8);
  };
  const auto text = [&](const std::string& value) {
    word(value.size());
    bytes += value;
  };
  const sim::Checkpoint::System& system = checkpoint.systems.front();
  word(std::uint64_t{3});
  text(checkpoint.scene);
  word(checkpoint.seed);
  word(std::uint64_t{0});  // settings
  word(std::uint64_t{1});
  text(system.name);
  word(std::uint64_t{0x123456789});  // the hash of its scene
  text(system.integrator.name);
  word(std::uint64_t{tag > 0});
  if (tag > 0) {
    text("tol");
    word(tag);
    word(0.5);
  }
  for (const double number : {system.h, system.t0, system.start_energy}) word(number);
  for (const std::int64_t number : {system.step, system.n0}) word(number);
  for (int i = 0; i < 2; ++i) word(std::uint64_t{0});  // pins, switches that are off
  for (const std::vector<double>& numbers : {system.x, system.memory, system.work}) {
    word(numbers.size());
    for (const double number : numbers) word(number);
  }
  return sim::sealed(bytes);
}

}  // namespace

TEST_CASE("a checkpoint of version 3, which does not say what it was made of, is read") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec circle = make_circle();
  Simulation from(circle, registry);
  REQUIRE(run(from, 10));
  const sim::Checkpoint read = sim::decode(version_3(checkpoint_of(from, circle)), "file");
  CHECK_FALSE(read.provenance.has_value());
  Simulation to(circle, registry);
  sim::resume(to, circle, read.systems.front(), registry);
  CHECK(to.hash() == from.hash());
  CHECK(to.step_count() == 10);
  CHECK(kind_of(version_3(checkpoint_of(from, circle), 3)) == sim::ErrorKind::kInternal);
  CHECK(kind_of(version_3(checkpoint_of(from, circle), 6)) == sim::ErrorKind::kCheckpoint);
}

TEST_CASE("a checkpoint keeps where the run comes from") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec circle = make_circle();
  const Simulation simulation(circle, registry);
  sim::Checkpoint saved = checkpoint_of(simulation, circle);
  const sim::Provenance made{"sim 1",
                             {{"scene", "/a.lua", 1},
                              {"module 'b'", "/b.lua", 2},
                              {"module 'b'", "/c/b.lua", 0},
                              {"force 'drag'", "/drag.so", 3}},
                             {{"n", "4"}},
                             "half of it"};
  saved.provenance = made;
  const sim::Provenance read = sim::decode(encode(saved), "file").provenance.value();
  CHECK(read.files == made.files);
  CHECK(read.doubt == "half of it");
  CHECK(sim::changes(read, made).empty());

  sim::Provenance now = made;
  now.program = "sim 2";
  now.files = {{"scene", "/d/a.lua", 1},
               {"module 'e'", "/e.lua", 2},
               {"force 'drag'", "/drag.so", 4},
               {"writer 'vtp'", "/vtp.so", 5}};
  now.arguments = {{"n", "5"}, {"m", "1"}};
  CHECK(sim::changes(made, now) ==
        std::vector<std::string>{"force 'drag' (/drag.so)", "module 'b' (no longer read)",
                                 "module 'e' (/e.lua)", "argument m: none, now 1",
                                 "argument n: 4, now 5", "the program: sim 1, now sim 2"});
}

namespace {

// The bytes with one word changed, and a checksum that fits.
std::string forged(std::string bytes, std::size_t at, std::uint64_t word) {
  std::memcpy(bytes.data() + at, &word, 8);
  bytes.resize(bytes.size() - 8);
  sim::StateHash hash;
  for (std::size_t i = 0; i + 8 <= bytes.size(); i += 8) {
    std::uint64_t each;
    std::memcpy(&each, bytes.data() + i, 8);
    hash.add(each);
  }
  for (std::size_t i = bytes.size() / 8 * 8; i < bytes.size(); ++i)
    hash.add(static_cast<std::uint64_t>(static_cast<unsigned char>(bytes[i])));
  const std::uint64_t sum = hash.value();
  bytes.append(reinterpret_cast<const char*>(&sum), 8);
  return bytes;
}

// Reads it, goes on from it and takes some steps; what is wrong is an error.
bool survives(const std::string& bytes, const sim::SystemSpec& spec, sim::Registry& registry) {
  try {
    const sim::Checkpoint read = sim::decode(bytes, "file");
    if (read.systems.size() != 1) return false;
    Simulation simulation(spec, registry);
    sim::resume(simulation, spec, read.systems[0], registry);
    int looks = 0;
    simulation.stop_when([&looks] { return ++looks > 1000; });
    for (int i = 0; i < 3 && simulation.step(); ++i) {}
    return true;
  } catch (const sim::Error& error) {
    CHECK(error.kind() != sim::ErrorKind::kInternal);
    return false;
  }
}

}  // namespace

TEST_CASE("a checkpoint with a right checksum and wrong contents is an error, or a state") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec cloth = make_cloth(3), circle = make_circle();
  const struct {
    const sim::SystemSpec& spec;
    const char* integrator;
  } cases[] = {{cloth, "rk4"},    {cloth, "auto"},  {cloth, "bdf2"},
               {cloth, "dopri5"}, {circle, "auto"}, {circle, "dop853"}};
  const std::uint64_t words[] = {0,
                                 1,
                                 7,
                                 0xffffffff,
                                 0x100000001,
                                 std::uint64_t{1} << 40,
                                 std::uint64_t{1} << 62,
                                 ~std::uint64_t{0} >> 1,
                                 ~std::uint64_t{0},
                                 std::bit_cast<std::uint64_t>(-1.0),
                                 std::bit_cast<std::uint64_t>(3.0),
                                 std::bit_cast<std::uint64_t>(1e300),
                                 std::bit_cast<std::uint64_t>(5e-324),
                                 std::bit_cast<std::uint64_t>(HUGE_VAL),
                                 std::bit_cast<std::uint64_t>(std::nan(""))};
  for (const auto& [spec, integrator] : cases) {
    INFO(integrator);
    Simulation simulation(spec, registry, sim::RunOptions{.integrator = integrator, .dt = 1e-3});
    REQUIRE(run(simulation, 5));
    const std::string bytes = encode(checkpoint_of(simulation, spec));
    CHECK(survives(bytes, spec, registry));
    for (std::size_t at = 16; at + 16 <= bytes.size(); at += 8)
      for (const std::uint64_t word : words) {
        INFO("word " << word << " at " << at);
        survives(forged(bytes, at, word), spec, registry);
      }
  }
}

TEST_CASE("an integrator takes only a memory that it can have written") {
  sim::Registry registry = make_registry();
  const sim::SystemSpec cloth = make_cloth(3);
  for (const char* integrator : {"auto", "bdf2", "dopri5", "rk4"}) {
    INFO(integrator);
    Simulation from(cloth, registry, sim::RunOptions{.integrator = integrator, .dt = 1e-3});
    REQUIRE(run(from, 5));
    const sim::Checkpoint::System saved = sim::checkpoint(from, cloth, 0);
    std::vector<std::vector<double>> wrong{{1}, {99, 1, 1, 1, 1, 1, 1}, saved.memory};
    wrong.back().push_back(0);
    if (std::string(integrator) == "auto")
      for (const double choice : {0.0, 0.5, 7.0, 8.0, -1.0, 1e300}) {
        wrong.push_back(saved.memory);
        wrong.back()[0] = choice;
      }
    for (const std::vector<double>& memory : wrong) {
      sim::Checkpoint::System spoilt = saved;
      spoilt.memory = memory;
      Simulation simulation(cloth, registry);
      const std::uint64_t hash = simulation.hash();
      CHECK_THROWS_AS(sim::resume(simulation, cloth, spoilt, registry), sim::Error);
      CHECK(simulation.hash() == hash);
      CHECK(simulation.step());
    }
  }
}
