// The contract of a plugin's interface, checked against its behaviour: forces against differences
// of their potential, methods against their order, all of them against their own bits.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/plugin/registry.h"

namespace sim::study {

enum class Outcome { kOk, kFailed, kSkipped };

struct ContractCheck {
  std::string plugin;  // "force 'wind'"
  std::string name;    // of the check, in a few words
  Outcome outcome;
  std::string words;  // figures, or the reason
};

struct Contract {
  std::vector<ContractCheck> checks;
  std::uint64_t bits = 0;  // hash of the plugins' results: the same on every instruction set
  std::function<long()> allocations = {};  // of this process so far; empty if nobody counts them
};

// Adds the checks of one plugin, with its defaults and with examples of required values. An
// exception of the plugin is a failed check and is not passed on.
void check_contract(Registry& registry, const PluginInfo& plugin, Contract& contract);

// Values that satisfy every declaration: none for a parameter with a default, examples for a
// required one.
std::map<std::string, Value> example_values(const PluginInfo& plugin);

}  // namespace sim::study
