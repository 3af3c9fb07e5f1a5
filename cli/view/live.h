// A live scene behind a view: what is said there is checked and done, what it shows is made here.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/run/scene.h"
#include "cli/view/account.h"
#include "cli/view/error_search.h"
#include "cli/view/measured.h"
#include "core/base/stopwatch.h"
#include "core/output/view.h"
#include "core/session/player.h"

namespace sim::cli {

class Live {
 public:
  // They outlive it. `number`: of the scene, among those that are viewed. With timelines it goes on
  // where the scene is, and nothing from before is undone; the player gives them back.
  Live(LoadedScene& scene, const SceneRequest& request, Registry& registry, int number = 0,
       std::vector<Timeline> timelines = {});

  // Real time: catches up with the clock, for at most so many seconds. True if it was too slow.
  void run(double seconds);
  bool playing() const { return playing_; }
  // On the way to another step, which run() goes on with; a command that comes now waits for its
  // end.
  bool travelling() const { return travel_.has_value(); }

  // Words of somebody, see ViewMessage. Why they are refused, or nothing. Never throws for them.
  std::string take(std::uint64_t from, const std::string& line);

  ViewScene scene() const;
  Moment moment();
  ViewState state();                     // with the moment: the next one to be shown
  bool fresh() const { return fresh_; }  // something changed since the last one
  Player& player() { return player_; }

  // A request to change a parameter of the scene, for the owner that can load it again.
  struct Wish {
    std::uint64_t from = 0;
    std::string name, value;
  };
  std::optional<Wish> take_wish() { return std::exchange(wish_, std::nullopt); }

  void act_on_all() { all_ = true; }  // every action is done to all systems alike

  // An error that a user asks for: the owner, who can load the scene again, searches for methods
  // and steps while it is busy.
  struct Goal {
    int number = 0;  // of the request, among those here
    bool busy = false;
    std::string asked = {}, words = {};
  };
  const Goal& goal() const { return goal_; }
  void choose(const FoundChoice& found);  // the end of the search for the present goal

 private:
  struct Hand {
    std::size_t system = 0;
    int particle = -1;
    std::uint64_t from = 0;
    Vec3 to{0, 0, 0};
    bool pulled = false;  // since the last move
  };

  void obey(std::uint64_t from, const std::string& line);
  bool control(const std::string& word, const std::string& argument, std::uint64_t from);
  void ask_for_error(const std::string& argument);
  void pull(std::size_t system, std::string arguments);
  static std::string word_of(std::string& line);
  void act(std::uint64_t from, std::size_t system, Action action);
  void perform(std::size_t system, const Action& action);
  void move_hands();
  void let_go(std::uint64_t from);
  void go_to(std::int64_t step);
  void travel(const std::function<bool()>& go_on);
  void settle();      // after anything but steps
  void begin_anew();  // likewise, where another run begins than the one that failed
  void fail(std::size_t system, std::string words);
  void measure_limits();
  bool few() const;
  void fail_as_player();
  std::string verdict(std::size_t system);
  std::string limit_words(std::size_t system);
  void stop_explosion();

  LoadedScene& scene_;
  Registry& registry_;
  int number_;
  std::optional<Wish> wish_;
  Goal goal_;
  Player player_;
  std::vector<std::size_t> before_;  // actions of each system that are not to be undone here
  std::vector<Model> models_;
  std::vector<Moment> preview_;  // of later times, for the first camera
  std::vector<EnergyAccount> accounts_;
  Measured measured_;
  std::vector<Hand> hands_;
  std::vector<double> shares_;  // of the largest stable step
  bool shares_stale_ = false;   // a command changed what they depend on
  bool playing_ = true, was_slow_ = false;
  double speed_ = 1, debt_ = 0;  // of real time; s of the scene
  struct Travel {
    std::int64_t to = 0;
    bool known = false;  // the step is one that was there before
  };
  std::optional<Travel> travel_;
  Stopwatch since_last_, since_limits_;
  double limits_hold_ = 0;  // s, until they are measured again
  double step_cost_ = 0;    // s
  bool fresh_ = true, all_ = false;
  double spent_ = 0, wall_ = 0, simulated_ = 0;  // s, since the last measurement
  std::int64_t taken_ = 0;
  double us_ = 0, real_ = 0;
  // The reason why the run stopped, until it goes on or another one begins.
  std::string failure_;
  std::size_t failed_ = 0;  // the system that did
};

}  // namespace sim::cli
