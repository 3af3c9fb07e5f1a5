// Every column of every table, read back by a plain reader and compared with numbers of plain
// loops.
#include <catch2/catch.hpp>

#include "tests/output/readers.h"
#include "tests/output/written.h"

namespace sim_test {
namespace {

using Cells = std::map<std::string, std::string>;

double number(const Cells& row, const std::string& name) {
  INFO(name);
  REQUIRE(row.contains(name));
  std::size_t end = 0;
  const double value = std::stod(row.at(name), &end);
  CHECK(end == row.at(name).size());
  return value;
}

constexpr const char* kAxes[] = {"x", "y", "z", "vx", "vy", "vz"};

void check_strip_row(const Cells& row, const StripFrame& frame, int step, std::size_t particle) {
  CHECK(number(row, "step") == step);
  CHECK(number(row, "t") == near(frame.t));
  CHECK(number(row, "particle") == static_cast<double>(particle));
  for (std::size_t c = 0; c < 3; ++c) {
    CHECK(number(row, kAxes[c]) == near(frame.x[particle][c]));
    CHECK(number(row, kAxes[3 + c]) == near(frame.v[particle][c]));
  }
}

void check_strip(const TextRows& table) {
  const auto frames = strip_frames();
  REQUIRE(table.names ==
          std::vector<std::string>{"step", "t", "particle", "x", "y", "z", "vx", "vy", "vz"});
  REQUIRE(table.rows.size() == kStripFrames * kStripParticles);
  for (std::size_t i = 0; i < table.rows.size(); ++i)
    check_strip_row(table.rows[i], frames[i / kStripParticles],
                    static_cast<int>(i / kStripParticles), i % kStripParticles);
}

// `empty` is what stands for a number that a system does not have: in JSON nothing does.
void check_world(const TextRows& table, bool csv) {
  std::size_t at = 0;
  for (std::size_t step = 0; step < kStripFrames; ++step) {
    for (std::size_t i = 0; i < 4; ++i) {
      const Cells& row = table.rows.at(at++);
      CHECK(row.at("system") == "flat");
      CHECK(number(row, "step") == static_cast<double>(step));
      CHECK(number(row, csv ? "particle" : "component") == static_cast<double>(i));
      CHECK(number(row, csv ? "x" : "value") == near(flat_frames()[step][i]));
      for (const char* name : {"y", "z", "vx", "vy", "vz"})
        CHECK((csv ? row.at(name).empty() : !row.contains(name)));
    }
    for (std::size_t i = 0; i < 2; ++i) {
      const Cells& row = table.rows.at(at++);
      CHECK(row.at("system") == "flow");
      CHECK(number(row, "t") == near(kStripStep * static_cast<double>(step)));
      CHECK(number(row, "particle") == static_cast<double>(i));
      for (std::size_t c = 0; c < 3; ++c)
        CHECK(number(row, kAxes[c]) == near(flow_frames()[step][i][c]));
      for (const char* name : {"vx", "vy", "vz"})
        CHECK((csv ? row.at(name).empty() : !row.contains(name)));
    }
    for (std::size_t i = 0; i < kStripParticles; ++i) {
      CHECK(table.rows.at(at).at("system") == "strip");
      check_strip_row(table.rows.at(at++), strip_frames()[step], static_cast<int>(step), i);
    }
  }
  CHECK(at == table.rows.size());
}

// Rods and a plane that hold particles which are at rest or go round, with closed forms.
constexpr const char* kRods = R"lua(
local sim = require "sim"
local p = sim.particles { mass = 2 }
p:add { 0, 0, 0 }
p:add({ 0.6, -0.8, 1.2 }, { velocity = { 0.8, 0.6, 0 } })
p:add({ 5, 0, 0 }, { mass = 3 })
p:pin(0)
return sim.scene { name = "rods", particles = p, integrator = "rk4", dt = 0.01, duration = 0.01,
  forces = { sim.force.gravity { g = { 0.5, -9.81, 0.2 } } },
  constraints = { sim.constraint.distance { ties = { { 1, 0 } } },
    sim.constraint.on_plane { particles = { 2 }, point = { 5, 0, 0 }, normal = { 1, 2, 2 } } } }
)lua";

struct RodForces {
  double tension, plane;     // N
  Triple on_bead, on_plane;  // N
};

RodForces rod_forces() {
  const Triple g{0.5, -9.81, 0.2}, r{0.6, -0.8, 1.2}, n{1.0 / 3, 2.0 / 3, 2.0 / 3};
  const double length = std::hypot(r[0], r[1], r[2]);
  RodForces forces{};
  double along = 0, across = 0;
  for (std::size_t c = 0; c < 3; ++c) {
    along += g[c] * r[c] / length;
    across += g[c] * n[c];
  }
  forces.tension = 2 * (1 / length + along);  // m (v^2 / L + g.r/L), with a speed of 1 m/s
  forces.plane = 3 * std::abs(across);
  for (std::size_t c = 0; c < 3; ++c) {
    forces.on_bead[c] = -forces.tension * r[c] / length;
    forces.on_plane[c] = -3 * across * n[c];
  }
  return forces;
}

const std::vector<std::string> kRun{"-q", "--no-verify"};

std::vector<std::string> with(std::vector<std::string> words) {
  words.insert(words.end(), kRun.begin(), kRun.end());
  return words;
}

}  // namespace

TEST_CASE("tables of states have each number in its column", "[output]") {
  const WritingFolder folder;
  folder.run(with({"strip.lua", "--dump=d.csv", "--out", "a.csv", "--out", "a.jsonl"}));
  folder.run(with({"strip.lua", "--dump=d.jsonl"}));
  for (const char* file : {"d.csv", "a.csv"}) check_strip(read_csv(folder.text(file)));
  for (const char* file : {"d.jsonl", "a.jsonl"}) check_strip(read_json_lines(folder.text(file)));
  folder.run(with({"world.lua", "--dump=w.csv", "--out", "a.csv", "--out", "a.jsonl"}));
  folder.run(with({"world.lua", "--dump=w.jsonl"}));
  for (const char* file : {"w.csv", "a.csv"}) check_world(read_csv(folder.text(file)), true);
  for (const char* file : {"w.jsonl", "a.jsonl"})
    check_world(read_json_lines(folder.text(file)), false);
}

TEST_CASE("tables of flat states and of points have each number in its column", "[output]") {
  const WritingFolder folder;
  folder.run(with({"flat.lua", "--dump=d.csv", "--out", "a.csv"}));
  for (const char* file : {"d.csv", "a.csv"}) {
    const TextRows table = read_csv(folder.text(file));
    REQUIRE(table.names == std::vector<std::string>{"step", "t", "component", "value"});
    REQUIRE(table.rows.size() == 4 * kStripFrames);
    for (std::size_t i = 0; i < table.rows.size(); ++i) {
      CHECK(number(table.rows[i], "step") == static_cast<double>(i / 4));
      CHECK(number(table.rows[i], "t") == near(kStripStep * static_cast<double>(i / 4)));
      CHECK(number(table.rows[i], "component") == static_cast<double>(i % 4));
      CHECK(number(table.rows[i], "value") == near(flat_frames()[i / 4][i % 4]));
    }
  }
  folder.run(with({"flow.lua", "--dump=f.csv"}));
  const TextRows table = read_csv(folder.text("f.csv"));
  REQUIRE(table.names == std::vector<std::string>{"step", "t", "particle", "x", "y", "z"});
  REQUIRE(table.rows.size() == 2 * kStripFrames);
  for (std::size_t i = 0; i < table.rows.size(); ++i)
    for (std::size_t c = 0; c < 3; ++c)
      CHECK(number(table.rows[i], kAxes[c]) == near(flow_frames()[i / 2][i % 2][c]));
}

TEST_CASE("tables of energies and observed quantities have each number in its column", "[output]") {
  const WritingFolder folder;
  folder.run(with({"strip.lua", "--energy=e.csv", "--observe=o.csv"}));
  folder.run(with({"strip.lua", "--energy=e.jsonl", "--observe=o.jsonl"}));
  folder.run(with({"world.lua", "--energy=we.csv", "--observe=wo.csv"}));
  const auto frames = strip_frames();
  const auto check = [&](const TextRows& energies, const TextRows& observed) {
    REQUIRE(energies.rows.size() == kStripFrames);
    double work = 0;
    std::size_t moment = 0;
    for (const Cells& row : energies.rows) {
      const StripFrame& now = frames[moment];
      if (moment > 0) work += kStripStep * (frames[moment - 1].drag_power + now.drag_power) / 2;
      CHECK(number(row, "step") == static_cast<double>(moment));
      CHECK(number(row, "t") == near(now.t));
      CHECK(number(row, "kinetic") == near(now.kinetic));
      CHECK(number(row, "potential") == near(now.potential));
      CHECK(number(row, "total") == near(now.total()));
      CHECK(number(row, "work") == Approx(work).epsilon(1e-2));
      CHECK(number(row, "drift") ==
            Approx(now.total() + number(row, "work") - frames[0].total()).margin(1e-12));
      ++moment;
    }
    moment = 0;
    for (const Cells& row : observed.rows) {
      if (row.contains("system") && row.at("system") != "strip") {
        CHECK((row.at("fast").empty() && row.at("high").empty()));
        continue;
      }
      CHECK(number(row, "step") == static_cast<double>(moment));
      CHECK(number(row, "t") == near(frames[moment].t));
      CHECK(number(row, "fast") == near(frames[moment].v[2][0]));
      CHECK(number(row, "high") == near(frames[moment].x[5][1]));
      ++moment;
    }
    CHECK(moment == kStripFrames);
  };
  check(read_csv(folder.text("e.csv")), read_csv(folder.text("o.csv")));
  check(read_json_lines(folder.text("e.jsonl")), read_json_lines(folder.text("o.jsonl")));
  check(read_csv(folder.text("we.csv")), read_csv(folder.text("wo.csv")));
}

TEST_CASE("forces of constraints are in their columns, of tables of tensions and of states",
          "[output]") {
  const WritingFolder folder;
  write_text(folder.at("rods.lua"), kRods);
  folder.run(with({"rods.lua", "-n", "0", "--tension=t.csv", "--dump=d.csv"}));
  folder.run(with({"rods.lua", "-n", "0", "--tension=t.jsonl", "--dump=d.jsonl"}));
  const RodForces forces = rod_forces();
  const auto check = [&](const TextRows& tensions, const TextRows& states) {
    REQUIRE(tensions.rows.size() == 2);
    const Cells &rod = tensions.rows[0], &plane = tensions.rows[1];
    CHECK(rod.at("constraint") == "distance");
    CHECK(plane.at("constraint") == "on_plane");
    CHECK(number(rod, "a") == 1);
    CHECK(number(rod, "b") == 0);
    CHECK(number(plane, "a") == 2);
    CHECK((!plane.contains("b") || plane.at("b").empty()));
    CHECK(number(rod, "tension") == near(forces.tension));
    CHECK(number(plane, "tension") == near(forces.plane));
    REQUIRE(states.rows.size() == 3);
    for (std::size_t c = 0; c < 3; ++c) {
      const std::string f = std::string("f") + kAxes[c], on = std::string("c") + kAxes[c];
      CHECK(number(rod, f) == near(forces.on_bead[c]));
      CHECK(number(plane, f) == near(forces.on_plane[c]));
      CHECK(number(states.rows[0], on) == near(-forces.on_bead[c]));
      CHECK(number(states.rows[1], on) == near(forces.on_bead[c]));
      CHECK(number(states.rows[2], on) == near(forces.on_plane[c]));
    }
  };
  check(read_csv(folder.text("t.csv")), read_csv(folder.text("d.csv")));
  check(read_json_lines(folder.text("t.jsonl")), read_json_lines(folder.text("d.jsonl")));
}

TEST_CASE("rows of a sweep say what their runs say", "[output]") {
  const WritingFolder folder;
  folder.run({"sweep", "strip.lua", "--over", "integrator=euler,rk4", "--over", "dt=0.01,0.02",
              "--out", "s.csv"});
  const TextRows table = read_csv(folder.text("s.csv"));
  REQUIRE(table.rows.size() == 4);
  const StripFrame last = strip_frames().back();
  for (std::size_t i = 0; i < 4; ++i) {
    const Cells& row = table.rows[i];
    CHECK(number(row, "case") == static_cast<double>(i));
    const double dt = i % 2 ? 0.02 : 0.01;
    CHECK(row.at("integrator") == (i < 2 ? "euler" : "rk4"));
    CHECK(number(row, "dt") == dt);
    CHECK(number(row, "exit") == 0);
    CHECK(number(row, "steps") == (i % 2 ? 2 : 4));
    CHECK(number(row, "evaluations") == (i % 2 ? 2 : 4) * (i < 2 ? 1 : 4));
    CHECK(number(row, "t") == near(0.04));
    CHECK(number(row, "total") == near(number(row, "kinetic") + number(row, "potential")));
    const std::string report = folder
                                   .run({"strip.lua", "--json", "-i", row.at("integrator"), "-d",
                                         row.at("dt"), "--observe=o.csv", "--energy=e.csv"})
                                   .out;
    CHECK(report.find("\"hash\":\"" + row.at("hash") + "\"") != std::string::npos);
    CHECK(report.find("\"verdict\":\"" + row.at("verdict")) != std::string::npos);
    const Cells energy = read_csv(folder.text("e.csv")).rows.back();
    for (const char* name : {"kinetic", "potential", "total", "drift"})
      CHECK(row.at(name) == energy.at(name));
    const Cells seen = read_csv(folder.text("o.csv")).rows.back();
    for (const char* name : {"fast", "high"}) CHECK(row.at(name) == seen.at(name));
  }
  const Cells& euler = table.rows[0];
  CHECK(number(euler, "kinetic") == near(last.kinetic));
  CHECK(number(euler, "potential") == near(last.potential));
  CHECK(number(euler, "fast") == near(last.v[2][0]));
  CHECK(number(euler, "high") == near(last.x[5][1]));
}

TEST_CASE("points of a tradeoff have the errors that Euler's method has on a circle", "[output]") {
  const WritingFolder folder;
  folder.run(
      {"tradeoff", "scenes/circle.lua", "--time", "1", "--integrators", "euler", "--csv", "t.csv"});
  const TextRows table = read_csv(folder.text("t.csv"));
  REQUIRE(table.rows.size() > 5);
  for (const Cells& row : table.rows) {
    const double h = number(row, "dt"), steps = std::round(1 / h);
    // Each step multiplies x + iy by 1 + ih, the solution by e^(ih).
    const double radius = std::pow(1 + h * h, steps / 2), angle = steps * std::atan(h);
    const double dx = radius * std::cos(angle) - std::cos(1.0),
                 dy = radius * std::sin(angle) - std::sin(1.0);
    const double rms = std::hypot(dx, dy) / std::sqrt(3.0);
    CHECK(row.at("system") == "circle");
    CHECK(row.at("integrator") == "euler");
    CHECK(row.at("status") == "finite");
    CHECK(number(row, "order") == 1);
    for (const char* name : {"error", "relative", "error_end"})
      CHECK(number(row, name) == Approx(rms).epsilon(1e-6));
    CHECK(number(row, "max_end") == Approx(std::max(std::abs(dx), std::abs(dy))).epsilon(1e-6));
    CHECK(number(row, "worst") == (std::abs(dx) > std::abs(dy) ? 0 : 1));
    CHECK(row.at("energy").empty());
    for (const char* name : {"steps", "evaluations", "cost"}) CHECK(number(row, name) == steps);
    for (const char* name : {"tol", "newton", "factorisations", "linear"})
      CHECK(number(row, name) == 0);
    CHECK(number(row, "seconds") > 0);
  }
}

}  // namespace sim_test
