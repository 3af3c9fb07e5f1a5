// The kernels of the run itself, compared at some states with an independent evaluation. Otherwise
// a verdict would rest on the errors that it is to find.
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/base/array.h"
#include "core/base/error.h"
#include "core/base/text.h"
#include "core/particles/rigid/rigid_body.h"
#include "core/study/accuracy/trajectory.h"
#include "core/study/verdict/criterion.h"
#include "core/study/verdict/reference_forces.h"

namespace sim::study {
namespace {

constexpr double kRoundings = 1e-11;    // of the sizes of the terms
constexpr double kBelow = 1e-6;         // of the scene's size, that a particle may be inside
constexpr double kFewParticles = 2000;  // whose evaluation costs nothing to speak of
constexpr double kOneOf = 100, kOneOfOthers = 400;  // evaluations, of which a run affords a look
constexpr int kMostLooks = 1;                       // besides the first and the last

std::string force_text(const Vec3& f) {
  return "(" + brief(f[0], 6) + ", " + brief(f[1], 6) + ", " + brief(f[2], 6) + ") N";
}

double evaluations_of_run(const Watched& run) {
  return static_cast<double>(run.steps) * std::max(1, run.system.integrator_info().evaluations);
}

class KernelCriterion final : public Criterion {
 public:
  explicit KernelCriterion(const Watched& run)
      : spec_(&run.spec),
        system_(&run.system),
        particles_(dynamic_cast<ParticleSystem*>(&run.system.ode())),
        spread_(run.steps, looks_of(run)),
        later_(looks_of(run) > 0) {
    const ParticleView view = now();
    plain_.emplace(*spec_, *particles_, view, run.system.settings().off);
    check_forces(view);
    check_energies(view);
  }

  void look(const Energy* /*energy*/) override {
    if (words_.empty() && !touched_ && spread_.take(system_->step_count())) check_forces(now());
  }

  void touched() override { touched_ = true; }

  void conclude(Figures& /*figures*/, std::vector<Finding>& findings) override {
    // A verdict may be asked for more than once at one state.
    const std::int64_t step = system_->step_count();
    if (words_.empty() && !touched_ && concluded_ != step) {
      if (later_ && spread_.last() != step) check_forces(now());
      check_contact(now());
    }
    concluded_ = step;
    if (!words_.empty()) findings.push_back({Trust::kSuspect, words_});
  }

 private:
  // Other forces are evaluated twice for a check, springs once.
  static int looks_of(const Watched& run) {
    const double one = particles_of(run.system)->other_forces().empty() ? kOneOf : kOneOfOthers;
    return static_cast<int>(std::min<double>(kMostLooks, evaluations_of_run(run) / one));
  }

  ParticleView now() const { return particles_->view(system_->t(), system_->state().data()); }

  void check_energies(const ParticleView& view) {
    if (!plain_->known()) return;
    for (const ReferenceForces::Potential& each : plain_->potentials())
      compare("potential energy of force '" + particles_->name_of(*each.force) + "'",
              each.force->potential(particles_->seen_by(*each.force, view), {0, view.n}),
              each.energy, each.scale);
    double kinetic = 0;
    for (int i = 0; i < view.n; ++i)
      if (view.free(i)) kinetic += 0.5 * view.mass[i] * view.velocity(i).squaredNorm();
    compare("kinetic energy", particles_->kinetic_energy(view.t, system_->state().data()), kinetic,
            kinetic);
  }

  void compare(const std::string& name, double of_kernel, double plain, double scale) {
    if (!words_.empty() || !std::isfinite(plain) || !std::isfinite(scale)) return;
    if (std::abs(of_kernel - plain) <= kRoundings * scale) return;
    words_ = "the " + name + " of the kernel is " + brief(of_kernel, 6) + " J, evaluated plainly " +
             brief(plain, 6) + " J";
  }

  // Compares the accelerations of a step with plain springs and affine forces, and the other forces
  // with themselves, one particle at a time.
  void check_forces(const ParticleView& view) {
    if (!plain_->known()) return;
    try {
      std::vector<ReferenceForces::Sum> sums = plain_->forces(view);
      Array of_kernel(particles_->layout().size());
      const auto a = particles_->layout().axes(of_kernel.data());
      particles_->accelerate(view, a.data());
      for (Force* force : particles_->other_forces()) add_other(*force, view, sums);
      for (std::size_t k = 0; words_.empty() && k < sums.size(); ++k) {
        const auto i = static_cast<std::size_t>(plain_->ids()[k]);
        const Vec3 force = view.mass[i] * Vec3(a[0][i], a[1][i], a[2][i]);
        if (differ(force, sums[k].force, sums[k].scale)) refuse(k, view, force, sums[k].force);
      }
    } catch (const Error&) {  // a function of the scene, which says so itself
    }
  }

  static bool differ(const Vec3& f, const Vec3& plain, double scale) {
    return plain.allFinite() && !((f - plain).norm() <= kRoundings * scale);
  }

  void refuse(std::size_t k, const ParticleView& view, const Vec3& force, const Vec3& plain) {
    const std::string springs = plain_->springs_of(k, view, force - plain);
    words_ =
        (springs.empty() ? "the force of gravity and drag" : "the force of springs " + springs) +
        " on particle " + std::to_string(plain_->ids()[k]) + " is " + force_text(force) +
        ", off by " + brief((force - plain).norm(), 3) + " N from scalar code: a kernel is wrong";
  }

  void add_other(Force& force, const ParticleView& state, std::vector<ReferenceForces::Sum>& sums) {
    const ParticleView view = particles_->seen_by(force, state);
    const auto n = static_cast<std::size_t>(view.n);
    Array all(3 * n), alone(3 * n);
    const ForceSink sink{all.data(), all.data() + n, all.data() + 2 * n};
    const ForceSink one{alone.data(), alone.data() + n, alone.data() + 2 * n};
    force.prepare(view, particles_->pool());
    force.accumulate(view, {0, view.n}, sink);
    for (std::size_t k = 0; k < sums.size(); ++k) {
      const int i = plain_->ids()[k];
      force.accumulate(view, {i, i + 1}, one);
      const Vec3 together(sink.x[i], sink.y[i], sink.z[i]), single(one.x[i], one.y[i], one.z[i]);
      if (words_.empty() && differ(together, single, together.norm() + single.norm()))
        words_ = "force '" + particles_->name_of(force) + "' on particle " + std::to_string(i) +
                 " is " + force_text(together) + ", evaluated alone " + force_text(single) +
                 ": a kernel is wrong";
      sums[k].force += single;
      sums[k].scale += single.norm();
    }
  }

  // Undetected contact leaves a particle where no step would.
  void check_contact(const ParticleView& view) {
    const Contacts& contacts = particles_->contacts();
    if (contacts.empty()) return;
    const double most = kBelow * scene_size(*system_);
    std::vector<bool> in_body(static_cast<std::size_t>(view.n));
    for (const RigidSpec& body : spec_->bodies)
      std::fill_n(in_body.begin() + body.first, RigidBody::kParticles, true);
    for (int i = 0; i < view.n; ++i) {
      if (!view.free(i) || in_body[static_cast<std::size_t>(i)] || contacts.work_sums().touched(i))
        continue;
      for (const Collider* collider : contacts.all()) {
        const double gap = collider->query(view.t, view.position(i)).gap;
        if (!(gap < -most)) continue;
        words_ = "particle " + std::to_string(i) + " is " + brief(-gap, 3) +
                 " m inside a collider and contact saw nothing of it: a kernel is wrong";
        return;
      }
    }
  }

  const SystemSpec* spec_;
  Simulation* system_;
  ParticleSystem* particles_;
  Spread spread_;
  std::int64_t concluded_ = -1;
  bool later_, touched_ = false;
  std::optional<ReferenceForces> plain_;
  std::string words_;
};

}  // namespace

std::unique_ptr<Criterion> watch_kernels(const Watched& run) {
  if (!run.system.second_order()) return nullptr;
  const ParticleSystem& particles = *particles_of(run.system);
  const bool costly = !particles.other_forces().empty() && run.system.particles() > kFewParticles &&
                      evaluations_of_run(run) < kOneOf;
  return costly ? nullptr : std::make_unique<KernelCriterion>(run);
}

}  // namespace sim::study
