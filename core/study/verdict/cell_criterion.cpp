// Cells of bodies: inside out, crushed, or too few for their load.
#include <cmath>
#include <numbers>
#include <vector>

#include "core/base/text.h"
#include "core/particles/continuum_force.h"
#include "core/particles/particle_system.h"
#include "core/study/verdict/criterion.h"

namespace sim::study {
namespace {

constexpr int kCellLooks = 12;
constexpr double kCrushed = 0.1;    // volume over that at rest
constexpr double kSquashed = 0.2;   // principal stretch
constexpr double kTooCoarse = 0.5;  // difference of strains around a corner

class CellCriterion final : public Criterion {
 public:
  CellCriterion(const Watched& run, std::vector<const ContinuumForce*> forces)
      : system_(&run.system), forces_(std::move(forces)), looks_(run.steps, kCellLooks) {}

  void look(const Energy* /*energy*/) override {
    if (looks_.take(system_->step_count())) measure();
  }

  void conclude(Figures& figures, std::vector<Finding>& findings) override {
    if (looks_.last() != system_->step_count()) measure();
    figures.cells = worst_;
    findings.push_back(finding());
  }

 private:
  void measure() {
    const ParticleView view = particles_of(*system_)->view(system_->t(), system_->state().data());
    for (const ContinuumForce* force : forces_) worst_.take(force->cell_quality(view));
  }

  Finding finding() const {
    const std::string smallest = "cell " + std::to_string(worst_.smallest);
    if (worst_.inverted > 0)
      return {Trust::kSuspect, "up to " + std::to_string(worst_.inverted) +
                                   (worst_.inverted == 1 ? " cell is" : " cells are") +
                                   " inside out, as " + smallest};
    if (worst_.volume < kCrushed)
      return {Trust::kSuspect,
              smallest + " is crushed to " + percent(worst_.volume, 1, 2) + " of its volume"};
    if (worst_.strain_jump > kTooCoarse)
      return {Trust::kSuspect, "the mesh is too coarse for its load: the strain of cell " +
                                   std::to_string(worst_.jumps) + " is off by " +
                                   percent(worst_.strain_jump, 1, 2) +
                                   " from that of the cells around it"};
    if (worst_.least < kSquashed)
      return {Trust::kSuspect,
              "a cell is pressed to " + percent(worst_.least, 1, 2) + " of its thickness"};
    return {Trust::kTrusted, "cells stretched by " + percent(worst_.least - 1, 1, 2) + " to " +
                                 percent(worst_.most - 1, 1, 2) + ", right angles off by " +
                                 brief(worst_.angle * 180 / std::numbers::pi, 2) + " degrees"};
  }

  Simulation* system_;
  std::vector<const ContinuumForce*> forces_;
  Spread looks_;
  CellQuality worst_;
};

}  // namespace

std::unique_ptr<Criterion> watch_cells(const Watched& run) {
  const ParticleSystem* particles = particles_of(run.system);
  if (!particles) return nullptr;
  std::vector<const ContinuumForce*> forces;
  for (const Force* const force : particles->forces())
    if (const auto* continuum = dynamic_cast<const ContinuumForce*>(force))
      forces.push_back(continuum);
  if (forces.empty()) return nullptr;
  return std::make_unique<CellCriterion>(run, std::move(forces));
}

}  // namespace sim::study
