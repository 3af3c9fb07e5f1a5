// The contract of plugins: the kernel's own keep it, and each broken promise is found.
#include "core/study/contract/contract.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <set>

#include "core/study/study.h"
#include "tests/support/allocations.h"
#include "tests/support/scenes.h"

using namespace sim_test;
using sim::study::Contract;
using sim::study::Outcome;

namespace {

Contract contract_of(const sim::PluginInfo& plugin, sim::Registry& registry) {
  Contract contract;
  contract.allocations = [] { return static_cast<long>(allocation_count()); };
  sim::study::check_contract(registry, plugin, contract);
  return contract;
}

std::set<std::string> failures(const Contract& contract) {
  std::set<std::string> names;
  for (const auto& check : contract.checks)
    if (check.outcome == Outcome::kFailed) names.insert(check.name);
  return names;
}

std::string fixture(const std::string& name) {
  return std::string(SIM_FIXTURE_DIR) + "/" + name + "/" + name + ".so";
}

using Names = std::set<std::string>;

}  // namespace

TEST_CASE("the kernel's own plugins keep the contract") {
  sim::Registry registry = make_registry();
  for (const sim::PluginKind& kind : sim::kPluginKinds)
    for (const std::string& name : registry.names(kind)) {
      INFO(name);
      const Contract contract = contract_of(registry.get(kind, name), registry);
      CHECK_FALSE(contract.checks.empty());
      for (const auto& check : contract.checks) {
        INFO(check.name << ": " << check.words);
        CHECK(check.outcome != Outcome::kFailed);
      }
    }
}

TEST_CASE("each broken promise of a force is found, and no other") {
  sim::Registry registry({SIM_PLUGIN_DIR}, {fixture("broken_forces")});
  const auto broken = [&](const char* name) {
    return failures(contract_of(registry.get<sim::Force>(name), registry));
  };
  CHECK(broken("good").empty());
  CHECK(broken("wrong_potential") == Names{"F = -dU/dx"});
  CHECK(broken("wrong_jacobian") == Names{"Jacobian against differences"});
  CHECK(broken("silent") == Names{"couplings() names every pair"});
  CHECK(broken("liar").contains("depends_on_velocity is honest"));
  CHECK(broken("impure").contains("the same bits again"));
  CHECK(broken("of_tiles").contains("the same bits in other tiles"));
  CHECK(broken("of_tiles").contains("the same bits on 1 to 4 threads"));
  CHECK(broken("allocates") == Names{"no memory is taken in a step"});
  CHECK(broken("wrong_damping") == Names{"Jacobian against differences, with damping"});
  CHECK(broken("at_bound") == Names{"parameters at their bounds"});
}

TEST_CASE("each broken promise of a study is found, and no other") {
  sim::Registry registry({SIM_PLUGIN_DIR}, {fixture("broken_studies")});
  const auto broken = [&](const char* name) {
    return failures(contract_of(registry.get<sim::Study>(name), registry));
  };
  CHECK(broken("keeps").empty());
  CHECK(broken("silent") == Names{"says what it found"});
  CHECK(broken("no_json") == Names{"JSON is one object"});
  CHECK(broken("deaf") == Names{"ends when it is told to"});
}

TEST_CASE("each broken promise of an integrator is found") {
  sim::Registry registry({SIM_PLUGIN_DIR}, {fixture("broken_integrators")});
  const auto broken = [&](const char* name) {
    return failures(contract_of(registry.get<sim::Integrator>(name), registry));
  };
  CHECK(broken("wrong_order") == Names{"order"});
  CHECK(broken("forgetful") ==
        Names{"the same bits from memory()", "the same bits after a restart"});
}

TEST_CASE("each broken promise of a collider is found, and no other") {
  sim::Registry registry({SIM_PLUGIN_DIR}, {fixture("broken_colliders")});
  const auto broken = [&](const char* name) {
    return failures(contract_of(registry.get<sim::Collider>(name), registry));
  };
  CHECK(broken("floor").empty());
  CHECK(broken("length").contains("normals have the length 1"));
  CHECK(broken("normal").contains("its normal is the gradient of its gap, by differences"));
  CHECK(broken("gap").contains("its gap changes by at most the way"));
  CHECK(broken("clearance") == Names{"its clearance is no more than the gap in the box"});
  CHECK(broken("velocity").contains("its velocity is how its gap falls, by differences"));
  CHECK(broken("fastest") == Names{"is nowhere faster than it says"});
  CHECK(broken("bounce") == Names{"restitution is 0 .. 1, friction at least 0"});
}

TEST_CASE("each broken promise of a motion is found, and no other") {
  sim::Registry registry({SIM_PLUGIN_DIR}, {fixture("broken_motions")});
  const auto broken = [&](const char* name) {
    return failures(contract_of(registry.get<sim::RigidMotion>(name), registry));
  };
  CHECK(broken("round").empty());
  CHECK(broken("velocity") == Names{"its velocity is that of its center, by differences"});
  CHECK(broken("rate") == Names{"its rate is that of its angle, by differences"});
  CHECK(broken("axis") == Names{"its axis and its angle are proper"});
  CHECK(broken("fastest") == Names{"is never faster than it says"});
}

TEST_CASE("each broken promise of a constraint is found, and no other") {
  sim::Registry registry({SIM_PLUGIN_DIR}, {fixture("broken_constraints")});
  const auto contract = [&](const char* name) {
    return contract_of(registry.get<sim::Constraint>(name), registry);
  };
  const Contract good = contract("balloon");
  CHECK(failures(good).empty());
  CHECK(failures(contract("gradient")).contains("its gradient is that of phi, by differences"));
  CHECK(failures(contract("drive")) == Names{"J v + drive is d phi / dt, by differences"});
  CHECK(failures(contract("bias")) ==
        Names{"its bias is d2 phi / dt2 without accelerations, by differences"});
  CHECK(failures(contract("curvature")) ==
        Names{"its curvature is that of phi where it gives one, by differences"});
  // The bits are those of phi and of the bias.
  CHECK(good.bits == contract("balloon").bits);
  CHECK(good.bits != contract("bias").bits);
}

TEST_CASE("the bits of a contract are those of what was computed") {
  sim::Registry registry({SIM_PLUGIN_DIR}, {fixture("broken_forces")});
  const auto bits = [&](const char* name) {
    return contract_of(registry.get<sim::Force>(name), registry).bits;
  };
  CHECK(bits("good") == bits("good"));
  CHECK(bits("good") == bits("wrong_potential"));
  CHECK(bits("good") != bits("liar"));
}
