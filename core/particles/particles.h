// Particles with masses under forces, as compiled from a scene; steppers read them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "core/base/array.h"
#include "core/base/layout.h"
#include "core/base/thread_pool.h"
#include "core/particles/contacts.h"
#include "core/particles/force.h"
#include "core/particles/motion.h"
#include "core/particles/prescribed_motion.h"

namespace sim {

class Net;         // core/particles/springs/net.h
struct SpringRun;  // core/particles/springs/spring_run.h

// q' = v, v' = F(t, q, v, m) / M + g - (c / M) v, with g and c summed over the affine forces, and
// m' = the rates of the internal variables m of forces. A pinned particle has infinite mass: its
// acceleration is zero, and so is its velocity unless the user drags it or it is prescribed. A
// state is X = (q, v, m).
class Particles {
 public:
  // masses in kg, n of them; pinned ids in any order; forces are bound to `initial`, a state
  // without internal variables, with zero velocities where pinned.
  Particles(const std::vector<double>& masses, const std::vector<int>& pinned,
            std::vector<std::unique_ptr<Force>> forces, const double* initial, ThreadPool& pool);
  ~Particles();

  // Steppers have to be made again. With `some_move`, pinned particles may have velocities, and
  // keep them.
  void set_masses(const std::vector<double>& masses, const std::vector<int>& pinned,
                  bool some_move = false);
  // Turns these off, by ascending index, and all others on. Internal variables are kept.
  void set_off(std::span<const std::size_t> forces, std::span<const std::size_t> colliders);
  const Layout& layout() const noexcept { return layout_; }
  ParticleView view(double t, const double* state) const;
  std::span<const double> masses() const noexcept { return mass_; }  // kg; infinity where pinned
  int pinned_count() const noexcept { return pinned_count_; }
  const Motion& motion() const noexcept { return motion_; }
  ThreadPool& pool() const noexcept { return *pool_; }
  std::span<Force* const> forces() const noexcept { return on_; }  // that are on
  std::span<const SpringRun* const> runs() const noexcept { return runs_; }
  std::span<const Net* const> nets() const noexcept;
  std::span<Force* const> other_forces() const noexcept { return other_forces_; }  // accumulate
  bool needs_velocities() const noexcept { return needs_velocities_; }  // some of the others
  // Other forces and nets may read any particle; gathered before the sweep of each block.
  bool has_other_forces() const noexcept { return !other_forces_.empty() || !nets().empty(); }
  bool sweeps_other_forces() const noexcept { return all_swept_; }  // there are, with a sweep()
  int reach() const noexcept { return reach_; }  // of a sweep around a block; a multiple of kGrain
  void name_forces(std::vector<std::string> names) { names_ = std::move(names); }
  std::string name_of(const Force& force) const;
  std::span<const InternalVariables> internal_variables() const noexcept {
    return internal_;
  }                                                                      // of all forces
  std::size_t internal_size() const noexcept { return internal_size_; }  // in whole cache lines
  bool internal_follows_particles() const noexcept { return internal_follows_particles_; }
  void start_internal(double* state) const;                           // as at t = 0
  ParticleView seen_by(const Force& force, ParticleView view) const;  // with its own memory
  // rates := m' of all internal variables; after prepare_gather() if they depend on the particles.
  void derive(const ParticleView& view, double* rates) const;
  bool conserves_energy() const noexcept;                          // springs and m g alone
  double kinetic_energy(double t, const double* state) const;      // J
  double potential_energy(double t, const double* state) const;    // J
  double elastic_energy(double t, const double* state) const;      // J, of the springs alone
  double unbreakable_energy(double t, const double* state) const;  // J, without ties that may break
  bool has_damping() const noexcept { return motion_.damping > 0 || has_dashpots_; }
  // The power, W, of drag and dashpots; sums: scratch for three coordinates in a layout.
  double damping_power(double t, const double* state, Array& sums) const;
  const Contacts& contacts() const noexcept { return contacts_; }
  const PrescribedMotion& prescribed() const noexcept { return prescribed_; }
  PrescribedMotion& prescribed() noexcept { return prescribed_; }  // of pinned particles
  void set_accuracy(Accuracy accuracy) { contacts_.set_accuracy(accuracy); }
  void add_collider(std::unique_ptr<Collider>, const std::string& name, const double* x, int n);
  // a := the accelerations, m/s^2; arrays but masses padded as in a layout. drag: false if kicks
  // include it.
  void accelerate(const ParticleView& view, double* const a[3], bool drag = true);
  void prepare_gather(const ParticleView& view);  // once per evaluation, before gather()
  void gather(const ParticleView& view, Tile tile, ForceSink sink) const;  // sink := their sum
  // Calls f(begin, end) for parts of the first `blocks` coordinates of a state, on all threads.
  template <class F>
  void for_ranges(int blocks, const F& f) const {
    pool_->run_parts(layout_.n(), 8, [&](int begin, int end) {
      for (int block = 0; block < blocks; ++block)
        f(layout_.offset(block) + static_cast<std::size_t>(begin),
          layout_.offset(block) + static_cast<std::size_t>(end));
    });
  }

 private:
  void add_internal(Force& force);
  void add(Force& force, std::vector<const Net*>& nets);
  template <class Chosen>
  double potential_of(double t, const double* state, Chosen chosen) const;

  Layout layout_;
  std::vector<double> mass_, inverse_mass_;
  std::vector<std::uint8_t> free_;
  int pinned_count_ = 0, reach_ = 0;
  std::vector<std::unique_ptr<Force>> forces_;
  std::vector<Force*> on_, other_forces_, prepared_;  // prepared: and those with internal variables
  std::vector<std::string> names_;
  Motion motion_;
  std::vector<const SpringRun*> runs_;
  Contacts contacts_;
  PrescribedMotion prescribed_;
  bool needs_velocities_ = false, internal_follows_particles_ = false, has_dashpots_ = false,
       all_swept_ = false;
  std::vector<InternalVariables> internal_;
  std::size_t internal_size_ = 0;
  ThreadPool* pool_;
  struct Sums;  // of nets and runs
  std::unique_ptr<Sums> sums_;
};

}  // namespace sim
