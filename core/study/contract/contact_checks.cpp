// Checks of contact on two sheets, or two bodies, that a free step moves through each other.
#include <cmath>
#include <optional>

#include "core/base/text.h"
#include "core/particles/particle_system.h"
#include "core/particles/step_correction.h"
#include "core/scene/simulation.h"
#include "core/study/contract/examiner.h"

namespace sim::study::contract {
namespace {

constexpr double kContactStep = 0.05;  // s

SystemSpec still_scene() {
  SystemSpec spec;
  spec.name = "contact";
  spec.particles.emplace();
  spec.integrator = "symplectic_euler";
  spec.dt = kContactStep;
  return spec;
}

// Two sheets of 4 x 4 particles, 0.02 m apart and nearer by 0.1 m after a step.
SystemSpec two_sheets(const std::string& plugin, const std::map<std::string, Value>& given) {
  constexpr int kSide = 4, kCount = kSide * kSide;
  SystemSpec spec = still_scene();
  spec.contact = ContactSpec{.given = given, .plugin = plugin};
  for (int sheet = 0; sheet < 2; ++sheet) {
    auto triangles = grid_triangles({kSide, kSide, 1}, false);
    for (auto& triangle : triangles)
      for (int& id : triangle) id += sheet * kCount;
    spec.contact->surfaces.push_back(
        std::make_shared<const TriangleMesh>(2 * kCount, std::move(triangles)));
    for (int i = 0; i < kSide; ++i)
      for (int j = 0; j < kSide; ++j)
        spec.particles->list.push_back(
            {.position = {0.1 * i + 0.03 * sheet, 0.02 * sheet, 0.1 * j + 0.04 * sheet},
             .velocity = {0, 1.0 - 2 * sheet, 0.3 * sheet},
             .mass = 1.0 + sheet});
  }
  spec.surfaces = spec.contact->surfaces;
  return spec;
}

// Two boxes, 0.05 m apart and nearer by 0.1 m after a step.
SystemSpec two_bodies(const std::string& plugin, const std::map<std::string, Value>& given) {
  SystemSpec spec = still_scene();
  spec.contact = ContactSpec{.given = given, .plugin = plugin};
  for (int k = 0; k < 2; ++k) {
    RigidShape box{.form = RigidShape::Form::kBox, .half = {0.1, 0.1, 0.1}};
    spec.bodies.push_back({.shape = std::make_shared<const RigidShape>(std::move(box)),
                           .mass = 1.0 + k,
                           .position = {0.03 * k, 0.25 * k, 0},
                           .velocity = {0, 1.0 - 2 * k, 0.1 * k},
                           .surface = {.restitution = 0.5, .friction = 0.3}});
  }
  place_bodies(spec);
  return spec;
}

// The end of a step of that scene, before and after its contact.
class ContactStep {
 public:
  ContactStep(Registry& registry, const PluginInfo& plugin,
              const std::map<std::string, Value>& given)
      : system_(scene(registry, plugin, given)),
        particles_(dynamic_cast<ParticleSystem&>(system_->ode())),
        start_(system_->state().begin(), system_->state().end()),
        free_(start_) {
    const Layout& layout = particles_.layout();
    const auto v = layout.axes(start_.data(), 3);
    const auto q = layout.axes(free_.data());
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < layout.n(); ++i) q[axis][i] += kContactStep * v[axis][i];
    end_.resize(free_.size());
  }

  StepCorrection& contact() const { return *system_->corrections().back(); }
  const char* of() const { return bodies_ ? "two bodies" : "two sheets"; }

  StepCorrection::Outcome apply() {
    std::ranges::copy(free_, end_.begin());
    return contact().apply({0, kContactStep, start_.data(), end_.data()});
  }
  const std::vector<double>& start() const { return start_; }
  const std::vector<double>& free() const { return free_; }
  const std::vector<double>& end() const { return end_; }

 private:
  std::unique_ptr<Simulation> scene(Registry& registry, const PluginInfo& plugin,
                                    const std::map<std::string, Value>& given) {
    try {
      return std::make_unique<Simulation>(two_sheets(plugin.name, given), registry);
    } catch (const Error& refused) {  // surfaces, or these parameters
      try {
        auto bodies = std::make_unique<Simulation>(two_bodies(plugin.name, given), registry);
        bodies_ = true;
        return bodies;
      } catch (const Error&) {
        throw refused;
      }
    }
  }

  bool bodies_ = false;
  std::unique_ptr<Simulation> system_;
  ParticleSystem& particles_;
  std::vector<double> start_, free_, end_;
};

void check_steps(ContactStep& scene, Examiner& examiner) {
  using Outcome = StepCorrection::Outcome;
  StepCorrection& contact = scene.contact();
  const std::vector<double> start = scene.start(), memory = contact.memory();
  const Outcome outcome = scene.apply();
  const std::vector<double> end = scene.end();
  const bool whole = outcome != Outcome::kUnchanged || same(end, scene.free());
  examiner.check("an unchanged step keeps its bits", whole,
                 outcome == Outcome::kUnchanged ? "it was" : "it was not");
  examiner.check("a step that fails says why",
                 (outcome == Outcome::kFailed) == !contact.failure().empty(), contact.failure());
  examiner.check("a step that may not be halved is never too long", outcome != Outcome::kTooLong,
                 scene.of());
  examiner.check("the old state is left as it is", same(start, scene.start()), "");
  const double taken = contact.take_dissipation(0);
  examiner.check("finite", finite(end) && std::isfinite(taken), scene.of());
  examiner.check("its energy is accounted for once", contact.take_dissipation(0) == 0,
                 brief(taken, 3) + " J of the step");
  examiner.check("it says what it did",
                 !contact.title().empty() && !contact.account().words.empty(),
                 contact.account().words);

  contact.recall(memory);
  scene.apply();
  examiner.check("the same bits again", same(end, scene.end()), "with its memory put back");
  const std::vector<double> later = contact.memory();
  scene.apply();
  const std::vector<double> next = scene.end();
  contact.recall(later);
  scene.apply();
  examiner.check("its memory is all it remembers", same(next, scene.end()), "");
  contact.reset();
  contact.recall(memory);
  scene.apply();
  examiner.check("the same bits after a restart", same(end, scene.end()), "");
  examiner.allocations("a step", [&] { scene.apply(); });
  examiner.hash(end);
}

}  // namespace

void check_contact(Registry& registry, const Plugin<StepCorrection>& plugin, Contract& contract) {
  Examiner examiner(plugin, contract);
  examiner.group("corrects steps", [&] {
    ContactStep scene(registry, plugin, example_values(plugin));
    check_steps(scene, examiner);
  });
  examiner.bounds([&](const Params& params) {
    std::map<std::string, Value> given;
    for (const Param& param : plugin.params)
      if (params.has(param.name)) given[param.name] = params.value(param.name);
    ContactStep scene(registry, plugin, given);
    scene.apply();
    return scene.end();
  });
}

}  // namespace sim::study::contract
