#include "cli/command_line/plugin_studies.h"

#include <algorithm>
#include <cctype>

#include "cli/command_line/option_values.h"
#include "core/base/error.h"
#include "core/output/format.h"

namespace sim::cli {
namespace {

constexpr std::size_t kColumn = 26, kDocWidth = 80 - kColumn;

// The placeholder of its value in the help.
std::string value_word(const Param& param) {
  if (!param.choices.empty()) return join(param.choices, "|");
  if (param.type == ParamType::kInteger) return "N";
  if (param.type != ParamType::kNumber) return "WORDS";
  std::string unit = param.unit.empty() ? "X" : param.unit;
  std::ranges::transform(unit, unit.begin(), [](unsigned char c) { return std::toupper(c); });
  return unit;
}

std::string doc_of(const Param& param) {
  std::string doc = param.doc;
  if (param.required)
    doc += "; it has to be given";
  else if (const std::string otherwise = to_text(param.default_value);
           !otherwise.empty() && param.type != ParamType::kFlag)
    doc += "; " + otherwise + " if not given";
  return wrapped(doc, 0, 0, kDocWidth);
}

std::string footer_of(const Plugin<Study>& study) {
  std::vector<std::string> taken;
  for (const std::string& option : study.takes)
    if (option != "--integrators") taken.push_back(option);
  for (const char* option :
       {"--progress", "--json", "--set", "--seed", "--without", "--plugin-path"})
    taken.emplace_back(option);
  return wrapped("It takes " + join(taken, ", ") + " and --load, as in sim --help.", 0) + "\n" +
         study.help;
}

[[noreturn]] void refuse(const Plugin<Study>& study, const std::string& why,
                         const std::string& remedy) {
  throw Error(ErrorKind::kPlugin, {"plugin", study.file, why, remedy});
}

}  // namespace

std::string option_name(const Param& param) {
  std::string name = "--" + param.name;
  std::ranges::replace(name, '_', '-');
  return name;
}

std::string nearest_verb(const CLI::App& app, std::span<const std::string> studies,
                         const std::string& word) {
  std::vector<std::string> verbs(studies.begin(), studies.end());
  for (const CLI::App* verb : app.get_subcommands({})) verbs.push_back(verb->get_name());
  const std::string near = nearest(word, verbs);
  return near.empty() ? "" : "did you mean 'sim " + near + "'?";
}

void PluginStudies::add_to(CLI::App& app, std::span<const Plugin<Study>* const> studies) {
  for (const Plugin<Study>* const study : studies) {
    if (std::ranges::any_of(app.get_subcommands({}),
                            [&](const CLI::App* verb) { return verb->check_name(study->name); }))
      refuse(*study, "its study '" + study->name + "' has the name of a verb of sim",
             "give it another name");
    CLI::App* const added =
        app.add_subcommand(study->name, (study->takes_scene ? "SCENE: " : "") + study->summary);
    for (const std::string& alias : study->aliases) added->alias(alias);
    Verb& verb = verbs_[added];
    verb.plugin = study;
    added->fallthrough()->allow_extras();
    added->footer(footer_of(*study));
    added->get_formatter()->column_width(kColumn);
    if (study->takes_scene)
      added->add_option("SCENE", verb.scene, "Lua file; scenes/cloth.lua if not given")
          ->type_name("");
    if (std::ranges::count(study->takes, "--integrators"))
      added
          ->add_option("--integrators", verb.integrators,
                       "only these, with parameters as for -i; all that fit\nif not given")
          ->type_name("A,B,..");
    for (const Param& param : study->params) {
      const std::string name = option_name(param);
      if (app.get_option_no_throw(name))
        refuse(*study, "its option " + name + " is one of sim", "give it another name");
      if (param.type == ParamType::kFlag)
        added->add_flag(name, verb.flags[param.name], doc_of(param))->disable_flag_override();
      else
        added->add_option(name, verb.texts[param.name], doc_of(param))
            ->type_name(value_word(param));
    }
  }
}

bool PluginStudies::takes(const CLI::App* verb, const std::string& option) const {
  const auto found = verbs_.find(verb);
  return found != verbs_.end() &&
         (option == "--progress" || std::ranges::count(found->second.plugin->takes, option));
}

StudyRequest PluginStudies::request(const CLI::App* chosen, const StudyBase& base) const {
  const Verb& verb = verbs_.at(chosen);
  StudyRequest request;
  request.study = verb.plugin->name;
  request.scene = base.scene;
  if (!verb.scene.empty()) request.scene.scene = verb.scene;
  request.scene.integrator = parse_integrator(only("--integrator", base.integrators));
  if (const std::string dt = only("--dt", base.dts); !dt.empty())
    request.scene.dt = positive_time("--dt", dt);
  if (!base.time.empty()) request.time = positive_time("--time", base.time);
  request.of = only("--of", base.of);
  request.integrators = parse_integrators("--integrators", verb.integrators);
  for (const auto& [name, text] : verb.texts)
    if (!text.empty()) request.given[name] = text;
  for (const auto& [name, on] : verb.flags)
    if (on) request.given[name] = true;
  request.json = base.json;
  request.progress = base.progress;
  return request;
}

}  // namespace sim::cli
