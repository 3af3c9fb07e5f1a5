// The first words of a command line: help, and verbs that are misspelt.
#pragma once

#include <string>
#include <vector>

#include "cli/command_line/command_spec.h"
#include "cli/verbs/new_plugin.h"
#include "cli/verbs/new_scene.h"

namespace sim::cli {

// `sim help NAME` is `sim NAME --help` for a verb, or the only one that begins so; for any other
// name it is `sim describe NAME`. All other words stay as they are.
std::vector<std::string> asked_for_help(std::vector<std::string> words,
                                        std::vector<std::string> verbs);

// Throws Error{kUsage} for a word in the place of a scene that names neither a file nor a scene, if
// `near` (nearest_verb) tells what was meant.
void check_for_verb(const std::string& word, const std::string& near);

// Throws Error{kUsage} for an unused word, with the nearest option, or else the nearest verb.
void check_words(const std::vector<std::string>& words, const CommandSpec& program,
                 const std::string& near_verb);

// The request of `sim plugin`, from its three words.
NewPluginRequest new_plugin_request(const std::vector<std::string>& words);
NewSceneRequest new_scene_request(const std::vector<std::string>& words);

}  // namespace sim::cli
