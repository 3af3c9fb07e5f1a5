// Promises of every plugin there is, old or new: one test a promise, over all names.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>

#include "core/base/array.h"
#include "core/base/error.h"
#include "core/geometry/triangle_mesh.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

constexpr int kCloud = 1500;  // particles

// A strip of triangles over all particles of the cloud.
std::vector<sim::TriangleMesh::Triangle> strip() {
  std::vector<sim::TriangleMesh::Triangle> triangles;
  for (int i = 0; i + 2 < kCloud; ++i)
    triangles.push_back(i % 2 ? sim::TriangleMesh::Triangle{i + 1, i, i + 2}
                              : sim::TriangleMesh::Triangle{i, i + 1, i + 2});
  return triangles;
}

// A parameter list that satisfies every declaration: the example of the plugin, defaults, and 1,
// {1, 2, 3} ... where required.
std::map<std::string, sim::Value> acceptable(const sim::PluginInfo& info) {
  std::map<std::string, sim::Value> given = info.example;
  for (const sim::Param& param : info.params) {
    if (!param.required || given.contains(param.name)) continue;
    switch (param.type) {
      case sim::ParamType::kFlag:
        given[param.name] = true;
        break;
      case sim::ParamType::kInteger:
        given[param.name] = std::int64_t{1};
        break;
      case sim::ParamType::kNumber:
        given[param.name] = std::clamp(1.0, param.min, param.max);
        break;
      case sim::ParamType::kText:
        given[param.name] = std::string("text");
        break;
      case sim::ParamType::kVector:
        given[param.name] = sim::Vec3(1, 2, 3);
        break;
      case sim::ParamType::kSurface:
        given[param.name] = std::make_shared<const sim::TriangleMesh>(kCloud, strip());
        break;
      case sim::ParamType::kMotion:  // no force has one yet
      case sim::ParamType::kLaw:
      case sim::ParamType::kList:
      case sim::ParamType::kPath:
      case sim::ParamType::kCurve:
      case sim::ParamType::kCollider:  // an example has one
      case sim::ParamType::kColliders:
      case sim::ParamType::kBodies:
        break;
      case sim::ParamType::kFunction:
        given[param.name] =
            sim::OdeFunction([](double t, std::span<const double> x, std::span<double> dxdt) {
              for (std::size_t i = 0; i < x.size(); ++i) dxdt[i] = 0.5 * x[x.size() - 1 - i] - t;
            });
        break;
      case sim::ParamType::kParticleFunction:
        given[param.name] = sim::ParticleFunction(
            [](const sim::ParticleView& view, std::span<const int> ids, std::span<double> out) {
              for (std::size_t k = 0; k < out.size(); ++k)
                out[k] = view.t - view.x[ids[k / 3]] * view.vy[ids[k / 3]];
            });
        break;
    }
  }
  return given;
}

bool declares(const sim::PluginInfo& info, const std::string& name) {
  return std::ranges::count(info.params, name, &sim::Param::name) > 0;
}

// A moving cloud of particles, tied in pairs or cells where the force takes them.
sim::SystemSpec make_cloud(const sim::PluginInfo& force) {
  sim::SystemSpec spec;
  spec.name = "cloud";
  spec.integrator = "rk4";
  spec.dt = 1e-3;
  spec.particles.emplace();
  sim::PartSpec part = make_part(force.name, acceptable(force));
  if (declares(force, "stiffness")) part.given["stiffness"] = 5.0;
  if (declares(force, "smoothing")) part.given["density"] = 100.0;  // as it has
  for (int i = 0; i < kCloud; ++i) {
    spec.particles->list.push_back(
        {.position = {std::sin(1.0 + i), std::sin(2.0 + 3 * i), std::sin(3.0 + 7 * i)},
         .velocity = {std::cos(1.0 + i), std::cos(2.0 + 5 * i), std::cos(3.0 + i)},
         .mass = 1 + 0.1 * (i % 7)});
    if (force.elements.arity == 2 && i > 2) part.elements.add({i, i - 1 - i % 2});
    if (force.elements.cells && i > 2) {
      part.elements.arity = 4;
      part.elements.add({i - 3, i - 2, i - 1, i});
    }
  }
  spec.forces = {part};
  return spec;
}

// x' = lambda x in the complex plane, which counts its evaluations.
class Linear final : public sim::OdeSystem {
 public:
  explicit Linear(std::complex<double> lambda) : lambda_(lambda) {}
  std::size_t size() const noexcept override { return 2; }

  void eval(double, const sim::Stage& stage, double* y, double* dydt) override {
    combine(stage, y);
    const std::complex<double> derivative = lambda_ * std::complex<double>(y[0], y[1]);
    dydt[0] = derivative.real();
    dydt[1] = derivative.imag();
    ++evaluations;
  }

  void combine(const sim::Stage& stage, double* out) override {
    double sum[2] = {stage.x[0], stage.x[1]};
    for (const auto& term : stage.terms)
      for (int i = 0; i < 2; ++i) sum[i] += term.coef * term.k[i];
    out[0] = sum[0];
    out[1] = sum[1];
  }

  int evaluations = 0;

 private:
  std::complex<double> lambda_;
};

// With steps of size h, also where the method can do otherwise.
std::unique_ptr<sim::Integrator> make_integrator(const std::string& name, sim::Registry& registry) {
  const sim::IntegratorPlugin& plugin = registry.get<sim::Integrator>(name);
  std::map<std::string, sim::Value> given = acceptable(plugin);
  for (const sim::Param& param : plugin.params)
    if (param.name == "fixed_step") given["fixed_step"] = true;
  return sim::Method(registry, plugin, given).make();
}

}  // namespace

TEST_CASE("every plugin says what it is") {
  sim::Registry registry = make_registry();
  int count = 0;
  for (const sim::PluginKind& kind : sim::kPluginKinds)
    for (const std::string& name : registry.names(kind)) {
      const sim::PluginInfo* info = registry.find(kind, name);
      INFO(name);
      CHECK(info->name == name);
      CHECK(info->kind == kind);
      CHECK(info->summary.size() > 10);
      CHECK(info->summary.find('\n') == std::string::npos);
      CHECK(info->formula.size() > 3);
      CHECK_FALSE(info->file.empty());
      for (const sim::Param& param : info->params) {
        INFO(param.name);
        CHECK_FALSE(param.name.empty());
        CHECK_FALSE(param.doc.empty());
        CHECK(param.min <= param.max);
        // A plugin accepts its own defaults.
        if (std::holds_alternative<double>(param.default_value)) {
          CHECK(std::get<double>(param.default_value) >= param.min);
          CHECK(std::get<double>(param.default_value) <= param.max);
        }
      }
      ++count;
    }
  CHECK(registry.rejected().empty());
  CHECK(count >= 8);
}

TEST_CASE("every plugin refuses parameters it does not have") {
  sim::Registry registry = make_registry();
  for (const std::string& name : registry.names<sim::Force>()) {
    sim::SystemSpec spec = make_cloud(registry.get<sim::Force>(name));
    spec.forces[0].given["no_such_parameter"] = 1.0;
    spec.forces[0].place = "cloud.lua:3";
    INFO(name);
    CHECK_THROWS_WITH(sim::Simulation(spec, registry),
                      Catch::Contains("no_such_parameter") && Catch::Contains("cloud.lua:3"));
  }
}

TEST_CASE("every force is pure and does not depend on threads") {
  sim::Registry registry = make_registry();
  for (const std::string& name : registry.names<sim::Force>()) {
    const sim::SystemSpec spec = make_cloud(registry.get<sim::Force>(name));
    sim::Simulation one(spec, registry), three(spec, registry, {.threads = 3});
    const std::uint64_t start = one.hash();
    REQUIRE(run(one, 20));
    REQUIRE(run(three, 20));
    INFO(name);
    CHECK(one.hash() == three.hash());
    CHECK(one.energy().total() == three.energy().total());
    CHECK(std::isfinite(one.energy().total()));
    const std::uint64_t end = one.hash();
    CHECK(end != start);
    one.reset();
    REQUIRE(run(one, 20));
    CHECK(one.hash() == end);

    // It acts: without it the particles go elsewhere.
    sim::SystemSpec without = spec;
    without.forces.clear();
    sim::Simulation idle(without, registry);
    REQUIRE(run(idle, 20));
    CHECK(idle.hash() != end);
  }
}

TEST_CASE("every field is pure") {
  sim::Registry registry = make_registry();
  for (const std::string& name : registry.names<sim::Field>()) {
    const sim::FieldPlugin& plugin = registry.get<sim::Field>(name);
    const auto field = plugin.make(
        sim::Params("field", plugin.params, acceptable(plugin), {}, plugin.free_numbers));
    // Points, or a flat list: the example of formulas has 3 names in 4 cells.
    const bool flat = name == "formula";
    std::vector<double> x = {1, 2, 3, -0.5, 0.25, 7};
    if (flat) x.insert(x.end(), {0.3, -1, 4, 2, 1.5, -0.75});
    field->bind(x.size(), flat ? 1 : 3);
    std::vector<double> first(x.size()), second(x.size(), 99);
    field->eval(0.5, x, first);
    field->eval(0.5, x, second);
    INFO(name);
    CHECK(same_bits(first, second));
    CHECK(first != std::vector<double>(x.size()));
  }
}

TEST_CASE("every integrator has its order and counts its evaluations") {
  sim::Registry registry = make_registry();
  for (const std::string& name : registry.names<sim::Integrator>()) {
    const auto method = make_integrator(name, registry);
    const sim::IntegratorInfo info = method->info();
    INFO(name);
    if (info.order == 0 || name == "bdf") continue;  // it chooses among the others, or its order
    REQUIRE(info.order >= 1);
    if (info.needs_second_order) {
      Linear system({-0.3, 0.8});
      CHECK_THROWS_WITH(method->prepare(system), Catch::Contains("first order"));
      continue;
    }

    // The error of one step is h^(p + 1): halving h divides it by 2^(p + 1). High orders need
    // larger steps to stay above rounding.
    const std::complex<double> lambda(-0.3, 0.8);
    double error[2];
    for (int half = 0; half < 2; ++half) {
      Linear system(lambda);
      method->prepare(system);
      sim::Array x(2), next(2);
      x[0] = 1;
      const double h = (info.order > 5 ? 0.8 : 0.05) / (half + 1);
      CHECK(method->step(system, 0, h, x.data(), next.data()) == sim::StepStatus::kDone);
      if (info.evaluations > 0) CHECK(system.evaluations == info.evaluations);
      CHECK((x[0] == 1 && x[1] == 0));
      error[half] = std::abs(std::complex<double>(next[0], next[1]) - std::exp(lambda * h));
    }
    CHECK(std::log2(error[0] / error[1]) == Approx(info.order + 1).margin(0.1));
  }
}
