// Steps of formulas on lattices, row by row, against stages one after the other, bit by bit.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <random>
#include <string>

#include "core/fields/field_system.h"
#include "core/ode/ode_system.h"
#include "core/plugin/registry.h"

using namespace sim;

namespace {

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  int below(int most) { return static_cast<int>(engine_() % static_cast<unsigned>(most)); }
  double number(double least, double most) {
    return std::uniform_real_distribution<double>(least, most)(engine_);
  }

 private:
  std::mt19937 engine_;
};

// A method at random, of no particular order, some of its weights 0.
ExplicitPlan random_plan(Random& random, int stages) {
  ExplicitPlan plan;
  plan.stages = stages;
  const auto weight = [&] { return random.below(3) == 0 ? 0 : random.number(-0.5, 1); };
  for (int i = 0; i < stages; ++i) {
    for (int j = 0; j < stages; ++j) plan.a.push_back(j < i ? weight() : 0);
    plan.b.push_back(weight());
    plan.c.push_back(random.number(0, 1));
  }
  return plan;
}

// A system of two names, or of three, that read near and far neighbours and perhaps t.
struct Lattice {
  std::vector<int> cells;
  Value boundary;
  int names;
  bool reads_time, has_functions;
};

std::string offset(const Lattice& lattice, Random& random, int reach) {
  std::string text = "[";
  for (std::size_t i = 0; i < lattice.cells.size(); ++i) {
    const int most = std::min(reach, lattice.cells[i] - 1);
    text += (i ? ", " : "") + std::to_string(random.below(2 * most + 1) - most);
  }
  return text + "]";
}

FieldSystem make_system(const Lattice& lattice, Random& random) {
  const auto near = [&](const std::string& name) { return name + offset(lattice, random, 1); };
  const auto far = [&](const std::string& name) { return name + offset(lattice, random, 2); };
  List formulas = {"0.3*(" + near("u") + " + " + near("u") + " - 2*u) - u*v" +
                       (lattice.reads_time ? " + 0.1*t" : ""),
                   "max(v, " + far("u") + ")/(2 + abs(" + far("v") + ")) - 0.5*v" +
                       (lattice.has_functions ? " + 0.1*sin(u)" : "")};
  List names = {"u", "v"};
  if (lattice.names == 3) {
    formulas.emplace_back(near("u") + " - sqrt(abs(w))");
    names.emplace_back("w");
  }
  List cells;
  std::size_t size = static_cast<std::size_t>(lattice.names);
  for (const int count : lattice.cells) {
    cells.emplace_back(static_cast<double>(count));
    size *= static_cast<std::size_t>(count);
  }
  Registry registry{{SIM_PLUGIN_DIR}};
  const FieldPlugin& plugin = registry.get<Field>("formula", {});
  auto field = plugin.make(Params(
      plugin.title(), plugin.params,
      {{"formulas", formulas}, {"names", names}, {"cells", cells}, {"boundary", lattice.boundary}},
      {}, true));
  std::vector<double> start(size);
  for (double& each : start) each = random.number(-1, 1);
  return {start, 1, std::move(field)};
}

std::vector<double> after(Stepper& stepper, const std::vector<double>& start, int steps) {
  std::vector<double> x = start, next(x.size());
  for (int done = 0; done < steps;) {
    const int count = stepper.most_of(steps - done);
    CHECK(stepper.step(0.25 + 0.125 * done, 0.125, count, x.data(), next.data()));
    x.swap(next);
    done += count;
  }
  return x;
}

void check_case(const Lattice& lattice, int stages, Random& random) {
  FieldSystem system = make_system(lattice, random);
  const ExplicitPlan plan = random_plan(random, stages);
  const auto rows = system.explicit_stepper(plan);
  const auto plain = system.OdeSystem::explicit_stepper(plan);
  CHECK((rows->at_once() > 1) == !lattice.reads_time);
  CHECK(plain->at_once() == 1);
  const std::vector<double> start(system.start().begin(), system.start().end());
  CAPTURE(lattice.cells, stages, lattice.reads_time, lattice.has_functions, lattice.names);
  CHECK(after(*rows, start, 5) == after(*plain, start, 5));
}

}  // namespace

TEST_CASE("steps on a lattice have the bits of stages one after the other") {
  Random random(17);
  // A lattice that is kept whole, rows that are short and long, and slabs that stages follow each
  // other through.
  const std::vector<std::vector<int>> lattices = {
      {2},      {9},       {3000},      {3, 5},       {90, 37},    {200, 3},
      {61, 64}, {2, 3, 4}, {40, 9, 11}, {33, 1, 130}, {5, 40, 40}, {1, 64, 50}};
  const auto values = [](int names) {
    List list = {0.5, -0.25, 1.5};
    list.resize(static_cast<std::size_t>(names));
    return Value(list);
  };
  int turn = 0;
  for (const std::vector<int>& cells : lattices)
    for (const int stages : {1, 2, 4, 6})
      for (const int edge : {0, 1, 2}) {
        const int names = 2 + turn % 2;
        const Value boundary = edge == 0   ? Value(List{"periodic"})
                               : edge == 1 ? Value(List{"mirror"})
                                           : values(names);
        check_case({cells, boundary, names, turn % 5 == 0, turn % 7 == 0}, stages, random);
        ++turn;
      }
}

TEST_CASE("a lattice that blows up is said not to be finite") {
  Random random(3);
  FieldSystem system = make_system({{40, 40}, Value(List{"periodic"}), 2, false, false}, random);
  ExplicitPlan plan{1, {0}, {1}, {0}};
  const auto stepper = system.explicit_stepper(plan);
  std::vector<double> x(system.start().begin(), system.start().end()), next(x.size());
  CHECK(stepper->step(0, 0.01, 1, x.data(), next.data()));
  CHECK_FALSE(stepper->step(0, 1e6, stepper->at_once(), x.data(), next.data()));
}
