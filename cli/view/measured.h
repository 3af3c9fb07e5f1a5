// Quantities that a view shows in colours beyond the positions: energies, errors against the same
// scene with half the step under the same hands, and how far the fastest mode moves what.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "cli/run/scene.h"
#include "core/picture/model.h"
#include "core/session/action.h"
#include "core/study/accuracy/error_estimator.h"
#include "core/study/verdict/step_doubling.h"

namespace sim::cli {

// It is the same for all who look: what the last one asked for. Errors are known also where nobody
// asks, as long as they cost little.
class Measured {
 public:
  // They outlive it.
  Measured(LoadedScene& scene, Registry& registry) : scene_(scene), registry_(registry) {}

  void ask(std::uint64_t who, const std::string& colour);  // throws Error{kUsage}
  void leave(std::uint64_t who);
  std::string name() const { return asked_.empty() ? "" : asked_.back().second; }

  // Hands: before they do something or a move ends, at the last step that was taken; and after.
  void before_touch(std::size_t system);
  void touched(std::size_t system, const Action& action);
  // The error of positions since the last begin_anew(); empty if it is not known.
  study::RunDeviation parted(std::size_t system) const;
  void afford(bool errors);  // without being asked
  void begin_anew();         // another step or method, a jump in time: errors count from now on

  void fill(Moment& moment, const std::vector<Model>& models);

 private:
  struct One {
    std::int64_t begin = 0;                                 // the step that errors count from
    std::unique_ptr<study::ErrorEstimator> companion = {};  // of errors
    bool behind = false;  // hands did something that it has not done
    std::vector<double> mode = {};
    study::RunDeviation parted = {};
  };
  void judge(One& one, const Frame& frame, const std::vector<double>& errors);
  void follow(std::size_t system);

  LoadedScene& scene_;
  Registry& registry_;
  std::vector<std::pair<std::uint64_t, std::string>> asked_;  // in their order
  std::vector<One> ones_;                                     // a system, or none
  bool affords_ = false;
};

}  // namespace sim::cli
