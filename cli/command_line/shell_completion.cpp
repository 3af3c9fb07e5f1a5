#include "cli/command_line/shell_completion.h"

#include <algorithm>

#include "cli/command_line/option_values.h"
#include "core/base/text.h"

namespace sim::cli {
namespace {

// The kind of value that an option takes.
enum class Values { kNone, kAny, kFiles, kFolders, kIntegrators };

Values values_of(const OptionSpec& option) {
  if (option.type.empty()) return Values::kNone;
  const auto named = [&](const char* name) {
    return std::ranges::find(option.names, name) != option.names.end();
  };
  if (named("--integrator") || named("--integrators")) return Values::kIntegrators;
  if (option.type.find("FILE") != std::string::npos) return Values::kFiles;
  return option.type == "DIR" ? Values::kFolders : Values::kAny;
}

// In single quotes, for every shell.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return result + "'";
}

std::vector<std::string> names_of(const CommandSpec& command) {
  std::vector<std::string> names;
  for (const OptionSpec& option : command.options)
    names.insert(names.end(), option.names.begin(), option.names.end());
  return names;
}

std::vector<std::string> verbs_of(const CommandSpec& program) {
  std::vector<std::string> verbs;
  for (const CommandSpec& verb : program.verbs) verbs.push_back(verb.name);
  return verbs;
}

// Every option of the program and its verbs whose values are of this kind, once.
std::vector<std::string> names_with(const CommandSpec& program, Values values) {
  std::vector<std::string> names;
  const auto add = [&](const CommandSpec& command) {
    for (const OptionSpec& option : command.options)
      if (values_of(option) == values)
        names.insert(names.end(), option.names.begin(), option.names.end());
  };
  add(program);
  for (const CommandSpec& verb : program.verbs) add(verb);
  std::ranges::sort(names);
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

// Completion must work for simrepl if sim is beside it in the path.
constexpr const char* kScenes = "$(sim list scenes --names 2>/dev/null)";
constexpr const char* kIntegrators = "$(sim list integrators --names 2>/dev/null)";

std::string bash(const CommandSpec& program) {
  const std::vector<std::string> verbs = verbs_of(program);
  std::string text = "# bash completion for " + program.name + "\n_" + program.name +
                     "() {\n"
                     "  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD-1]}\n"
                     "  local verb= word options\n"
                     "  COMPREPLY=()\n";
  if (!verbs.empty())
    text += "  for word in \"${COMP_WORDS[@]:1:COMP_CWORD-1}\"; do\n    case $word in\n      " +
            join(verbs, " | ") + ") verb=$word ;;\n    esac\n  done\n";
  const auto rule = [&](Values values, const std::string& answer) {
    const std::vector<std::string> names = names_with(program, values);
    if (!names.empty()) text += "    " + join(names, " | ") + ") " + answer + "return ;;\n";
  };
  text += "  case $prev in\n";
  rule(Values::kIntegrators,
       std::string("COMPREPLY=($(compgen -W \"") + kIntegrators + "\" -- \"$cur\")); ");
  rule(Values::kFiles, "COMPREPLY=($(compgen -f -- \"$cur\")); ");
  rule(Values::kFolders, "COMPREPLY=($(compgen -d -- \"$cur\")); ");
  rule(Values::kAny, "");
  text += "  esac\n  options='" + join(names_of(program), " ") + "'\n  case $verb in\n";
  for (const CommandSpec& verb : program.verbs)
    text += "    " + verb.name + ") options+=' " + join(names_of(verb), " ") + "' ;;\n";
  text +=
      "  esac\n  if [[ $cur == -* ]]; then\n"
      "    COMPREPLY=($(compgen -W \"$options\" -- \"$cur\"))\n    return\n  fi\n"
      "  local words=\"" +
      std::string(kScenes) + "\"\n";
  if (!verbs.empty()) text += "  [[ -n $verb ]] || words+=' " + join(verbs, " ") + "'\n";
  return text +
         "  COMPREPLY=($(compgen -W \"$words\" -- \"$cur\") $(compgen -f -- \"$cur\"))\n}\n" +
         "complete -o filenames -F _" + program.name + " " + program.name + "\n";
}

// One line of _arguments.
std::string zsh_option(const OptionSpec& option) {
  std::string doc = option.doc;
  for (const char* special : {"[", "]", ":"})
    for (std::size_t at = doc.find(special); at != std::string::npos;
         at = doc.find(special, at + 2))
      doc.insert(at, "\\");
  std::string value;
  switch (values_of(option)) {
    case Values::kNone:
      break;
    case Values::kAny:
      value = ":value:";
      break;
    case Values::kFiles:
      value = ":file:_files";
      break;
    case Values::kFolders:
      value = ":folder:_directories";
      break;
    case Values::kIntegrators:
      value = ":integrator:(" + std::string(kIntegrators) + ")";
      break;
  }
  std::string text;
  for (const std::string& name : option.names)
    text += " \\\n      " + quoted("*" + name + "[" + doc + "]") +
            (value.empty() ? "" : "\"" + value + "\"");
  return text;
}

std::string zsh(const CommandSpec& program) {
  std::string text = "#compdef " + program.name + "\n_" + program.name +
                     "() {\n"
                     "  local -a verbs scenes\n  scenes=(" +
                     std::string(kScenes) + ")\n  verbs=(";
  for (const CommandSpec& verb : program.verbs)
    text += "\n    " + quoted(verb.name + ":" + verb.doc);
  text += ")\n  _" + program.name + "_words() { ";
  if (!program.verbs.empty()) text += "_describe verb verbs; ";
  text += "compadd -a scenes; _files }\n  case ${words[2]} in\n";
  const auto arguments = [&](const CommandSpec* verb) {
    std::string lines = "_arguments -s";
    for (const OptionSpec& option : program.options) lines += zsh_option(option);
    if (verb)
      for (const OptionSpec& option : verb->options)
        if (option.names.front() != "-h") lines += zsh_option(option);
    return lines + " \\\n      '*:word:_" + program.name + "_words' ;;\n";
  };
  for (const CommandSpec& verb : program.verbs)
    text += "    " + verb.name + ") " + arguments(&verb);
  return text + "    *) " + arguments(nullptr) + "  esac\n}\n_" + program.name + " \"$@\"\n";
}

std::string fish_option(const std::string& program, const std::string& verb,
                        const OptionSpec& option) {
  std::string text = "complete -c " + program;
  if (!verb.empty()) text += " -n '__fish_seen_subcommand_from " + verb + "'";
  for (const std::string& name : option.names)
    text += name.starts_with("--") ? " -l " + name.substr(2) : " -s " + name.substr(1);
  switch (values_of(option)) {
    case Values::kNone:
      break;
    case Values::kAny:
      text += " -x";
      break;
    case Values::kFiles:
      text += " -r -F";
      break;
    case Values::kFolders:
      text += " -x -a '(__fish_complete_directories)'";
      break;
    case Values::kIntegrators:
      text += " -x -a '(sim list integrators --names 2>/dev/null)'";
      break;
  }
  return text + " -d " + quoted(option.doc) + "\n";
}

std::string fish(const CommandSpec& program) {
  std::string text = "# fish completion for " + program.name + "\n";
  for (const CommandSpec& verb : program.verbs)
    text += "complete -c " + program.name + " -n __fish_use_subcommand -a " + verb.name + " -d " +
            quoted(verb.doc) + "\n";
  text += "complete -c " + program.name + " -a '(sim list scenes --names 2>/dev/null)'\n";
  for (const OptionSpec& option : program.options) text += fish_option(program.name, "", option);
  for (const CommandSpec& verb : program.verbs)
    for (const OptionSpec& option : verb.options)
      if (option.names.front() != "-h") text += fish_option(program.name, verb.name, option);
  return text;
}

}  // namespace

std::string shell_completion(const CommandSpec& program, const std::string& shell) {
  if (shell == "bash") return bash(program);
  if (shell == "zsh") return zsh(program);
  if (shell == "fish") return fish(program);
  usage_error("bad value", "--completion '" + shell + "'", "it is bash, zsh or fish",
              "as in: source <(" + program.name + " --completion bash)");
}

}  // namespace sim::cli
