#include "cli/verbs/study.h"

#include <algorithm>

#include "cli/run/study_progress.h"
#include "core/base/error.h"
#include "core/study/study.h"

namespace sim::cli {
namespace {

// The scene of the command line.
class RequestedScene final : public SceneSource {
 public:
  RequestedScene(const SceneRequest& request, const Environment& environment, Registry& registry)
      : request_(request), environment_(environment), registry_(registry) {}

  std::string name() const override { return request_.scene; }
  StudiedScene load(const SceneVariant& variant) override {
    return cli::load(with_variant(request_, variant), environment_, registry_);
  }
  RunOptions options(const SceneVariant& variant, const SystemSpec& system) override {
    return run_options(with_variant(request_, variant), system, registry_);
  }
  std::string command(const SceneVariant& variant) const override {
    return command_for(with_variant(request_, variant));
  }

 private:
  const SceneRequest& request_;
  const Environment& environment_;
  Registry& registry_;
};

// The parameters of the study from the command line, as they are declared.
Params params_of(const StudyRequest& request, const Plugin<Study>& plugin) {
  ValueMap given;
  for (const auto& [name, value] : request.given) {
    const auto* const text = std::get_if<std::string>(&value);
    const auto declared = std::ranges::find(plugin.params, name, &Param::name);
    given[name] = text && declared != plugin.params.end() ? value_of(*text, *declared) : value;
  }
  try {
    return Params(plugin.title(), plugin.params, given, "on the command line");
  } catch (const Error& error) {
    if (error.kind() != ErrorKind::kScene) throw;
    throw Error(ErrorKind::kUsage, error.text());
  }
}

}  // namespace

int study(const StudyRequest& request, const Environment& environment, Registry& registry,
          Console& console) {
  const Plugin<Study>& plugin = registry.get<Study>(request.study, "on the command line");
  const auto study = made(plugin.make(params_of(request, plugin)), plugin);
  RequestedScene scene(request.scene, environment, registry);
  StudyProgress progress(request.progress, console);
  const StudyTask task{.scene = plugin.takes_scene ? &scene : nullptr,
                       .registry = &registry,
                       .variant = variant_of(request.scene),
                       .time = request.time,
                       .of = request.of,
                       .integrators = study_choices(request.integrators, registry),
                       .json = request.json,
                       .watch = progress.watch(),
                       .announce = [&](double seconds) { progress.announce(seconds); }};
  std::string found = study->run(task);
  progress.clear();
  if (!found.empty() && !found.ends_with('\n')) found += '\n';
  put(console.out, found);
  flush_or_throw(console.out, "standard output");
  return progress.exit_code();
}

}  // namespace sim::cli
