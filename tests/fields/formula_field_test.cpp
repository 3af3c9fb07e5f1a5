// First-order systems as formulas: values against plain loops, Jacobians against differences, and
// what is refused.
#include <cmath>
#include <functional>

#include "core/fields/field.h"
#include "core/plugin/registry.h"
#include "core/simd/simd_targets.h"
#include "tests/lua/scene_text.h"
#include "tests/support/kernel_cases.h"
#include "tests/support/scenes.h"

using namespace sim;
using namespace sim::test;

namespace {

using Given = std::map<std::string, Value>;

std::unique_ptr<Field> make_field(const Given& given, std::size_t size) {
  Registry registry{{SIM_PLUGIN_DIR}};
  const FieldPlugin& plugin = registry.get<Field>("formula", {});
  auto field = plugin.make(Params(plugin.title(), plugin.params, given, {}, true));
  field->bind(size, 1);
  return field;
}

// Numbers from 0.5 to 1.5 without a pattern.
std::vector<double> some_state(std::size_t size) {
  std::vector<double> state(size);
  for (std::size_t i = 0; i < size; ++i)
    state[i] = 1 + 0.5 * std::sin(1.7 * static_cast<double>(i * i + 1));
  return state;
}

// df/dx by central differences.
void check_jacobian(const Field& field, double t, const std::vector<double>& x) {
  const std::size_t n = x.size();
  const Sparsity& sparsity = *field.sparsity();
  REQUIRE(sparsity.size() == static_cast<int>(n));
  std::vector<double> values(sparsity.count()), up(n), down(n);
  field.jacobian(t, x, values);
  for (std::size_t column = 0; column < n; ++column) {
    constexpr double kStep = 1e-6;
    std::vector<double> moved = x;
    moved[column] = x[column] + kStep;
    field.eval(t, moved, up);
    moved[column] = x[column] - kStep;
    field.eval(t, moved, down);
    for (std::size_t row = 0; row < n; ++row) {
      const int entry = sparsity.find(static_cast<int>(column), static_cast<int>(row));
      const double exact = entry < 0 ? 0 : values[static_cast<std::size_t>(entry)];
      if (std::fabs((up[row] - down[row]) / (2 * kStep) - exact) > 1e-6 * (1 + std::fabs(exact)))
        FAIL_CHECK("entry (" << row << ", " << column << ") is " << exact);
    }
  }
}

// Two names on a lattice of three directions, u' and v' of near and far neighbours.
void check_lattice(const std::vector<int>& cells, const Value& boundary, const std::string& near,
                   const std::string& far, std::array<int, 3> near_by, std::array<int, 3> far_by,
                   const std::function<int(int, int)>& fold) {
  std::array<int, 3> extents{1, 1, 1};
  std::copy_backward(cells.begin(), cells.end(), extents.end());
  const auto count = static_cast<std::size_t>(extents[0] * extents[1] * extents[2]);
  List list;
  for (const int extent : cells) list.emplace_back(static_cast<double>(extent));
  const auto field =
      make_field({{"formulas", List{"a*u" + near + "*v - u + t", "v" + far + " - v*u" + near}},
                  {"names", List{"u", "v"}},
                  {"cells", list},
                  {"boundary", boundary},
                  {"a", 3.0}},
                 2 * count);
  const std::vector<double> x = some_state(2 * count);
  std::vector<double> dxdt(2 * count);
  constexpr double kTime = 0.25;
  field->eval(kTime, x, dxdt);
  const double beyond[] = {0.75, -2};
  const auto value = [&](std::array<int, 3> cell, const std::array<int, 3>& by, std::size_t name) {
    std::size_t number = 0;
    for (std::size_t k = 0; k < 3; ++k) {
      const int index = fold(cell[k] + by[k], extents[k]);
      if (index < 0) return beyond[name];
      number = number * static_cast<std::size_t>(extents[k]) + static_cast<std::size_t>(index);
    }
    return x[2 * number + name];
  };
  std::size_t cell = 0;
  bool same = true;
  for (int i = 0; i < extents[0]; ++i)
    for (int j = 0; j < extents[1]; ++j)
      for (int k = 0; k < extents[2]; ++k, ++cell) {
        const std::array<int, 3> at{i, j, k};
        const double u = x[2 * cell], v = x[2 * cell + 1], un = value(at, near_by, 0);
        same &= dxdt[2 * cell] == 3 * (un * v) - u + kTime;  // constants come first
        same &= dxdt[2 * cell + 1] == value(at, far_by, 1) - v * un;
      }
  CHECK(same);
  check_jacobian(*field, kTime, x);
}

const std::map<std::string, std::function<int(int, int)>> kFolds = {
    {"periodic", [](int i, int n) { return (i + n) % n; }},
    {"mirror", [](int i, int n) { return i < 0    ? -1 - i
                                         : i >= n ? 2 * n - 1 - i
                                                  : i; }},
    {"values", [](int i, int n) { return i < 0 || i >= n ? -1 : i; }}};

const std::string kLorenz =
    "sim.field.formula { \"s*(y - x)\", \"x*(r - z) - y\", \"x*y - b*z\", names = {\"x\", \"y\", "
    "\"z\"}, s = 10, r = 28, b = 8/3 }";

std::string scene(const std::string& field, const std::string& state = "{1, 1, 1}",
                  const std::string& integrator = "rk4") {
  return "return sim.scene { name = \"s\", state = " + state + ", field = " + field +
         ", integrator = \"" + integrator + "\", dt = 0.01, duration = 1 }";
}

std::vector<double> end_of(const std::string& text, double dt, int count) {
  TextRun run(text, "", dt);
  REQUIRE(run.system.steps(count) > 0);
  while (run.system.step_count() < count) REQUIRE(run.system.step());
  return {run.system.state().begin(), run.system.state().end()};
}

}  // namespace

TEST_CASE("formulas of a lattice read their neighbours, with exact Jacobians") {
  for (const SimdLevel level : simd_levels()) {
    const sim_test::ForcedLevel forced(level);
    for (const auto& [name, fold] : kFolds) {
      INFO(simd_name(level) << ", " << name);
      const Value boundary = name == "values" ? Value(List{0.75, -2.0}) : Value(List{name});
      check_lattice({7}, boundary, "[-1]", "[+3]", {0, 0, -1}, {0, 0, 3}, fold);
      check_lattice({85}, boundary, "[1]", "[-2]", {0, 0, 1}, {0, 0, -2}, fold);
      check_lattice({5, 13}, boundary, "[-1, 2]", "[0, 1]", {0, -1, 2}, {0, 0, 1}, fold);
      check_lattice({3, 4, 5}, boundary, "[1,0,0]", "[ -1, 1, -2 ]", {1, 0, 0}, {-1, 1, -2}, fold);
    }
  }
}

TEST_CASE("three names in cells without neighbours, and a single cell, have exact Jacobians") {
  const Given given = {
      {"formulas", List{"y*z*w; w = exp(-x)", "sin(x*t) - y/(1 + z^2)", "min(x, y) + x^1.7"}},
      {"names", List{"x", "y", "z"}}};
  const auto one = make_field(given, 3);
  check_jacobian(*one, 0.5, {0.7, 1.4, -0.3});
  Given many = given;
  many["cells"] = List{20.0};
  const auto field = make_field(many, 60);
  const std::vector<double> x = some_state(60);
  check_jacobian(*field, 0.5, x);
  // A cell of many has the bits of a single one.
  std::vector<double> all(60), each(3);
  field->eval(0.5, x, all);
  for (std::size_t cell = 0; cell < 20; ++cell) {
    one->eval(0.5, std::span(x).subspan(3 * cell, 3), each);
    for (std::size_t k = 0; k < 3; ++k) CHECK(all[3 * cell + k] == each[k]);
  }
}

TEST_CASE("steps of few formulas as one list of operations have the bits of stages in Lua") {
  const std::string lua =
      "sim.field.lua { function(t, x) return { 10*(x[2] - x[1]), x[1]*(28 - x[3]) - x[2], "
      "x[1]*x[2] - 8/3*x[3] } end }";
  for (const char* method : {"rk4", "euler", "rk3", "dopri5", "dop853", "rkf45"}) {
    INFO(method);
    CHECK(end_of(scene(kLorenz, "{1, 1, 1}", method), 0.01, 700) ==
          end_of(scene(lua, "{1, 1, 1}", method), 0.01, 700));
  }
  const std::string of_time = "sim.field.formula { \"cos(3*t) - x\", names = {\"x\"} }";
  const std::string zero_of_time =
      "sim.field.formula { \"cos(3*t) - x\", \"0\", names = {\"x\", \"y\"}, cells = 2 }";
  const std::vector<double> straight = end_of(scene(of_time, "{1}"), 0.01, 300);
  CHECK(straight[0] == end_of(scene(zero_of_time, "{1, 0, 2, 0}"), 0.01, 300)[0]);
}

TEST_CASE("what is wrong with formulas of a field is said with its place and a remedy") {
  const auto refused = [](const std::string& options, const std::string& state = "{1, 1}") {
    return said(scene("sim.field.formula { " + options + " }", state));
  };
  const std::string two = "names = {\"u\", \"v\"}";
  CHECK(contains(refused("\"u*w\", \"v\", " + two),
                 "bad formula of u': column 3 of 'u*w': 'w' is not known; "));
  CHECK(contains(refused("\"u\", " + two), "it has 1 formula for 2 names"));
  CHECK(contains(refused("\"u\", \"v\", names = {\"u\", \"u\"}"), "the name 'u' is there twice"));
  CHECK(contains(refused("\"u\", \"v\", names = {\"u\", \"t\"}"), "'t' has a meaning already"));
  CHECK(contains(refused("\"u\", \"v\", names = {\"u\", \"2v\"}"), "'2v' is no name"));
  CHECK(contains(refused("\"u\", \"v\", cells = 3, " + two),
                 "the state has 2 numbers, 2 names in 3 cells make 6"));
  CHECK(contains(refused("\"u\", \"v\", cells = 1.5, " + two), "give whole numbers from 1 on"));
  CHECK(contains(refused("\"u\", \"v\", cells = {1, 1, 1, 1}, " + two), "4 directions"));
  CHECK(contains(refused("\"u[1]\", \"v\", " + two), "'u' has no neighbours: there is one cell"));
  const std::string four = "{1, 1, 1, 1}";
  CHECK(contains(refused("\"u[1]\", \"v\", cells = 2, " + two, four), "give boundary ="));
  CHECK(contains(refused("\"u[2]\", \"v\", cells = 2, boundary = \"mirror\", " + two, four),
                 "column 3 of 'u[2]': the lattice has 2 cells in this direction"));
  CHECK(contains(refused("\"u[1]\", \"v\", cells = {2, 2}, boundary = \"mirror\", " + two, four),
                 "write it as u[0, -1]"));
  CHECK(contains(refused("\"u[0.5]\", \"v\", cells = 2, boundary = \"mirror\", " + two, four),
                 "write it as u[-1]"));
  CHECK(contains(refused("\"u[1]\", \"v\", cells = 2, boundary = \"miror\", " + two, four),
                 "boundary is 'miror'"));
  CHECK(contains(refused("\"u[1]\", \"v\", cells = 2, boundary = {1}, " + two, four),
                 "boundary has 1 value for 2 names"));
  CHECK(contains(refused("\"u\", \"v\", cells = 2, boundary = {1, 2}, " + two, four),
                 "no formula reads a neighbour"));
  CHECK(contains(refused("\"1/(u - 1)\", \"v\", " + two),
                 "the formula of u' is not finite at the start"));
  CHECK(contains(refused("\"u\", \"log(v)\", cells = 2, " + two, "{1, 1, 1, -1}"),
                 "the formula of v' is not finite at the start, in cell 1"));
  CHECK(contains(refused("\"u\", \"v\", rate = 2, " + two), "no formula of it reads 'rate'"));
  CHECK(contains(refused("\"u\", 5, " + two), "entry 2 of formulas is a number"));
  CHECK(contains(refused("\"u\", {}, " + two), "entry 2 is to be a number or a text"));
  CHECK(contains(said(scene("sim.field.formula { \"x\", names = {\"x\"} }", "{ x = {{1, 0, 0}} }")),
                 "its state is a flat list"));
}
