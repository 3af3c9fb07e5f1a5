// The same run once more with half the step, or a tenth of the tolerance: how far the two part is
// how wrong the run is, for a method of order p up to a factor near 1.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/study/verdict/parting.h"

namespace sim::study {

// Keeps states of a run while it goes on, to compare them with a shadow afterwards.
class Shadow {
 public:
  // At the first state of a run of `steps` steps more; everything given outlives it.
  Shadow(const SystemSpec& spec, Simulation& run, std::int64_t steps, Registry& registry);

  // These figures are wanted of the whole shadow, from all its steps.
  void judge(std::span<const Quantity> figures) { asked_.assign(figures.begin(), figures.end()); }

  // At the present state, now and then; `energy` in a second-order system only, `observed` what the
  // scene's observers say.
  void look(const Energy* energy, std::span<const double> observed = {});

  // Runs the shadow over the states seen, and where the two part a neighbour of the run as well.
  // Costs two to four times the run; where the motion is chaotic, `spread` wants more neighbours
  // for what is observed and judged, and it is ten times. `stop` ends it: then the outcome is
  // kStopped.
  Parting compare(const std::function<bool()>& stop, bool spread = false);

 private:
  struct Frame {
    std::int64_t step;      // of the run
    double t;               // s
    std::vector<double> x;  // coordinates, or numbers of a flat state
    double largest;         // of these numbers
    double energy;          // J, total
    std::vector<double> observed;
    std::vector<double> state;  // X, where forces may be pulses
  };

  Simulation finer_run(double& steps_per_step) const;
  double finer_steps(double taken) const;
  // Steps of a finer run from one frame to the next; `each` is called after every `stride` of them,
  // or fewer. False when one fails or the run is stopped.
  bool take(Simulation& finer, double steps_per_step, std::size_t frame,
            const std::function<bool()>& stop, const std::function<void()>& each = {},
            std::int64_t stride = 1) const;
  // `factor`: the error over the difference to the shadow.
  void compare_frame(const Frame& frame, double factor, Simulation& shadow, Parting& result) const;
  // Figures asked of the run from a first state 1e-7 of the size away, another one for each number;
  // nothing when it ends early. `at_frame` sees it at every state kept.
  using AtFrame = std::function<void(Simulation& neighbour, std::size_t frame)>;
  std::optional<std::vector<double>> run_neighbour(int which, const std::function<bool()>& stop,
                                                   const AtFrame& at_frame) const;
  // `path`: places of the shadow.
  void look_for_chaos(std::span<const std::vector<double>> path, const std::function<bool()>& stop,
                      Parting& result) const;
  void ask_neighbours(const std::function<bool()>& stop, Parting& result) const;
  // Of what depends on time alone: whether it did what no step has seen.
  void look_for_pulses(Simulation& shadow, Parting& result) const;
  // An error at that frame; returns the size of the scene there.
  double take_error(double error, const Frame& frame, Parting& result) const;
  std::optional<std::vector<double>> resolved(std::size_t frame, int steps) const;
  double size_at(const Frame& frame) const;  // of the scene, m
  double usual_size() const;                 // at the start, or at the end where it is 0 there

  const SystemSpec* spec_;
  Simulation* run_;
  Registry* registry_;
  Snapshot start_;
  std::int64_t last_step_;
  std::int64_t stride_;  // looks a frame
  std::int64_t looks_ = 0;
  std::vector<Frame> frames_;
  std::vector<Quantity> asked_;
  double in_play_ = 0, start_potential_ = 0;  // J
  bool may_jump_ = false;                     // f has parts that may depend on time
};

}  // namespace sim::study
