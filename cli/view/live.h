// A live scene behind a page: what comes from it is checked and done, what it shows is made here.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "cli/run/scene.h"
#include "cli/view/account.h"
#include "core/output/page/page.h"
#include "core/output/view.h"
#include "core/scene/player.h"

namespace sim::cli {

// What the page knows of them: name, doc, the scene's own value and the present one.
std::string args_json(const std::vector<SceneArg>& args);

class Live {
 public:
  // They outlive it. Pages with another number are of another scene.
  Live(LoadedScene& scene, const SceneRequest& request, Registry& registry, int number = 0);

  // Real time: catches up with the clock, for at most so many seconds. True if it was too slow.
  void run(double seconds);
  bool playing() const { return playing_; }

  // One line of somebody: a word of the page or an action, as recordings have them. The answer, or
  // nothing. Never throws for what is said.
  std::string take(std::uint64_t from, const std::string& line);

  std::string page(bool pause_hidden) const;  // the whole page
  std::string frame();                        // what it draws next
  bool fresh() const { return fresh_; }       // something changed since the last one
  std::string strip() const;                  // the energies so far, JSON
  Player& player() { return player_; }

  // That a parameter of the scene be another one: for who can load it again.
  struct Wish {
    std::uint64_t from = 0;
    std::string name, value;
  };
  std::optional<Wish> take_wish() { return std::exchange(wish_, std::nullopt); }

  void act_on_all() { all_ = true; }  // every action is done to all systems alike

  // For a front that draws by itself.
  bool world() const { return scene_.spec.world; }
  const std::vector<Model>& models() const { return models_; }
  const std::vector<Moment>& preview() const { return preview_; }
  Moment moment() const;
  void pull(std::size_t system, int particle, const Vec3& to);  // what is held; m
  double real() const { return real_; }                         // of real time
  double share(std::size_t system) const { return shares_[system]; }
  std::string verdict(std::size_t system);

 private:
  using Clock = std::chrono::steady_clock;
  struct Hand {
    std::size_t system = 0;
    int particle = -1;
    std::uint64_t from = 0;
    Vec3 to{0, 0, 0};
    bool pulled = false;  // since the last move
  };

  std::string obey(std::uint64_t from, const std::string& line);
  bool control(const std::string& word, const std::string& argument, std::uint64_t from);
  void pull_to(std::size_t system, std::string arguments);
  static std::string word_of(std::string& line);
  void act(std::uint64_t from, std::size_t system, Action action);
  void move_hands();
  void let_go(std::uint64_t from);
  void go_to(std::int64_t step);
  void settle();  // after anything but steps
  void measure_limits();
  std::string words();
  std::string failure();
  std::string limit_words(std::size_t system);
  void stop_explosion();

  LoadedScene& scene_;
  Registry& registry_;
  int number_;
  std::optional<Wish> wish_;
  Player player_;
  std::vector<Model> models_;
  std::vector<Moment> preview_;  // of the time to come: what the first camera sees
  std::unique_ptr<Page> page_;
  std::vector<EnergyAccount> accounts_;
  std::vector<Hand> hands_;
  std::vector<double> shares_;  // of the largest stable step
  bool playing_ = true, was_slow_ = false;
  double speed_ = 1, debt_ = 0;  // of real time; s of the scene
  Clock::time_point last_, limits_;
  double step_cost_ = 0;  // s
  bool fresh_ = true, all_ = false;
  double spent_ = 0, wall_ = 0, simulated_ = 0;  // s, since the last measurement
  std::int64_t taken_ = 0;
  double us_ = 0, real_ = 0;
  std::string failure_;
};

}  // namespace sim::cli
