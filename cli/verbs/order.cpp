#include "cli/verbs/order.h"

#include <algorithm>

#include "cli/run/study_progress.h"
#include "core/base/error.h"
#include "core/report/order_report.h"

namespace sim::cli {
namespace {

bool is_integrator(const std::string& word, Registry& registry) {
  return registry.find(kind_of<Integrator>, word.substr(0, word.find(':')));
}

}  // namespace

int order(const OrderRequest& request, const Environment& environment, Registry& registry,
          Console& console) {
  SceneRequest scene_request = request.scene;
  std::vector<MethodChoice> integrators = request.integrators;
  std::vector<std::string> words = request.words;
  if (words.size() == 2 && !is_integrator(words[0], registry) && is_integrator(words[1], registry))
    std::swap(words[0], words[1]);
  if (!words.empty() && (words.size() > 1 || is_integrator(words.front(), registry))) {
    if (!integrators.empty())
      throw Error(ErrorKind::kUsage, {"given twice", "'" + words.front() + "' and --integrators",
                                      "as an argument and as an option", "keep one of them"});
    integrators = {parse_integrator(words.front())};
    words.erase(words.begin());
  }
  if (!words.empty()) scene_request.scene = words.front();

  const LoadedScene scene = load(scene_request, environment, registry);
  StudyProgress progress(request.progress, console);
  std::vector<std::string> texts;
  for (const SystemSpec& spec : scene.spec.systems) {
    if (progress.caught()) break;
    study::Problem problem{&spec, &registry, run_options(scene_request, spec, registry)};
    problem.of = quantity(spec, request.of);
    const study::OrderOptions options{request.time.value_or(0),
                                      study_choices(integrators, registry)};
    progress.announce(study::expected(problem, options));
    const auto result = study::order(problem, options, progress.watch());
    texts.push_back(request.json ? report::order_json(*result, request.of)
                                 : report::order_text(*result, request.of));
  }
  progress.clear();
  put_studies(texts, request.json, scene.spec.world, console);
  return progress.exit_code();
}

}  // namespace sim::cli
