// A live scene behind a page that has the kernel in it: what its worker calls.
#pragma once

#include <memory>
#include <string>

#include "cli/view/live.h"
#include "core/output/page/live_page.h"
#include "core/session/recording.h"

namespace sim::cli {

class PageSession {
 public:
  // They outlive it.
  PageSession(const Environment& environment, Registry& registry)
      : environment_(&environment), registry_(&registry) {}

  // Another scene from its start. Throws as load() does; then it goes on with what it had.
  void open(const SceneRequest& request);
  bool is_open() const { return scene_ != nullptr; }

  // The page of the scene, see LivePage::html(); a number that is another one after a change of
  // scene, which a message can make, too.
  std::string html(const std::string& nonce) const { return scene_->page.html("", nonce); }
  int number() const { return number_; }

  // Words of the page, see ViewMessage. Why they are refused, or nothing.
  std::string take(const std::string& words);

  // Real time, for at most so many seconds; true where a frame shows something new.
  bool run(double seconds);
  std::string frame();  // see LivePage::frame()
  std::string past();   // see LivePage::past()

  // The number of the error that is asked for, see Live::Goal, while a search for it is missing;
  // else 0. It is searched for elsewhere, and choose() takes what was found.
  int wanted() const;
  const std::string& asked() const { return scene_->live.goal().asked; }
  const SceneRequest& request() const { return scene_->request; }
  void choose(int number, const FoundChoice& found);

  // A recording of all that hands did, with the hash of now: sim --replay gives the same bits.
  std::string recording() const;

 private:
  struct Scene {
    Scene(const SceneRequest& asked, const Environment& environment, Registry& registry,
          int number);

    SceneRequest request;
    LoadedScene loaded;
    Live live;
    LivePage page;
    std::string recorded;
    RecordingWriter writer;
  };

  const Environment* environment_;
  Registry* registry_;
  int number_ = 0;
  std::unique_ptr<Scene> scene_;
};

}  // namespace sim::cli
