// The integrator of a run as the command line says it: -i NAME:PARAM=VALUE,..., --tol,
// --precision, --fixed-step.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/plugin/registry.h"
#include "core/scene/snapshot.h"

namespace sim::cli {

struct IntegratorChoice {
  std::string name = {};                           // empty = the scene's own
  std::map<std::string, std::string> params = {};  // as text
  std::optional<double> tol = {};
  std::optional<std::string> precision = {};
  bool fixed_step = false;
};

// "NAME" or "NAME:PARAM=VALUE,PARAM=VALUE". Throws Error{kUsage}.
IntegratorChoice parse_integrator(const std::string& text);

// Several of them between commas; PARAM=VALUE without a name belongs to the one before.
std::vector<IntegratorChoice> parse_integrators(const std::string& option, const std::string& text);

// The values that the choice gives to the parameters of integrator `name`. Throws Error{kUsage}:
// unknown integrator or parameter, bad value, a tolerance where none is used.
std::map<std::string, Value> integrator_values(const IntegratorChoice& choice,
                                               const std::string& name, Registry& registry);

// True when these settings are the integrator `name` with the same values.
bool same_method(const Settings& settings, const std::string& name,
                 const std::map<std::string, Value>& given);

}  // namespace sim::cli
