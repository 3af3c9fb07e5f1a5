// Scenes on LAMMPS: files of an export, a plain imitation of what it does with them, and itself
// where there is one.
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>

#include "tests/cli/engine_case.h"
#include "tests/support/reference_lammps.h"

namespace sim_test {

using Catch::Contains;

TEST_CASE("an export says the scene in the words of LAMMPS") {
  const Here here;
  write_text(here("swing.lua"),
             "local sim = require 'sim'\n"
             "local p = sim.particles { mass = 2 }\n"
             "p:add { 0, 0, 0 }\n"
             "p:add({ 1, 0, 0 }, { velocity = { 0, 0, 3 } })\n"
             "p:pin(0)\n"
             "local s = sim.force.spring { stiffness = 50 }\n"
             "s:tie(0, 1, { rest = 0.8 })\n"
             "return sim.scene { name = 'swing', particles = p, integrator = 'verlet',\n"
             "  forces = { s, sim.force.gravity { g = { 0, -9.81, 0 } }, sim.force.drag { k = 4 } "
             "},\n"
             "  dt = 0.1, duration = 2 }\n");
  const Outcome made = here.sim({"export", "swing.lua", "--format", "lammps", "out"});
  INFO(made.err);
  REQUIRE(made.code == 0);
  const ReferenceLammps plain(here("out"));
  // By hand: rate 4 / 2 = 2 1/s, y = 0.2, phi = (1 - e^-0.2) / 0.2 = 0.906346234610091;
  // a0 = (-50 (1 - 0.8) / 2, -9.81, 0) = (-5, -9.81, 0).
  constexpr double kPhi = 0.906346234610091;
  CHECK(plain.mass[1] == Approx(2 / kPhi).epsilon(1e-14));
  CHECK(plain.gravity[4] == Approx(2 * -9.81).epsilon(1e-14));
  CHECK(plain.drag == 4);
  CHECK(plain.h == 0.1);
  REQUIRE(plain.bonds.size() == 1);
  CHECK(plain.bonds[0].k == 25);
  CHECK(plain.bonds[0].rest == 0.8);
  CHECK(plain.x == std::vector<double>{0, 0, 0, 1, 0, 0});
  CHECK(plain.group == std::vector<int>{2, 1});
  // w = (e^-0.1 v + ((1 - e^-0.1) / 2 - 0.05 phi) a0) / ((1 + e^-0.2) / 2)
  const double share = ((1 - std::exp(-0.1)) / 2 - 0.05 * kPhi) / ((1 + std::exp(-0.2)) / 2);
  CHECK(plain.v[3] == Approx(-5 * share).epsilon(1e-12));
  CHECK(plain.v[4] == Approx(-9.81 * share).epsilon(1e-12));
  CHECK(plain.v[5] == Approx(3 / std::cosh(0.1)).epsilon(1e-13));
  CHECK(plain.steps == 20);
  REQUIRE(plain.moments.size() == 21);
  CHECK(plain.moments.back() == 21);
  CHECK(plain.lines.at("neigh_modify") == "neigh_modify delay 0 every 1000000000 check no");
  CHECK(plain.lines.at("comm_modify") == "comm_modify cutoff 1.001");
  CHECK_THAT(plain.lines.at("dump_modify"), Contains("every v_moment first yes"));
  CHECK(files_in(here("out")) == 5);
}

TEST_CASE("what the files mean is the run itself, to roundings") {
  const Here here;
  int number = 0;
  for (const Words& each : std::vector<Words>{{},
                                              {"-s", "masses=all"},
                                              {"-s", "drag=0"},
                                              {"-s", "masses=all", "-s", "drag=0"},
                                              {"-s", "ties=0"},
                                              {"-s", "g=0"},
                                              {"-s", "n=1", "-s", "ties=0", "-s", "pins=0"},
                                              {"-s", "n=7", "-s", "pins=7"},
                                              {"-i", "symplectic_euler"},
                                              {"-i", "symplectic_euler", "-s", "masses=all"},
                                              {"-T", "0.3337"},
                                              {"-n", "1"},
                                              {"-n", "0"}}) {
    const std::string folder = "out" + std::to_string(++number);
    INFO(folder);
    const Words run = with({"net.lua", "--every", "10"}, each);
    const Outcome made = here.sim(with(with({"export"}, run), {"-q", folder}));
    INFO(made.err);
    REQUIRE(made.code == 0);
    ReferenceLammps(here(folder)).run(number % 3 + 1);
    const Outcome back = here.sim({"import", folder, "-q", "--dump=theirs.csv"});
    INFO(back.err);
    REQUIRE(back.code == 0);
    REQUIRE(here.sim(with(run, {"-q", "--dump=mine.csv"})).code == 0);
    const Apart far = apart(here("mine.csv"), here("theirs.csv"));
    CHECK(far.x < 2e-13);
    CHECK(far.v < 5e-12);
  }
}

TEST_CASE("results are judged, and compared with the kernel") {
  const Here here;
  REQUIRE(here.sim({"export", "scenes/cloth.lua", "-i", "verlet", "-q", "out"}).code == 0);
  ReferenceLammps(here("out")).run();
  const Outcome back = here.sim({"import", "out", "--energy=e.csv"});
  CHECK(back.code == 0);
  CHECK_THAT(back.err, Contains("the kernel agree to 14.") && Contains("trusted: positions to"));
  CHECK_THAT(back.out, Contains("engine      lammps, results of out"));
  // With work by drag as in a run of our own.
  CHECK(lines_of(read_text(here("e.csv"))).size() == 12);
  const Outcome own = here.sim({"-i", "verlet", "--energy=f.csv", "--every", "40"});
  const auto last = cells_of(lines_of(read_text(here("e.csv"))).back());
  const auto mine = cells_of(lines_of(read_text(here("f.csv"))).back());
  for (std::size_t k = 2; k < 7; ++k)
    CHECK(std::stod(last.at(k)) == Approx(std::stod(mine.at(k))).epsilon(1e-9));

  // Another law of springs than the scene's.
  std::string data = read_text(here("out") / "scene.data");
  data.replace(data.find("\n1 50 0.125"), 11, "\n1 51 0.125");
  write_text(here("out") / "scene.data", data);
  ReferenceLammps(here("out")).run();
  const Outcome wrong = here.sim({"import", "out"});
  CHECK(wrong.code == 8);
  CHECK_THAT(wrong.err, Contains("lammps and the kernel part") && Contains("digits only"));
  CHECK(here.sim({"import", "out", "--no-compare"}).code == 0);
}

TEST_CASE("results that are damaged, cut off or of another run are refused") {
  const Here here;
  REQUIRE(here.sim({"export", "net.lua", "-q", "out"}).code == 0);
  const auto refused = [&](const std::string& why, int code = 6) {
    const Outcome outcome = here.sim({"import", "out", "--dump=x.csv"});
    CHECK(outcome.code == code);
    CHECK_THAT(outcome.err, Contains(why));
    CHECK_FALSE(std::filesystem::exists(here("x.csv")));
  };
  refused("they end at step 0 of 200");
  ReferenceLammps plain(here("out"));
  plain.run();
  const std::filesystem::path file = here("out") / "frames.bin";
  const std::string frames = read_text(file);
  const std::size_t frame = frames.size() / (plain.moments.size());
  const auto changed = [&](std::size_t at, auto value) {
    std::string bytes = frames;
    std::memcpy(bytes.data() + at, &value, sizeof value);
    write_text(file, bytes);
  };
  write_text(file, frames.substr(0, frames.size() - 8));
  refused("take what there is: --steps 199");
  CHECK(here.sim({"import", "out", "-q", "--steps", "199"}).code != 6);
  changed(0, std::int64_t{5});
  refused("no binary dump");
  changed(0, std::int64_t{-60});
  refused("no binary dump");
  changed(18, 7);
  refused("no binary dump");
  changed(22, 1);
  refused("no binary dump");
  changed(34, std::int64_t{61});
  refused("it has 61 particles, the scene 60");
  const std::size_t rows = frame - 80 * 60;
  changed(rows, 61.0);
  refused("that the scene has not");
  changed(rows, 1.5);
  refused("that the scene has not");
  changed(rows, 1.0);
  refused("twice");
  changed(rows + 8, 0.25);
  refused("other positions");
  changed(rows - 4, 10 * 1'000'000);
  refused("damaged");
  changed(rows - 4, -10);
  refused("damaged");
  changed(rows - 8, 0);
  refused("lacks particles");
  changed(frame + rows + 8, std::nan(""));
  const Outcome lost = here.sim({"import", "out", "-q"});
  CHECK(lost.code == 4);
  CHECK_THAT(lost.err, Contains("in lammps a number is not finite at step 1"));
  write_text(file, frames);
  // Notes that do not say how often frames were asked for mean each step.
  const std::string notes = read_text(here("out") / "run.txt");
  const std::size_t every = notes.find("every 20\n");
  REQUIRE(every != std::string::npos);
  write_text(here("out") / "run.txt", notes.substr(0, every));
  REQUIRE(here.sim({"import", "out", "-q", "--energy=each.csv"}).code == 0);
  CHECK(lines_of(read_text(here("each.csv"))).size() == 202);
  write_text(here("out") / "run.txt", "engine gromacs\ntime 1\nevery 1\n");
  refused("does not say what was run");
  std::filesystem::remove(here("out") / "run.txt");
  refused("run.txt", 5);
}

TEST_CASE("what LAMMPS would not mean in the same way is refused before anything is written") {
  const Here here;
  const auto refused = [&](const Words& words, int code, const std::string& why) {
    const Outcome outcome = here.sim(with(with({"export"}, words), {"out"}));
    INFO(outcome.err);
    CHECK(outcome.code == code);
    CHECK_THAT(outcome.err, Contains(why));
    CHECK_FALSE(std::filesystem::exists(here("out")));
    CHECK(here.sim(with(words, {"--engine", "lammps"})).code == code);
  };
  refused({"scenes/cloth.lua"}, 2, "rk4 does; lammps takes verlet and symplectic_euler");
  refused({"scenes/cloth.lua", "-i", "dopri5"}, 2, "dopri5");
  refused({"scenes/cloth.lua", "-i", "verlet:precision=single"}, 2, "doubles");
  refused({"scenes/sample.lua"}, 3, "the first-order state of 'circle'");
  refused({"scenes/circle.lua"}, 3, "first-order");
  refused({"scenes/cloth_ball.lua"}, 3, "collider 'sphere'");
  refused({"scenes/rope.lua", "-i", "verlet"}, 3, "constraint 'distance'");
  refused({"scenes/flag.lua"}, 3, "sim.contact");
  refused({"scenes/twist.lua"}, 3, "a prescribed particle");
  refused({"scenes/gas.lua"}, 3, "force 'pair'");
  refused({"scenes/double_well.lua", "-i", "verlet"}, 3, "force 'expression'");
  write_text(
      here("damped.lua"),
      "local sim = require 'sim'\nlocal p = sim.particles { mass = 1 }\n"
      "p:add { 0, 0, 0 }\np:add { 1, 0, 0 }\n"
      "local s = sim.force.spring { stiffness = 5, damping = 1 }\ns:tie(0, 1)\n"
      "return sim.scene { name = 'd', particles = p, forces = { s }, integrator = 'verlet',\n"
      "  dt = 0.01, duration = 1 }\n");
  refused({"damped.lua"}, 3, "the damping of springs");
  write_text(
      here("weak.lua"),
      "local sim = require 'sim'\nlocal p = sim.particles { mass = 1 }\n"
      "p:add { 0, 0, 0 }\np:add { 1, 0, 0 }\n"
      "local s = sim.force.spring { stiffness = 5, break_strain = 0.3 }\ns:tie(0, 1)\n"
      "return sim.scene { name = 'w', particles = p, forces = { s }, integrator = 'verlet',\n"
      "  dt = 0.01, duration = 1 }\n");
  refused({"weak.lua"}, 3, "force 'spring' with ties that may break");
  write_text(
      here("hub.lua"),
      "local sim = require 'sim'\nlocal p = sim.particles { mass = 1 }\n"
      "for i = 0, 1001 do p:add { i, 0, 0 } end\n"
      "local s = sim.force.spring { stiffness = 5 }\n"
      "for i = 1, 1001 do s:tie(0, i) end\n"
      "return sim.scene { name = 'h', particles = p, forces = { s }, integrator = 'verlet',\n"
      "  dt = 0.01, duration = 1 }\n");
  const Outcome hub = here.sim({"export", "hub.lua", "hub"});
  CHECK(hub.code == 3);
  CHECK_THAT(hub.err, Contains("particle 0") && Contains("1001 springs"));
}

namespace {

struct WorldRuns {
  const Here here;
  const Words tables{"-q", "--dump=mine.csv", "--energy=e.csv", "--every", "10"};
  const Words again{"-q", "--dump=theirs.csv", "--energy=f.csv", "--every", "10"};

  explicit WorldRuns(const char* method);
  void same(const Outcome& done) const;
};

WorldRuns::WorldRuns(const char* method) {
  write_text(
      here("world.lua"),
      "local sim = require 'sim'\n"
      "local function chain(n, dt)\n"
      "  local p = sim.particles { mass = 0.1 }\n"
      "  for i = 0, n do p:add { 0.1 * i, 0, 0 } end\n"
      "  p:pin(0)\n"
      "  local s = sim.force.spring { stiffness = 50 }\n"
      "  for i = 1, n do s:tie(i - 1, i) end\n"
      "  return sim.scene { name = 'chain', particles = p, integrator = 'verlet', dt = dt,\n"
      "    forces = { s, sim.force.gravity {}, sim.force.drag { k = 0.01 } }, duration = 1 }\n"
      "end\n"
      "return sim.world { long = chain(9, 0.002), short = chain(3, 0.005) }\n");
  REQUIRE(here.sim(with({"world.lua", "-i", method}, tables)).code == 0);
}

void WorldRuns::same(const Outcome& done) const {
  INFO(done.err);
  REQUIRE(done.code == 0);
  const auto mine = lines_of(read_text(here("mine.csv")));
  const auto theirs = lines_of(read_text(here("theirs.csv")));
  REQUIRE(mine.size() == theirs.size());
  double most = 0;
  for (std::size_t i = 1; i < mine.size(); ++i) {
    const auto left = cells_of(mine[i]), right = cells_of(theirs[i]);
    for (std::size_t k = 0; k < 4; ++k) REQUIRE(left[k] == right[k]);
    for (std::size_t k = 4; k < 7; ++k)
      most = std::max(most, std::fabs(std::stod(left[k]) - std::stod(right[k])));
  }
  CHECK(most < 1e-13);
  const auto energies = lines_of(read_text(here("e.csv")));
  CHECK(lines_of(read_text(here("f.csv"))).size() == energies.size());
}

}  // namespace

TEST_CASE("each system of a world is a run of its own") {
  const WorldRuns runs("verlet");
  const Here& here = runs.here;
  const Outcome made = here.sim({"export", "world.lua", "out", "--every", "10"});
  INFO(made.err);
  REQUIRE(made.code == 0);
  CHECK_THAT(made.out, Contains("cd out/long; ") && Contains("cd out/short; "));
  ReferenceLammps(here("out") / "long").run();
  CHECK(here.sim({"import", "out"}).code == 6);
  ReferenceLammps(here("out") / "short").run();
  runs.same(here.sim({"import", "out", "-q", "--dump=theirs.csv", "--energy=f.csv"}));
}

TEST_CASE("LAMMPS makes a run of each system of a world") {
  need_program("lmp", "lammps");
  const WorldRuns runs("verlet");
  runs.same(runs.here.sim(with(with({"world.lua"}, runs.again), {"--engine", "lammps"})));
}

TEST_CASE("sim-petsc makes a run of each system of a world") {
  need_petsc();
  const WorldRuns runs("rk4");
  const Words words = with({"world.lua", "-i", "rk4"}, runs.again);
  runs.same(runs.here.sim(with(words, {"--engine", "petsc"})));
}

TEST_CASE("wrong options of engines are told") {
  Here here;
  const auto refused = [&](const Words& words, int code, const std::string& why) {
    const Outcome outcome = here.sim(words);
    INFO(outcome.err);
    CHECK(outcome.code == code);
    CHECK_THAT(outcome.err, Contains(why));
  };
  refused({"-i", "verlet", "--engine", "gromacs"}, 2, "known: lammps");
  refused({"-i", "verlet", "--ranks", "2"}, 2, "add --engine lammps");
  refused({"-i", "verlet", "--engine", "lammps", "--ranks", "0"}, 2, "--ranks '0'");
  refused({"-i", "verlet", "--engine", "lammps", "--ranks", "65"}, 2, "64 particles");
  refused({"-i", "verlet", "--engine", "lammps", "--ranks", "2", "--launch", "lmp"}, 2, "--launch");
  refused({"-i", "verlet", "--engine", "lammps", "--launch", " "}, 2, "no words");
  refused({"-i", "verlet", "--engine", "lammps", "--launch", "nowhere -n 2"}, 5,
          "missing program: --launch: there is no nowhere in PATH; name one that is there");
  refused({"-i", "verlet", "--engine", "lammps", "--launch", "/bin/false"}, 5, "lammps failed");
  refused({"export", "net.lua"}, 2, "a scene and a folder");
  refused({"export", "net.lua", "--format", "gro", "out"}, 2, "known: lammps");
  refused({"export", "net.lua", "nowhere/out"}, 5, "cannot make a folder");
  refused({"export", "net.lua", "net.lua"}, 5, "net.lua: File exists");
  refused({"import", "."}, 5, "start.snap");
  here.options.environment.emplace_back("PATH", "/nonexistent");
  refused({"-i", "verlet", "--engine", "lammps"}, 5, "apt-get install lammps");
  CHECK(files_in(here.folder.path()) == 1);

  // The words of --launch are words, whatever is in them: no shell reads them.
  refused({"-i", "verlet", "--engine", "lammps", "--launch", "/bin/true ; /bin/touch owned"}, 5,
          "lammps failed");
  CHECK_FALSE(std::filesystem::exists(here("owned")));
}

TEST_CASE("an engine of somebody else makes the steps, and is listed and suggested") {
  Here here;
  const std::string library = std::string(SIM_FIXTURE_DIR) + "/free_fall/free_fall.so";
  const Words words{"net.lua", "-s", "ties=0", "-s", "pins=0", "-s", "drag=0", "--load", library};
  const Outcome mine = here.sim(with(words, {"--dump=mine.csv"}));
  const Outcome theirs = here.sim(with(words, {"--dump=theirs.csv", "--engine", "free_fall"}));
  INFO(theirs.err);
  REQUIRE(mine.code == 0);
  REQUIRE(theirs.code == 0);
  CHECK_THAT(theirs.err, Contains("free_fall 1 and the kernel agree to"));
  const Apart off = apart(here("mine.csv"), here("theirs.csv"));
  CHECK(off.x < 1e-13);
  CHECK(off.v < 1e-13);

  CHECK_THAT(here.sim({"list", "engines", "--load", library}).out,
             Contains("free_fall") && Contains("lammps") && Contains("petsc"));
  CHECK_THAT(here.sim(with(words, {"--engine", "free_fal"})).err,
             Contains("did you mean 'free_fall'?"));
  const Outcome refused = here.sim(with(words, {"--engine", "free_fall", "-i", "rk4"}));
  CHECK(refused.code == 2);
  CHECK(here.sim({"export", "net.lua", "--format", "free_fall", "out", "--load", library}).code ==
        2);
}

TEST_CASE("LAMMPS itself makes the run, on one rank and on two") {
  need_program("lmp", "lammps");
  need_program("mpirun", "openmpi-bin");
  const Here here;
  for (const char* method : {"verlet", "symplectic_euler"}) {
    REQUIRE(here.sim({"-i", method, "-q", "--dump=mine.csv"}).code == 0);
    for (const char* ranks : {"1", "2"}) {
      INFO(method << ", ranks " << ranks);
      const Outcome run = here.sim({"-i", method, "--dump=theirs.csv", "--engine", "lammps",
                                    "--ranks", ranks, "--launch", "lmp"});
      CHECK(run.code == 2);
      const Outcome done =
          here.sim({"-i", method, "--dump=theirs.csv", "--engine", "lammps", "--ranks", ranks});
      INFO(done.err);
      REQUIRE(done.code == 0);
      CHECK_THAT(done.err, Contains("LAMMPS (") && Contains("agree to 14."));
      const Apart far = apart(here("mine.csv"), here("theirs.csv"));
      CHECK(far.x <= 1e-13);
      CHECK(far.v <= 1e-11);
    }
  }
}

TEST_CASE("LAMMPS takes every kind of net, and goes on from a checkpoint") {
  need_program("lmp", "lammps");
  const Here here;
  const auto same = [&](const Words& each) {
    const Words run = with({"net.lua", "-q", "--every", "40"}, each);
    REQUIRE(here.sim(with(run, {"--dump=mine.csv"})).code == 0);
    const Outcome done = here.sim(with(run, {"--dump=theirs.csv", "--engine", "lammps"}));
    INFO(done.err);
    REQUIRE(done.code == 0);
    const Apart far = apart(here("mine.csv"), here("theirs.csv"));
    CHECK(far.x <= 2e-13);
    CHECK(far.v <= 5e-12);
  };
  same({});
  same({"-s", "masses=all"});
  same({"-s", "ties=0", "-s", "drag=0"});
  same({"-s", "n=1", "-s", "ties=0", "-s", "pins=0"});
  same({"-s", "n=5", "-s", "pins=5", "-s", "ties=4"});
  same({"-T", "0.3337"});
  REQUIRE(here.sim({"net.lua", "-q", "-n", "120", "--engine", "lammps", "--snap", "a.snap"}).code ==
          0);
  same({"--resume", "a.snap", "-n", "200"});
}

TEST_CASE("a run of LAMMPS that explodes has diverged, and one that is stopped ends it") {
  need_program("lmp", "lammps");
  Here here;
  const Outcome lost =
      here.sim({"-i", "verlet", "-d", "0.02", "-T", "20", "-q", "--engine", "lammps"});
  CHECK(lost.code == 4);
  CHECK_THAT(lost.err, Contains("the energy in lammps was no longer a number at step"));

  here.options.signal = SIGINT;
  here.options.signal_at = "agree to";
  here.options.environment.emplace_back("TMPDIR", here.folder.path().string());
  const Outcome stopped = here.sim(
      {"-i", "verlet", "-T", "1e6", "--engine", "lammps", "--dump=x.csv", "--every", "1000"});
  CHECK(stopped.code == 130);
  CHECK_THAT(stopped.err, Contains("suspect: interrupted"));
  CHECK(lines_of(read_text(here("x.csv"))).size() > 64);
  CHECK(files_in(here.folder.path()) == 2);  // nothing is left of its own
}

}  // namespace sim_test
