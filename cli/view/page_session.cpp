#include "cli/view/page_session.h"

#include <utility>

#include "core/base/error.h"
#include "core/report/replays.h"

namespace sim::cli {

PageSession::Scene::Scene(const SceneRequest& asked, const Environment& environment,
                          Registry& registry, int number)
    : request(asked),
      loaded(load(asked, environment, registry)),
      live(loaded, asked, registry, number),
      page(live.scene(), false),
      writer([this](std::string_view lines) { recorded += lines; },
             report::recording_header(named_scene(asked)), loaded.spec.world) {
  live.player().record(writer);
}

void PageSession::open(const SceneRequest& request) {
  scene_ = std::make_unique<Scene>(request, *environment_, *registry_, number_ + 1);
  ++number_;
}

std::string PageSession::take(const std::string& words) {
  constexpr std::uint64_t kOnly = 1;  // the page that there is
  std::string refused = scene_->live.take(kOnly, words);
  const auto wish = scene_->live.take_wish();
  if (!wish) return refused;
  SceneRequest next = scene_->request;
  next.settings[wish->name] = wish->value;
  try {
    open(next);
  } catch (const Error& error) {
    refused = error.what();
  }
  return refused;
}

bool PageSession::run(double seconds) {
  scene_->live.run(seconds);
  return scene_->live.fresh();
}

std::string PageSession::frame() {
  const Moment moment = scene_->live.moment();
  return scene_->page.frame(moment, scene_->live.state());
}

std::string PageSession::past() { return LivePage::past(scene_->live.state().past); }

int PageSession::wanted() const {
  const Live::Goal& goal = scene_->live.goal();
  return goal.busy ? goal.number : 0;
}

void PageSession::choose(int number, const FoundChoice& found) {
  if (number == wanted()) scene_->live.choose(found);
}

// A copy of the writer ends it, so that it goes on.
std::string PageSession::recording() const {
  std::string& recorded = scene_->recorded;
  const std::string before = recorded;
  RecordingWriter last = scene_->writer;
  const bool world = scene_->loaded.spec.world;
  for (const Simulation& system : scene_->loaded.systems)
    last.end(world ? system.name() : "", system.step_count(), system.hash());
  return std::exchange(recorded, before);
}

}  // namespace sim::cli
