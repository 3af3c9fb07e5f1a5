#include "cli/command_line/verb_words.h"

#include <algorithm>
#include <filesystem>
#include <iterator>

#include "cli/command_line/option_values.h"
#include "cli/run/environment.h"
#include "core/base/text.h"
#include "core/lua/scene/scene_file.h"

namespace sim::cli {

std::vector<std::string> asked_for_help(std::vector<std::string> words,
                                        std::vector<std::string> verbs) {
  if (words.empty() || words.front() != "help") return words;
  words.erase(words.begin());
  if (!words.empty() && !words.front().starts_with('-') &&
      std::ranges::find(verbs, words.front()) == verbs.end()) {
    std::erase_if(verbs, [&](const std::string& verb) { return !verb.starts_with(words.front()); });
    if (verbs.size() != 1) {
      words.insert(words.begin(), "describe");
      return words;
    }
    words.front() = verbs.front();
  }
  words.emplace_back("--help");
  return words;
}

void check_for_verb(const std::string& word, const std::string& near) {
  if (near.empty() || word.find_first_of("./") != std::string::npos) return;
  std::error_code unknown;
  if (std::filesystem::exists(word, unknown)) return;
  for (const std::string& scene : list_scenes(find_environment({}).scene_folders))
    if (std::filesystem::path(scene).stem() == word) return;
  usage_error("unknown verb", "'" + word + "'", "no verb or study has that name", near);
}

void check_words(const std::vector<std::string>& words, const CommandSpec& program,
                 const std::string& near_verb) {
  for (const std::string& word : words) {
    if (word == "--") continue;
    if (!word.starts_with("-") || word == "-")
      usage_error("unexpected argument", "'" + word + "'", "no further argument is expected",
                  "see sim --help");
    std::vector<std::string> known;
    const auto add = [&](const CommandSpec& command) {
      for (const OptionSpec& option : command.options)
        std::ranges::copy_if(option.names, std::back_inserter(known),
                             [](const std::string& name) { return name.starts_with("--"); });
    };
    add(program);
    for (const CommandSpec& verb : program.verbs) add(verb);
    const std::string name = word.substr(0, word.find('=')), near = nearest(name, known);
    usage_error("unknown option", name, "sim has no such option",
                !near.empty()        ? "did you mean '" + near + "'?"
                : !near_verb.empty() ? near_verb
                                     : "see sim --help");
  }
}

NewPluginRequest new_plugin_request(const std::vector<std::string>& words) {
  if (words[0] == "flags" && words[1].empty()) return {.flags = true};
  if (words[0] != "new" || words[2].empty())
    usage_error("bad arguments", "sim plugin " + join(words, " "), "it is sim plugin new KIND NAME",
                "as in: sim plugin new force my_wind");
  return {.kind = words[1], .name = words[2]};
}

NewSceneRequest new_scene_request(const std::vector<std::string>& words) {
  if (words[0] != "new" || words[1].empty())
    usage_error("bad arguments", "sim scene " + join(words, " "), "it is sim scene new NAME",
                "as in: sim scene new my_net");
  return {.name = words[1]};
}

}  // namespace sim::cli
