// The parameters of all plugins: units, defaults and bounds are those that scenes rely on.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <set>
#include <string>
#include <vector>

#include "core/base/text.h"
#include "core/plugin/value.h"
#include "tests/cli/program.h"
#include "tests/support/scenes.h"

using namespace sim_test;

namespace {

// "force gust: velocity [m/s] = {1, 0, 0}, from 0, to 1, of a | b"
std::vector<std::string> lines_of_plugin(const sim::PluginKind& kind, const sim::PluginInfo& info) {
  std::vector<std::string> lines;
  for (const sim::Param& param : info.params) {
    std::string line = std::string(kind.name) + " " + info.name + ": " + param.name;
    if (!param.unit.empty()) line += " [" + param.unit + "]";
    if (const std::string value = sim::to_text(param.default_value); !value.empty())
      line += " = " + value;
    if (std::isfinite(param.min)) line += ", from " + sim::shortest(param.min);
    if (std::isfinite(param.max)) line += ", to " + sim::shortest(param.max);
    for (std::size_t k = 0; k < param.choices.size(); ++k)
      line += (k == 0 ? ", of " : " | ") + param.choices[k];
    if (param.required) line += ", required";
    lines.push_back(line);
  }
  return lines;
}

}  // namespace

// A value that is changed on purpose is changed here, too, and said in CHANGELOG.md. Plugins that
// this build does not have are left out.
TEST_CASE("units, defaults and bounds of parameters are what they were") {
  sim::Registry registry = make_registry();
  std::vector<std::string> found;
  std::set<std::string> plugins;
  for (const sim::PluginKind& kind : sim::kPluginKinds)
    for (const std::string& name : registry.names(kind)) {
      plugins.insert(std::string(kind.name) + " " + name);
      for (const std::string& line : lines_of_plugin(kind, registry.get(kind, name)))
        found.push_back(line);
    }
  std::vector<std::string> expected;
  for (const std::string& line :
       lines_of(read_text(std::string(SIM_SOURCE_DIR) + "/tests/plugin/defaults.txt")))
    if (plugins.contains(line.substr(0, line.find(':')))) expected.push_back(line);
  for (std::size_t k = 0; k < std::min(found.size(), expected.size()); ++k)
    REQUIRE(found[k] == expected[k]);
  CHECK(found.size() == expected.size());
}
