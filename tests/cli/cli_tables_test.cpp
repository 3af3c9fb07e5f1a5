// Dumps and energies: their headers, rows, numbers and the files they live in.
#include <sys/stat.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <charconv>

#include "tests/cli/json_check.h"
#include "tests/cli/program.h"
#include "tests/support/temporary.h"

namespace sim_test {
namespace {

double number(const std::string& cell) {
  double value = 0;
  const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
  if (error != std::errc() || end != cell.data() + cell.size())
    throw std::runtime_error("no number: " + cell);
  return value;
}

constexpr const char* kFlat =
    "local sim = require 'sim'\n"
    "return sim.scene { name = 'flat', state = { 1, 0.5 }, integrator = 'euler', dt = 0.25,\n"
    "  duration = 1, field = sim.field.lua { function(t, x) return { -x[1], x[2] } end } }\n";

TEST_CASE("a dump of particles has every frame, from 0 to the last") {
  const Outcome outcome = run_sim({"-s", "n=3", "-n", "7", "--every", "3", "--dump"});
  CHECK(outcome.code == 0);
  const auto lines = lines_of(outcome.out);
  REQUIRE(lines.size() == 1 + 4 * 9);
  CHECK(lines[0] == "step,t,particle,x,y,z,vx,vy,vz");
  const std::vector<std::string> steps{"0", "3", "6", "7"};
  for (std::size_t i = 0; i < 36; ++i) {
    const auto cells = cells_of(lines[1 + i]);
    REQUIRE(cells.size() == 9);
    CHECK(cells[0] == steps[i / 9]);
    CHECK(number(cells[1]) == number(cells[0]) * 0.005);
    CHECK(cells[2] == std::to_string(i % 9));
    for (std::size_t c = 3; c < 9; ++c) CHECK_NOTHROW(number(cells[c]));
  }
  // Particle 0 is pinned at the origin, particle 4 starts at (1/3, 0, 1/3).
  CHECK(lines[1] == "0,0,0,0,0,0,0,0,0");
  CHECK(number(cells_of(lines[5])[3]) == 1.0 / 3);
  CHECK(number(cells_of(lines[5])[5]) == 1.0 / 3);
  // Words left standard output, and the verdict is the last of them.
  CHECK(outcome.err.find("scene       cloth") != std::string::npos);
  CHECK(lines_of(outcome.err).back().rfind("trusted: ", 0) == 0);
}

TEST_CASE("--steps 0 writes the initial frame and nothing else") {
  const Outcome dump = run_sim({"--steps", "0", "--dump", "-q"});
  CHECK(dump.code == 0);
  CHECK(lines_of(dump.out).size() == 65);
  CHECK(dump.err.empty());
  const Outcome energy = run_sim({"--time", "0", "--energy=-", "-q"});
  CHECK(lines_of(energy.out).size() == 2);
}

TEST_CASE("first-order tables have no velocities, flat ones components") {
  const Outcome circle = run_sim({"scenes/circle.lua", "-n", "1", "--dump", "-q"});
  const auto lines = lines_of(circle.out);
  REQUIRE(lines.size() == 3);
  CHECK(lines[0] == "step,t,particle,x,y,z");
  CHECK(lines[1] == "0,0,0,1,0,0");
  // One step of the trapezoid rule of h = 0.01 on x' = -y, y' = x.
  CHECK(lines[2] == "1,0.01,0,0.99995,0.01,0");

  const TemporaryFolder folder;
  write_text(folder.path() / "flat.lua", kFlat);
  const Outcome flat = run_sim({"flat.lua", "-n", "1", "--dump", "-q"}, {.folder = folder.path()});
  CHECK(flat.out == "step,t,component,value\n0,0,0,1\n0,0,1,0.5\n1,0.25,0,0.75\n1,0.25,1,0.625\n");
}

TEST_CASE("a world tells its systems apart in a first column") {
  const TemporaryFolder folder;
  write_text(folder.path() / "flat.lua", kFlat);
  write_text(folder.path() / "world.lua",
             "local sim = require 'sim'\nreturn sim.world { a = require 'scenes.circle',\n"
             "  b = require 'scenes.pendulum1', c = require 'flat' }\n");
  const ProgramOptions options{.folder = folder.path(),
                               .environment = {{"SIM_PATH", folder.path().string()}}};
  const Outcome dump = run_sim({"world.lua", "-n", "0", "--dump", "-q"}, options);
  const auto lines = lines_of(dump.out);
  REQUIRE(lines.size() == 1 + 1 + 2 + 2);
  CHECK(lines[0] == "system,step,t,particle,x,y,z,vx,vy,vz");
  CHECK(lines[1] == "a,0,0,0,1,0,0,,,");
  CHECK(lines[2].rfind("b,0,0,0,", 0) == 0);
  CHECK(lines[4] == "c,0,0,0,1,,,,,");
  CHECK(lines[5] == "c,0,0,1,0.5,,,,,");
  for (const std::string& line : lines) CHECK(cells_of(line).size() == 10);

  const Outcome energy = run_sim({"world.lua", "-n", "2", "--energy"}, options);
  const auto rows = lines_of(energy.out);
  REQUIRE(rows.size() == 4);
  CHECK(rows[0] == "system,step,t,kinetic,potential,total,work,drift");
  for (std::size_t i = 1; i < 4; ++i) CHECK(rows[i].rfind("b," + std::to_string(i - 1), 0) == 0);
  CHECK(energy.err.find("'a' is first-order") != std::string::npos);
  CHECK(energy.err.find("'c' is first-order") != std::string::npos);
}

TEST_CASE("the systems of a world go together in time") {
  const TemporaryFolder folder;
  write_text(folder.path() / "falling.lua",
             "local sim = require 'sim'\nlocal function falling(dt)\n"
             "  local p = sim.particles { mass = 1 }\n  p:add({0, 0, 0})\n"
             "  return sim.scene { name = 'falling', particles = p, dt = dt, duration = 20,\n"
             "    integrator = 'verlet', forces = { sim.force.gravity { g = {0, -9.81, 0} } } }\n"
             "end\nreturn sim.world { a = falling(0.01), b = falling(0.005) }\n");
  const auto check = [&](const std::string& scene, const std::string& time, const char* every) {
    const Outcome outcome =
        run_sim({scene, "-T", time, "--dump", "-q", "--every", every}, {.folder = folder.path()});
    double latest = 0;
    for (const std::string& line : lines_of(outcome.out)) {
      if (line.rfind("system,", 0) == 0) continue;
      const double t = number(cells_of(line)[2]);
      if (t < latest - 0.0101) FAIL(line);  // the largest step is 0.01 s
      latest = std::max(latest, t);
    }
    CHECK(latest == Approx(std::stod(time)));
  };
  check("scenes/sample.lua", "0.5", "1");
  check("falling.lua", "20", "7");  // verlet could take seven steps at once
}

TEST_CASE("energies add up and drift from the start") {
  // 3 kg thrown at 1 m/s, 2 m up: 1.5 J + 58.86 J at the start.
  const TemporaryFolder folder;
  write_text(folder.path() / "thrown.lua",
             "local sim = require 'sim'\nlocal p = sim.particles { mass = 3 }\n"
             "p:add({0, 2, 0}, { velocity = {1, 0, 0} })\n"
             "return sim.scene { name = 'thrown', particles = p, dt = 0.1, duration = 1,\n"
             "  forces = { sim.force.gravity { g = {0, -9.81, 0} } }, integrator = 'euler' }\n");
  const Outcome outcome =
      run_sim({"thrown.lua", "-n", "5", "--energy", "-q"}, {.folder = folder.path()});
  const auto lines = lines_of(outcome.out);
  REQUIRE(lines.size() == 7);
  CHECK(lines[0] == "step,t,kinetic,potential,total,work,drift");
  const double start = number(cells_of(lines[1])[4]);
  CHECK(start == Approx(60.36).epsilon(1e-14));
  for (std::size_t i = 1; i < lines.size(); ++i) {
    const auto cells = cells_of(lines[i]);
    REQUIRE(cells.size() == 7);
    CHECK(number(cells[5]) == 0);
    CHECK(number(cells[2]) + number(cells[3]) == number(cells[4]));
    CHECK(number(cells[4]) - start == number(cells[6]));
  }
  // Forward Euler gains m (g h)^2 / 2 a step.
  CHECK(number(cells_of(lines[6])[6]) == Approx(5 * 3 * 0.981 * 0.981 / 2).epsilon(1e-12));
}

TEST_CASE("JSON lines carry the same numbers") {
  const TemporaryFolder folder;
  const Outcome outcome =
      run_sim({"-s", "n=2", "-n", "2", "--dump=d.jsonl", "--energy=e.jsonl", "-q"},
              {.folder = folder.path()});
  CHECK(outcome.code == 0);
  CHECK(outcome.out.empty());
  const auto csv = lines_of(run_sim({"-s", "n=2", "-n", "2", "--dump", "-q"}).out);
  const auto rows = lines_of(read_text(folder.path() / "d.jsonl"));
  REQUIRE(rows.size() + 1 == csv.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const Json row = read_json(rows[i]);
    const auto names = cells_of(csv[0]), cells = cells_of(csv[i + 1]);
    CHECK(row.keys == names);
    for (std::size_t c = 0; c < names.size(); ++c)
      CHECK(row.at(names[c]).number == number(cells[c]));
  }
  const auto energies = lines_of(read_text(folder.path() / "e.jsonl"));
  REQUIRE(energies.size() == 3);
  CHECK(read_json(energies[2]).keys ==
        std::vector<std::string>{"step", "t", "kinetic", "potential", "total", "work", "drift"});
}

TEST_CASE("files are replaced as a whole, by a run that ended or that its scene ended") {
  const TemporaryFolder folder;
  const ProgramOptions options{.folder = folder.path()};
  const auto out = folder.path() / "out.csv";
  write_text(out, "precious\n");
  chmod(out.c_str(), 0640);
  // A right-hand side that fails in the third step.
  write_text(folder.path() / "fails.lua",
             "local sim = require 'sim'\nlocal calls = 0\n"
             "return sim.scene { name = 'fails', state = { 1 }, integrator = 'euler', dt = 0.1,\n"
             "  duration = 1, field = sim.field.lua { function(t, x)\n"
             "    calls = calls + 1\n    if calls > 3 then error('enough') end\n"
             "    return { 1 } end } }\n");
  const Outcome failed = run_sim({"fails.lua", "--dump=out.csv", "-q"}, options);
  INFO(failed.err);
  CHECK(failed.code == 3);
  CHECK(lines_of(read_text(out)).size() == 3);
  write_text(out, "precious\n");
  CHECK(files_in(folder.path()) == 2);

  // A folder of that name, and a name for two tables through a link.
  std::filesystem::create_directory(folder.path() / "d.csv");
  CHECK(run_sim({"--dump=d.csv", "-n", "1"}, options).code == 5);
  std::filesystem::create_symlink("out.csv", folder.path() / "link.csv");
  CHECK(run_sim({"--dump=out.csv", "--energy=link.csv", "-n", "1"}, options).code == 2);
  CHECK(read_text(out) == "precious\n");

  // A good run replaces the file behind the link and keeps its permissions.
  CHECK(run_sim({"-n", "1", "-s", "n=2", "--dump=link.csv", "-q"}, options).code == 0);
  CHECK(lines_of(read_text(out)).size() == 9);
  CHECK(std::filesystem::is_symlink(folder.path() / "link.csv"));
  struct stat status {};
  REQUIRE(stat(out.c_str(), &status) == 0);
  CHECK((status.st_mode & 0777) == 0640);
  CHECK(files_in(folder.path()) == 4);
}

TEST_CASE("words for a closed stream do not end up in a table") {
  const TemporaryFolder folder;
  ProgramOptions options{.folder = folder.path()};
  options.without_err = true;
  CHECK(run_sim({"-s", "n=2", "-n", "0", "--dump=d.csv", "--json"}, options).code == 0);
  const auto rows = lines_of(read_text(folder.path() / "d.csv"));
  REQUIRE(rows.size() == 5);
  CHECK(rows[4].rfind("0,0,3,", 0) == 0);
}

TEST_CASE("devices are written as they are") {
  CHECK(run_sim({"-n", "1", "--dump=/dev/null", "-q"}).code == 0);
  const Outcome outcome = run_sim({"-n", "0", "--dump=/dev/stdout", "--energy=/dev/null"});
  CHECK(outcome.code == 0);
  CHECK(lines_of(outcome.out).size() == 65);
  const Outcome full = run_sim({"-n", "1", "--dump=/dev/full", "-q"});
  CHECK(full.code == 5);
  CHECK(full.err.find("No space left") != std::string::npos);
}

}  // namespace
}  // namespace sim_test
