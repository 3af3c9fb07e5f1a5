// Tools shared by the checks of all kinds of plugins.
#pragma once

#include <functional>
#include <span>
#include <string>

#include "core/base/error.h"
#include "core/base/hash.h"
#include "core/study/contract/contract.h"
#include "core/study/study.h"

namespace sim::study::contract {

class Examiner {
 public:
  Examiner(const PluginInfo& plugin, Contract& contract) : plugin_(plugin), contract_(contract) {}

  void ok(const std::string& name, const std::string& words) { add(name, Outcome::kOk, words); }
  void failed(const std::string& name, const std::string& words) {
    add(name, Outcome::kFailed, words);
  }
  void skipped(const std::string& name, const std::string& why) {
    add(name, Outcome::kSkipped, why);
  }
  void check(const std::string& name, bool good, const std::string& words) {
    add(name, good ? Outcome::kOk : Outcome::kFailed, words);
  }

  // Runs a group of checks; an exception of the plugin is a failed check.
  void group(const std::string& name, const std::function<void()>& checks);

  // Makes objects with every bound of every parameter, one at a time. `make` returns numbers that
  // must be finite; it may refuse with an Error.
  void bounds(const std::function<std::vector<double>(const Params&)>& make);

  // `again` repeats an earlier operation, and therefore must not allocate.
  void allocations(const std::string& again_of, const std::function<void()>& again);

  void hash(std::span<const double> numbers) { hash_.add(numbers); }
  ~Examiner() { contract_.bits ^= hash_.value() + (contract_.bits << 6); }

 private:
  void add(const std::string& name, Outcome outcome, const std::string& words) {
    contract_.checks.push_back({plugin_.title(), name, outcome, words});
  }

  const PluginInfo& plugin_;
  Contract& contract_;
  StateHash hash_;
};

void check_force(const ForcePlugin& plugin, Contract& contract);
void check_field(const FieldPlugin& plugin, Contract& contract);
void check_constraint(const Plugin<Constraint>& plugin, Contract& contract);
void check_collider(const Plugin<Collider>& plugin, Contract& contract);
void check_motion(const Plugin<RigidMotion>& plugin, Contract& contract);
void check_contact(Registry& registry, const Plugin<StepCorrection>& plugin, Contract& contract);
void check_law(const Plugin<ContactLaw>& plugin, Contract& contract);
void check_study(Registry& registry, const Plugin<Study>& plugin, Contract& contract);
void check_integrator(Registry& registry, const IntegratorPlugin& plugin, Contract& contract);

Params example_params(const PluginInfo& plugin);

// True for the same bits.
bool same(std::span<const double> a, std::span<const double> b);
bool finite(std::span<const double> numbers);

}  // namespace sim::study::contract
