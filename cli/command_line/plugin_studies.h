// Studies of plugins on the command line: each is a verb, with options as its plugin declares them.
#pragma once

#include <CLI/CLI.hpp>
#include <deque>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "cli/command_line/study_options.h"
#include "cli/verbs/study.h"
#include "core/study/study.h"

namespace sim::cli {

class PluginStudies {
 public:
  // Adds their subcommands. Throws Error{kPlugin} if one has the name of a verb or option of sim.
  void add_to(CLI::App& app, std::span<const Plugin<Study>* const> studies);

  bool has(const CLI::App* verb) const { return verbs_.contains(verb); }
  // True for an option of a run that the verb takes, as "--time".
  bool takes(const CLI::App* verb, const std::string& option) const;

  // The request of one of these verbs. Throws Error{kUsage}.
  StudyRequest request(const CLI::App* verb, const StudyBase& base) const;

 private:
  // Its options, as CLI11 found them.
  struct Verb {
    const Plugin<Study>* plugin;
    std::string scene, integrators;
    std::map<std::string, std::string> texts;
    std::map<std::string, bool> flags;
  };

  std::map<const CLI::App*, Verb> verbs_;
};

// --max-step of a parameter max_step.
std::string option_name(const Param& param);

// The verb of the app, or else the study, that a word may have meant, as a remedy: "did you mean
// 'sim list'?"; "" if none is near.
std::string nearest_verb(const CLI::App& app, std::span<const std::string> studies,
                         const std::string& word);

}  // namespace sim::cli
