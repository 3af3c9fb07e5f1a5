#include "cli/view/error_search.h"

#include <sstream>
#include <utility>

#include "cli/run/error_choice.h"
#include "cli/terminal/console.h"
#include "core/base/text.h"
#include "core/base/thread_start.h"
#include "core/plugin/method.h"
#include "core/study/budget.h"

namespace sim::cli {
namespace {

// The words of the exception being handled.
FoundChoice not_found() {
  std::ostringstream words;
  try {
    throw;
  } catch (const Error& error) {
    words << error.what();
  } catch (...) {
    report_exception(words);
  }
  return {.commands = "", .words = words.str()};
}

}  // namespace

FoundChoice choose_for_view(const SceneRequest& scene, const std::string& error,
                            const Environment& environment, Registry& registry,
                            const study::Watch& watch) {
  FoundChoice found;
  try {
    RunRequest request;
    request.scene = scene;
    request.error = study::parse_budget("error", error);
    request.scene.integrator = {};
    request.scene.dt = 0;
    LoadedScene loaded = load(request.scene, environment, registry);
    std::ostringstream notes;
    for (const auto& made : choose_for_error(request, loaded, registry, watch, notes)) {
      if (!made) continue;
      const study::GoalChoice& choice = *made;
      const std::string name = loaded.spec.world ? choice.system + ": " : "";
      found.commands += name + "integrator " + Method(registry, choice.integrator()).label() +
                        '\n' + name + "dt " + shortest(choice.dt) + '\n';
      if (loaded.spec.world) found.words += choice.system + '\n';
      found.words += error_choice_text(choice, request);
    }
  } catch (...) {
    return not_found();
  }
  return found;
}

ErrorSearch::ErrorSearch(SceneRequest scene, std::string error, const Environment& environment) {
  const auto search = [this, &environment, scene = std::move(scene), error = std::move(error)] {
    try {
      Registry registry = open_registry(environment, scene.libraries);
      choice_ = choose_for_view(scene, error, environment, registry,
                                [this](std::string_view, double) { return !stop_; });
    } catch (...) {
      choice_ = not_found();
    }
    over_ = true;
  };
  if (start_thread(thread_, search)) return;
  choice_.words = "there is no thread for a search";
  over_ = true;
}

ErrorSearch::~ErrorSearch() {
  stop_ = true;
  if (thread_.joinable()) thread_.join();
}

std::optional<FoundChoice> ErrorSearch::found() {
  if (!over_) return {};
  return choice_;
}

}  // namespace sim::cli
