// The same run once more with half the step, or a tenth of the tolerance: how far the two part is
// how wrong the run is, for a method of order p up to a factor near 1.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "core/study/problem.h"
#include "core/study/verdict/strain.h"

namespace sim::study {

struct Finding;

// How far a quantity that the scene observes differs in the shadow.
struct Parted {
  double at_end = 0, most = 0;  // at the last state; largest on the way
};

// How far a run and its shadow parted, and its neighbours where that is far.
struct Parting {
  enum class Outcome { kNone, kStopped, kShadowFailed, kCompared };

  Outcome outcome = Outcome::kNone;
  double error = std::nan("");      // largest on the way, of a particle, in m, or of a number
  double at_end = std::nan("");     // the same at the last state
  double share = std::nan("");      // largest error over the scene's size at that time
  double energy = std::nan("");     // largest |E - E of the shadow| over the energy in play
  double horizon = HUGE_VAL;        // s; until then the error is below 2 % of the size
  double growth = std::nan("");     // factor by which neighbouring states part in the whole run
  double rate = std::nan("");       // ... in one second
  StrainedSpring strain;            // worst of the shadow, which may show states in between
  std::vector<Parted> observed;     // of each observer of the scene
  std::vector<double> figures;      // of the shadow, as judge() asked
  double missed_at = std::nan("");  // s, where the right-hand side did what no step has seen

  bool verified() const { return outcome == Outcome::kCompared; }
};

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
  // Costs two to four times the run. `stop` ends it: then the outcome is kStopped.
  // `strain` is that of the spring that was pressed the most, below 0.
  Parting compare(double strain, const std::function<bool()>& stop);

 private:
  struct Frame {
    std::int64_t step;      // of the run
    double t;               // s
    std::vector<double> x;  // coordinates, or numbers of a flat state
    double energy;          // J, total
    std::vector<double> observed;
  };

  Simulation finer_run(double& steps_per_step) const;
  double finer_steps(double taken) const;
  // Steps of a finer run from one frame to the next; `each` is called after some. False when one
  // fails or the run is stopped.
  bool take(Simulation& finer, double steps_per_step, std::size_t frame,
            const std::function<bool()>& stop, const std::function<void()>& each = {}) const;
  // `factor`: the error over the difference to the shadow.
  void compare_frame(const Frame& frame, double factor, Simulation& shadow, Parting& result) const;
  // `path` holds what the frames hold, of the shadow.
  void look_for_chaos(std::span<const std::vector<double>> path, const std::function<bool()>& stop,
                      Parting& result) const;
  void look_for_pulses(Simulation& shadow, Parting& result) const;
  double size_at(const Frame& frame) const;  // of the scene, m

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
};

// The finding of a parting; empty words where there was no shadow.
Finding finding_of(const Parting& parting, const Simulation& run);

}  // namespace sim::study
