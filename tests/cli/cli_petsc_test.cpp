// Scenes on sim-petsc, where this build has it.
#include <catch2/catch.hpp>
#include <filesystem>

#include "tests/cli/engine_case.h"
#include "tests/support/bare_program.h"

namespace sim_test {
namespace fs = std::filesystem;
using Catch::Contains;

TEST_CASE("sim-petsc makes our implicit and Runge-Kutta steps, on one rank and on two") {
  need_petsc();
  need_program("mpirun", "openmpi-bin");
  const Here here;
  struct Case {
    const char* method;
    double x, v;  // m, m/s
  };
  for (const Case& each :
       {Case{"rk4", 1e-13, 1e-11}, Case{"implicit_euler:tol=1e-12", 1e-11, 1e-9},
        Case{"implicit_midpoint:tol=1e-12", 1e-10, 1e-8}, Case{"trbdf2:tol=1e-12", 1e-10, 1e-8}}) {
    const Words run{"-i", each.method, "-q", "--every", "20"};
    REQUIRE(here.sim(with(run, {"--dump=mine.csv"})).code == 0);
    for (const char* ranks : {"1", "2"}) {
      INFO(each.method << ", ranks " << ranks);
      const Outcome done =
          here.sim(with(run, {"--dump=theirs.csv", "--engine", "petsc", "--ranks", ranks}));
      INFO(done.err);
      REQUIRE(done.code == 0);
      const Apart far = apart(here("mine.csv"), here("theirs.csv"));
      CHECK(far.x <= each.x);
      CHECK(far.v <= each.v);
    }
  }
}

// Pairs begin at one place with one velocity, on springs of rest length 0, which pull the same in
// all directions.
TEST_CASE("sim-petsc takes springs that have no length") {
  need_petsc();
  const Here here;
  write_text(
      here("knot.lua"),
      "local sim = require 'sim'\nlocal p = sim.particles { mass = 0.5 }\n"
      "for i = 0, 5 do p:add({0.1 * (i // 2), 0, 0}, { velocity = {0, 0.2 * (i // 2), 0.1} }) end\n"
      "p:pin(0)\nlocal knots = sim.force.spring { stiffness = 300, rest = 0 }\n"
      "knots:tie(0, 1):tie(2, 3):tie(4, 5):tie(1, 2):tie(3, 4)\n"
      "return sim.scene { particles = p, forces = { sim.force.gravity {}, knots },\n"
      "  integrator = 'implicit_euler', dt = 0.005, duration = 0.5 }\n");
  for (const char* method : {"implicit_euler:tol=1e-12", "implicit_midpoint:tol=1e-12", "rk4"}) {
    const Words run{"knot.lua", "-i", method, "-q", "--every", "20"};
    REQUIRE(here.sim(with(run, {"--dump=mine.csv"})).code == 0);
    const Outcome done = here.sim(with(run, {"--dump=theirs.csv", "--engine", "petsc"}));
    INFO(method << " " << done.err);
    REQUIRE(done.code == 0);
    const Apart far = apart(here("mine.csv"), here("theirs.csv"));
    CHECK(far.x <= 1e-11);
    CHECK(far.v <= 1e-9);
  }
}

TEST_CASE("a run of sim-petsc is reported, judged and continued as any other") {
  need_petsc();
  const Here here;
  const Outcome run =
      here.sim({"-i", "trbdf2", "--engine", "petsc", "--energy=e.csv", "--every", "40"});
  INFO(run.err);
  CHECK(run.code == 0);
  CHECK_THAT(run.err, Contains("PETSc ") && Contains("and the kernel agree to 1"));
  CHECK_THAT(run.out, Contains("engine      petsc, 1 rank"));
  CHECK(lines_of(read_text(here("e.csv"))).size() == 12);
  // Every kind of net, with the step that is left over.
  const auto same = [&](const Words& each) {
    for (const char* method : {"rk4", "implicit_euler:tol=1e-12"}) {
      Words words = with({"net.lua", "-i", method, "-q", "--every", "40"}, each);
      REQUIRE(here.sim(with(words, {"--dump=mine.csv"})).code == 0);
      const Outcome done = here.sim(with(words, {"--dump=theirs.csv", "--engine", "petsc"}));
      INFO(method << " " << done.err);
      REQUIRE(done.code == 0);
      const Apart far = apart(here("mine.csv"), here("theirs.csv"));
      CHECK(far.x <= 2e-12);
      CHECK(far.v <= 1e-10);
    }
  };
  same({});
  same({"-s", "masses=all"});
  same({"-s", "drag=0", "-s", "ties=0"});
  same({"-s", "n=1", "-s", "ties=0", "-s", "pins=0"});
  same({"-s", "n=5", "-s", "pins=5", "-s", "ties=4"});
  same({"-T", "0.3337"});
  REQUIRE(
      here.sim({"net.lua", "-i", "rk4", "-q", "-n", "120", "--engine", "petsc", "--snap", "a.snap"})
          .code == 0);
  REQUIRE(here.sim({"net.lua", "--resume", "a.snap", "-i", "rk4", "-q", "-n", "200", "--engine",
                    "petsc", "--every", "200", "--dump=b.csv"})
              .code == 0);
  REQUIRE(here.sim({"net.lua", "-i", "rk4", "-q", "-n", "200", "--every", "200", "--dump=c.csv"})
              .code == 0);
  const auto last = [&](const char* file) { return lines_of(read_text(here(file))).back(); };
  const auto mine = cells_of(last("c.csv")), theirs = cells_of(last("b.csv"));
  for (std::size_t k = 3; k < 6; ++k)
    CHECK(std::stod(mine[k]) == Approx(std::stod(theirs[k])).margin(2e-13));
}

TEST_CASE("stiff cloth and cloth under pressure are solved there, too") {
  need_petsc();
  const Here here;
  struct Case {
    Words scene;
    double apart;  // m; cloth that buckles goes one way or the other by roundings
  };
  for (const Case& each : {Case{{"-s", "n=16", "-s", "structural=1e6", "-s", "shear=5e5", "-s",
                                 "flex=2e5", "-d", "0.01", "-T", "0.3"},
                                1e-2},
                           Case{{"-s", "n=12", "-d", "0.05", "-T", "2"}, 1e-9}}) {
    const Words run =
        with(with({"-q", "-i", "implicit_euler:tol=1e-10"}, each.scene), {"--every", "5"});
    REQUIRE(here.sim(with(run, {"--dump=mine.csv"})).code == 0);
    const Outcome done =
        here.sim(with(run, {"--no-compare", "--dump=theirs.csv", "--engine", "petsc"}));
    INFO(done.err);
    REQUIRE(done.code == 0);
    CHECK(apart(here("mine.csv"), here("theirs.csv")).x < each.apart);
  }
}

TEST_CASE("what sim-petsc would not mean in the same way is refused") {
  Here here;
  const auto refused = [&](const Words& words, int code, const std::string& why) {
    const Outcome outcome = here.sim(with(words, {"--engine", "petsc", "--dump=x.csv"}));
    INFO(outcome.err);
    CHECK(outcome.code == code);
    CHECK_THAT(outcome.err, Contains(why));
    CHECK_FALSE(fs::exists(here("x.csv")));
  };
  refused({"-i", "verlet"}, 2,
          "petsc takes rk4, implicit_euler, implicit_midpoint and trbdf2: add -i rk4");
  refused({"-i", "dopri5"}, 2, "dopri5");
  refused({"-i", "rk4:precision=single"}, 2, "doubles");
  refused({"-i", "implicit_euler:newton_steps=1"}, 2, "leave newton_steps out");
  refused({"scenes/circle.lua"}, 3, "the first-order state of 'circle'");
  refused({"scenes/cloth_ball.lua", "-i", "rk4"}, 3, "collider 'sphere'");
  refused({"scenes/gas.lua", "-i", "rk4"}, 3, "force 'pair'");
  refused({"--ranks", "65"}, 2, "64 particles");
  refused({"--launch", "/bin/false"}, 5, "petsc failed");
  refused({"--launch", "nowhere -n 2"}, 5,
          "missing program: --launch: there is no nowhere in PATH; name one that is there");
  const TemporaryFolder bare;
  here.options.program = bare_program(bare.path());
  refused({}, 5, "install libpetsc-real-dev and build again");
}

TEST_CASE("a run of sim-petsc that explodes has diverged, and one that is stopped ends it") {
  need_petsc();
  Here here;
  const Outcome lost = here.sim({"-d", "0.05", "-T", "20", "-q", "--engine", "petsc"});
  CHECK(lost.code == 4);
  CHECK_THAT(lost.err, Contains("no solution in reach in petsc at step"));
  here.options.signal = SIGINT;
  here.options.signal_at = "agree to";
  here.options.environment.emplace_back("TMPDIR", here.folder.path().string());
  const Outcome stopped =
      here.sim({"-T", "1e5", "--engine", "petsc", "--dump=x.csv", "--every", "1000"});
  CHECK(stopped.code == 130);
  CHECK_THAT(stopped.err, Contains("suspect: interrupted"));
  CHECK(files_in(here.folder.path()) == 2);  // nothing is left of its own
}

}  // namespace sim_test
