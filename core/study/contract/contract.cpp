#include "core/study/contract/contract.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/base/text.h"
#include "core/geometry/triangle_mesh.h"
#include "core/study/contract/examiner.h"
#include "core/study/study.h"

namespace sim::study::contract {
namespace {

class Still final : public RigidMotion {
 public:
  Pose at(double, const Vec3& center) const override { return {.center = center}; }
};

class SlowsDown final : public ContactLaw {
 public:
  double restitution(double approach) const override { return 0.5 / (1 + approach); }
  double friction(double speed) const override { return 0.3 + 0.2 / (1 + speed); }
};

class Parabola final : public ::sim::Curve {
 public:
  Vec3 at(double s, double t) const override { return {s, s * s + 0.3 * t, 0.5 * s - t * s}; }
  bool moves() const override { return true; }
};

Value example_of(const Param& param) {
  switch (param.type) {
    case ParamType::kFlag:
      return true;
    case ParamType::kInteger:
      return static_cast<std::int64_t>(std::clamp(1.0, param.min, param.max));
    case ParamType::kNumber:
      return std::clamp(1.0, param.min, param.max);
    case ParamType::kText:
      return param.choices.empty() ? std::string("text") : param.choices.front();
    case ParamType::kVector:
      return Vec3(1, 2, 3);
    case ParamType::kFunction:
      return OdeFunction([](double t, std::span<const double> x, std::span<double> dxdt) {
        for (std::size_t i = 0; i < x.size(); ++i) dxdt[i] = 0.5 * x[x.size() - 1 - i] - t;
      });
    case ParamType::kParticleFunction:
      return ParticleFunction(
          [](const ParticleView& view, std::span<const int> ids, std::span<double> out) {
            for (std::size_t i = 0, k = 0; i < ids.size(); ++i)
              for (std::size_t end = k + out.size() / ids.size(); k < end; ++k)
                out[k] = -view.x[ids[i]];
          });
    case ParamType::kSurface:  // of a block of particles
      return std::make_shared<const TriangleMesh>(12, grid_triangles({2, 2, 3}, false));
    case ParamType::kMotion:
    case ParamType::kPath:
      return std::make_shared<const Still>();
    case ParamType::kLaw:
      return std::make_shared<const SlowsDown>();
    case ParamType::kCurve:
      return std::make_shared<const Parabola>();
    default:
      return {};
  }
}

std::vector<std::pair<std::string, Value>> extreme_values(const Param& param) {
  std::vector<std::pair<std::string, Value>> values;
  const bool whole = param.type == ParamType::kInteger;
  if (!whole && param.type != ParamType::kNumber) {
    for (const std::string& choice : param.choices) values.emplace_back(choice, choice);
    return values;
  }
  for (const double bound : {param.min, param.max}) {
    if (!std::isfinite(bound)) continue;
    const Value value = whole ? Value(static_cast<std::int64_t>(bound)) : Value(bound);
    values.emplace_back(shortest(bound), value);
  }
  return values;
}

void check_field_bits(const FieldPlugin& plugin, Examiner& examiner, int dimension) {
  const Params params = example_params(plugin);
  const auto field = made(plugin.make(params), plugin);
  constexpr std::size_t kSize = 12;
  field->bind(kSize, dimension);
  std::vector<double> x(kSize), other(kSize), first(kSize), again(kSize);
  for (std::size_t i = 0; i < kSize; ++i) {
    x[i] = std::sqrt(2.0 + static_cast<double>(i)) - 2;
    other[i] = 3 - x[i];
  }
  field->eval(0.25, x, first);
  field->eval(0.5, other, again);
  field->eval(0.25, x, again);
  examiner.check("the same bits again", same(first, again), "with another state between");
  examiner.check("finite", finite(first), std::to_string(kSize) + " numbers");
  examiner.allocations("an evaluation", [&] { field->eval(0.5, other, again); });
  examiner.hash(first);
}

}  // namespace

Params example_params(const PluginInfo& plugin) {
  return Params(plugin.title(), plugin.params, example_values(plugin), {}, plugin.free_numbers);
}

bool same(std::span<const double> a, std::span<const double> b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size_bytes()) == 0;
}

bool finite(std::span<const double> numbers) {
  return std::ranges::all_of(numbers, [](double number) { return std::isfinite(number); });
}

void Examiner::group(const std::string& name, const std::function<void()>& checks) {
  try {
    checks();
  } catch (const std::exception& error) {
    failed(name, error.what());
  } catch (...) {
    failed(name, "it threw something that is no exception");
  }
}

void Examiner::bounds(const std::function<std::vector<double>(const Params&)>& make) {
  int tried = 0, refused = 0;
  std::string wrong;
  for (const Param& param : plugin_.params)
    for (const auto& [text, value] : extreme_values(param)) {
      std::map<std::string, Value> given = example_values(plugin_);
      given[param.name] = value;
      const std::string what = param.name + " = " + text + ": ";
      ++tried;
      try {
        if (!finite(make(Params(plugin_.title(), plugin_.params, given, {}, plugin_.free_numbers))))
          wrong = what + "a number that is not finite";
      } catch (const Error&) {
        ++refused;  // a bound that a plugin refuses, in words
      } catch (const std::exception& error) {
        wrong = what + error.what();
      }
    }
  if (tried == 0) return skipped("parameters at their bounds", "there are no bounds");
  check("parameters at their bounds", wrong.empty(),
        wrong.empty() ? std::to_string(tried) + " tried, " + std::to_string(refused) + " refused"
                      : wrong);
}

void Examiner::allocations(const std::string& again_of, const std::function<void()>& again) {
  constexpr const char* kName = "no memory is taken in a step";
  if (!contract_.allocations) return skipped(kName, "nobody counts allocations");
  const long before = contract_.allocations();
  again();
  const long taken = contract_.allocations() - before;
  check(kName, taken == 0, std::to_string(taken) + " allocations in " + again_of);
}

void check_field(const FieldPlugin& plugin, Contract& contract) {
  Examiner examiner(plugin, contract);
  examiner.group("evaluates", [&] {
    try {
      check_field_bits(plugin, examiner, 3);
    } catch (const Error&) {
      check_field_bits(plugin, examiner, 1);  // it refuses points
    }
  });
  examiner.bounds([&](const Params& params) {
    const auto field = made(plugin.make(params), plugin);
    std::vector<double> x{0.5, 1, -2}, dxdt(3);
    field->bind(3, 3);
    field->eval(0, x, dxdt);
    return dxdt;
  });
}

}  // namespace sim::study::contract

namespace sim::study {

std::map<std::string, Value> example_values(const PluginInfo& plugin) {
  std::map<std::string, Value> given = plugin.example;
  for (const Param& param : plugin.params)
    if (param.required && !given.contains(param.name))
      given[param.name] = contract::example_of(param);
  return given;
}

void check_contract(Registry& registry, const PluginInfo& plugin, Contract& contract) {
  for (const auto& [name, value] : example_values(plugin))
    if (std::holds_alternative<std::monostate>(value)) {
      contract.checks.push_back({plugin.title(), "evaluates", Outcome::kSkipped,
                                 "there is no example of its parameter '" + name + "'"});
      return;
    }
  if (plugin.kind == kind_of<Force>)
    contract::check_force(static_cast<const ForcePlugin&>(plugin), contract);
  else if (plugin.kind == kind_of<Field>)
    contract::check_field(static_cast<const FieldPlugin&>(plugin), contract);
  else if (plugin.kind == kind_of<Integrator>)
    contract::check_integrator(registry, static_cast<const IntegratorPlugin&>(plugin), contract);
  else if (plugin.kind == kind_of<Constraint>)
    contract::check_constraint(static_cast<const Plugin<Constraint>&>(plugin), contract);
  else if (plugin.kind == kind_of<Collider>)
    contract::check_collider(static_cast<const Plugin<Collider>&>(plugin), contract);
  else if (plugin.kind == kind_of<RigidMotion>)
    contract::check_motion(static_cast<const Plugin<RigidMotion>&>(plugin), contract);
  else if (plugin.kind == kind_of<StepCorrection>)
    contract::check_contact(registry, static_cast<const Plugin<StepCorrection>&>(plugin), contract);
  else if (plugin.kind == kind_of<ContactLaw>)
    contract::check_law(static_cast<const Plugin<ContactLaw>&>(plugin), contract);
  else if (plugin.kind == kind_of<Study>)
    contract::check_study(registry, static_cast<const Plugin<Study>&>(plugin), contract);
  else
    contract.checks.push_back({plugin.title(), "registers", Outcome::kOk,
                               "there are no checks of this kind of plugin yet"});
}

}  // namespace sim::study
