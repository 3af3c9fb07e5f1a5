// The options for the output files of a run and the look of its pictures.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "cli/run/recorder.h"

namespace CLI {
class App;
class Option;
}  // namespace CLI

namespace sim::cli {

// The texts of the options, as the command line has them.
struct OutTexts {
  std::vector<std::string> files, springs, trails;
  std::string fps, color, camera, size;
  bool wireframe = false, surface = false, show = false;
};

std::vector<CLI::Option*> add_out_options(CLI::App& app, OutTexts& texts);

// The one file of --out of a verb that writes nothing but that: "" or a name with this ending.
// Throws Error{kUsage}; `rule`: "a chart is .svg".
std::string one_file(const OutTexts& texts, const std::string& ending, const std::string& rule);

// Throws Error{kUsage}. `every`: the value of --every.
OutRequest out_request(const OutTexts& texts, std::optional<std::int64_t> every);

}  // namespace sim::cli
