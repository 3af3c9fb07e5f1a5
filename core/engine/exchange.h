// A compiled scene as flat data, for external programs without plugins.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/base/array.h"
#include "core/engine/kick_map.h"
#include "core/particles/springs/net.h"
#include "core/particles/springs/springs.h"
#include "core/particles/view.h"
#include "core/scene/simulation.h"

namespace sim {
class ParticleSystem;
}

namespace sim::engine {

struct EngineMethod {
  const char* name;  // of the plugin
  Method method;
};

// The first steps, for which engines are compared with the kernel.
inline constexpr std::int64_t kExactSteps = 20;

// Masses under springs, one gravity and one drag:
//   m x'' = -sum of k (|d| - rest) d / |d| + m g - c x',  x'' = x' = 0 where pinned
// A view of the present state of a simulation, which it outlives.
class Exchange {
 public:
  // Throws Error{kScene}, or Error{kUsage} for a method that is none of these, naming the part of
  // the scene that the engine would treat differently.
  Exchange(Simulation& system, const SystemSpec& spec, const std::string& engine,
           std::span<const EngineMethod> methods);

  const std::string& name() const { return system_->name(); }
  Method method() const { return method_; }
  double h() const { return system_->h(); }  // s
  std::int64_t step() const { return system_->step_count(); }
  int particles() const { return view().n; }
  bool free(int i) const { return view().free(i); }
  double mass(int i) const { return view().mass[i]; }  // kg, of a free one
  Vec3 position(int i) const { return view().position(i); }
  Vec3 velocity(int i) const { return view().velocity(i); }
  Vec3 gravity() const;                            // m/s^2
  double drag() const;                             // kg/s
  double tolerance() const { return tolerance_; }  // of implicit methods; 0: a sufficient one
  // The map of a free particle, for methods with kicks.
  KickMap map(int i) const { return kick_map(mass(i)); }
  KickMap kick_map(double mass_there) const { return {method_, mass_there, drag(), h()}; }

  // The acceleration without drag, m/s^2: three coordinates in a Layout(particles(), 3).
  Array accelerations() const;

  // Calls visit(a, b, k, rest) for every spring, always in the same order; N/m and m.
  template <class Visit>
  void each_spring(Visit visit) const {
    for (const SpringRun* run : runs())
      for (int a = 0; a + run->stride < particles(); ++a)
        if (run->owns(a)) visit(a, a + run->stride, run->k_of(a), run->rest_of(a));
    for (const Net* net : nets())
      for (int a = 0; a < particles(); ++a)
        net->at(a, [&](int b, double k, double rest) {
          if (b > a) visit(a, b, k, rest);
        });
  }

 private:
  ParticleView view() const;
  std::span<const SpringRun* const> runs() const;
  std::span<const Net* const> nets() const;

  Simulation* system_;
  ParticleSystem* particles_ = nullptr;
  Method method_ = Method::kVerlet;
  double tolerance_ = 0;
};

}  // namespace sim::engine
