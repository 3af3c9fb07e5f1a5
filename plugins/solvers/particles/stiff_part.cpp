#include "stiff_part.h"

#include <algorithm>
#include <complex>
#include <functional>
#include <map>
#include <optional>

#include "core/base/noise.h"
#include "core/math/arnoldi.h"
#include "core/particles/force_of_another.h"
#include "core/particles/particle_jacobian.h"
#include "core/particles/springs/springs.h"

namespace sim {
namespace {

constexpr double kShareOfLimit = 0.8;  // of 2 / omega, that the soft part may use
constexpr double kKickLimit = 4;       // h times the decay of velocities that its kicks stand
constexpr double kMost = 0.5;          // of the springs, that are stiff beside soft ones
constexpr double kApart = 0.5;         // of the limit, of what is soft between stiff trees
constexpr double kBinsOfTwo = 8;       // thresholds to each factor of 2

// A part of a force that belongs to another system.
class Lent final : public ForceOfAnother {
 public:
  enum class Part { kWhole, kWithoutSprings, kAccumulated, kMemory };
  Lent(Force& force, Part part) : ForceOfAnother(force), part_(part) {}

  std::optional<AffineForce> affine() const override {
    const bool has_it = part_ == Part::kWhole || part_ == Part::kWithoutSprings;
    return has_it ? other().affine() : std::nullopt;
  }
  const Springs* springs() const override {
    return part_ == Part::kWhole ? other().springs() : nullptr;
  }
  bool accumulates() const override { return part_ != Part::kMemory && other().accumulates(); }
  void prepare(const ParticleView& view, ThreadPool& pool) override { other().prepare(view, pool); }
  void accumulate(const ParticleView& view, Tile tile, ForceSink sink) const override {
    other().accumulate(view, tile, sink);
  }
  std::unique_ptr<ForceSweep> sweep() const override { return other().sweep(); }
  bool depends_on_velocity() const override { return other().depends_on_velocity(); }
  int internal_size() const override { return other().internal_size(); }
  void start(std::span<double> memory) const override { other().start(memory); }
  void derive(const ParticleView& view, std::span<double> rate) const override {
    other().derive(view, rate);
  }
  bool internal_depends_on_particles() const override {
    return other().internal_depends_on_particles();
  }
  bool has_jacobian() const override { return other().has_jacobian(); }
  void jacobian(const ParticleView& view, JacobianSink& sink) const override {
    other().jacobian(view, sink);
  }
  double potential(const ParticleView& view, Tile tile) const override {
    return part_ == Part::kWhole || !other().springs() ? other().potential(view, tile) : 0;
  }

 private:
  Part part_;
};

class SomeSprings final : public Force {
 public:
  SomeSprings(int n, SpringSense sense, const std::function<void(const Springs::Visit&)>& for_each)
      : springs_(n, for_each, sense) {}

  const Springs* springs() const override { return &springs_; }
  double potential(const ParticleView& view, Tile tile) const override {
    return springs_.potential(view, tile);
  }
  bool conservative() const override { return true; }

 private:
  Springs springs_;
};

// Gershgorin bounds: the row sums of |K_ij| / sqrt(m_i m_j) bound omega^2, and those of |C_ij| /
// sqrt(m_i m_j) the decay rates of velocities.
class RowSums final : public JacobianSink {
 public:
  explicit RowSums(const ParticleView& view)
      : view_(&view), stiffness_(static_cast<std::size_t>(view.n)), damping_(stiffness_.size()) {}

  void position(int i, int j, const Mat3& block) override { add(stiffness_, i, j, block); }
  void velocity(int i, int j, const Mat3& block) override { add(damping_, i, j, block); }
  double omega() const { return std::sqrt(*std::ranges::max_element(stiffness_)); }
  double decay() const { return *std::ranges::max_element(damping_); }

 private:
  void add(std::vector<double>& sums, int i, int j, const Mat3& block) const {
    if (view_->free(i) && view_->free(j))
      sums[static_cast<std::size_t>(i)] += size(block) / std::sqrt(view_->mass[i] * view_->mass[j]);
  }

  static double size(const Mat3& block) {
    double square = 0;
    for (std::size_t k = 0; k < 3; ++k) square += block.column(k).squaredNorm();
    return std::sqrt(square);
  }

  const ParticleView* view_;
  std::vector<double> stiffness_, damping_;
};

// The largest eigenvalue of M^-1/2 A M^-1/2 for the derivatives A of the forces along directions in
// block `from` of a state, to about 3 % (Arnoldi 1951).
double largest_eigenvalue(Particles& system, ParticleJacobian& jacobian, int from) {
  constexpr int kProducts = 20;
  const Layout& layout = system.layout();
  const std::span<const double> masses = system.masses();
  const auto root = [&](int i) {  // of the mass; 0 where pinned
    const double mass = masses[static_cast<std::size_t>(i)];
    return std::isfinite(mass) ? std::sqrt(mass) : 0;
  };
  Array dx(layout.size()), df(layout.size()), start(3 * static_cast<std::size_t>(layout.n()));
  const auto in = layout.axes(dx.data(), from);
  const auto out = layout.axes(df.data(), 3);
  const auto apply = [&](const double* y, double* image) {
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < layout.n(); ++i)
        in[axis][i] = root(i) > 0 ? y[3 * i + axis] / root(i) : 0;
    jacobian.apply(dx.data(), df.data());
    for (int axis = 0; axis < 3; ++axis)
      for (int i = 0; i < layout.n(); ++i)
        image[3 * i + axis] = root(i) > 0 ? -out[axis][i] * root(i) : 0;
  };
  Noise noise;
  for (int i = 0; i < layout.n(); ++i)
    for (int axis = 0; axis < 3; ++axis)
      start[static_cast<std::size_t>(3 * i + axis)] = root(i) > 0 ? noise.next() : 0;
  Arnoldi arnoldi(apply, start.span(), kProducts);
  for (int i = 0; i < kProducts; ++i) arnoldi.extend();
  double largest = 0;
  if (arnoldi.size() > 0)
    for (const std::complex<double>& value : arnoldi.values())
      largest = std::max(largest, value.real());
  return largest;
}

// The fastest rate, rad/s, that kicks have to resolve: an oscillation, or the decay of velocities.
double fastest_rate(Particles& system, double t, const double* x) {
  ParticleJacobian jacobian(system);
  jacobian.at(t, x);
  const double omega = std::sqrt(largest_eigenvalue(system, jacobian, 0));
  if (!system.needs_velocities()) return omega;
  return std::max(omega, 2 / kKickLimit * largest_eigenvalue(system, jacobian, 3));
}

// Springs by their omega, in bins with kBinsOfTwo to a factor of two.
class Histogram {
 public:
  void add(double omega) {
    ++all_;
    if (omega > 0) ++counts_[bin_of(omega)];
  }
  static double edge(int bin) { return std::exp2(bin / kBinsOfTwo); }
  long all() const { return all_; }

  // Lower edges of the bins that are not empty and below `most`, descending.
  std::vector<double> cuts(double most) const {
    std::vector<double> edges;
    for (auto bin = counts_.rbegin(); bin != counts_.rend(); ++bin)
      if (edge(bin->first) < most) edges.push_back(edge(bin->first));
    return edges;
  }
  long from(double cut) const {
    long sum = 0;
    for (const auto& [bin, count] : counts_)
      if (edge(bin) >= cut) sum += count;
    return sum;
  }

 private:
  static int bin_of(double omega) {
    return static_cast<int>(std::floor(kBinsOfTwo * std::log2(omega)));
  }
  std::map<int, long> counts_;
  long all_ = 0;
};

}  // namespace

void SoftSystem::combine(const Stage& stage, double* out) { combine_range_(stage, out, 0, size()); }

void SoftSystem::eval(double t, const Stage& stage, double* y, double* dydt) {
  combine(stage, y);
  const auto a = layout().axes(dydt, 3);
  accelerate(view(t, y), a.data());
  derive(view(t, y), dydt + layout().size());
  for (int axis = 0; axis < 3; ++axis)
    std::copy_n(layout().block(y, 3 + axis), layout().n(), layout().block(dydt, axis));
}

std::unique_ptr<Jacobian> SoftSystem::jacobian() {
  if (internal_size() > 0) return OdeSystem::jacobian();
  return std::make_unique<ParticleJacobian>(*this);
}

// The parts copy springs, and copies would not break: breakable springs stay soft.
std::optional<bool> StiffPart::said(Force& force) const {
  return force.breakable() ? false : said_(force);
}

double StiffPart::omega(int a, int b, double k) const {
  const std::span<const double> masses = system_->masses();
  return std::sqrt(
      k * (1 / masses[static_cast<std::size_t>(a)] + 1 / masses[static_cast<std::size_t>(b)]));
}

template <class Visit>
void StiffPart::for_springs(const Partition& partition, std::size_t force, bool stiff,
                            const Visit& visit) const {
  const Force& of = *system_->forces()[force];
  const Springs* const springs = of.springs();
  if (!springs) return;
  const std::optional<bool> wish = said(*system_->forces()[force]);
  springs->for_each([&](int a, int b, double k, double rest) {
    if (wish.value_or(omega(a, b, k) >= partition.cut) == stiff) visit(a, b, k, rest);
  });
}

bool StiffPart::accumulates_stiffly(const Partition& partition, std::size_t force) const {
  return force < partition.others.size() && partition.others[force] != 0;
}

// Rates, rad/s, by which accumulated forces are compared with springs: 0 for forces without
// derivatives or with internal variables, which are soft.
std::vector<double> StiffPart::rates_of_others(double t, const double* x) const {
  std::vector<double> rates;
  for (Force* const force : system_->forces()) {
    rates.push_back(0);
    if (!force->accumulates() || !force->has_jacobian() || force->internal_size() > 0) continue;
    const ParticleView view = system_->view(t, x);
    force->prepare(view, system_->pool());
    RowSums sums(view);
    force->jacobian(view, sums);
    rates.back() = std::max(sums.omega(), 2 / kKickLimit * sums.decay());
  }
  return rates;
}

Partition StiffPart::choose(double t, double h, const double* x) {
  const std::span<Force* const> forces = system_->forces();
  const double most = 2 * kShareOfLimit / h;
  const std::vector<double> rates = rates_of_others(t, x);
  Histogram springs;
  bool asked = false;  // some force is said to be stiff
  for (std::size_t i = 0; i < forces.size(); ++i) {
    const std::optional<bool> wish = said(*forces[i]);
    asked = asked || wish == true;
    if (!wish && forces[i]->springs())
      forces[i]->springs()->for_each(
          [&](int a, int b, double k, double) { springs.add(omega(a, b, k)); });
  }
  const auto with_cut = [&](double cut) {
    Partition partition{.step = h, .cut = cut, .others = {}};
    for (std::size_t i = 0; i < forces.size(); ++i)
      partition.others.push_back(forces[i]->accumulates() &&
                                 said(*forces[i]).value_or(rates[i] >= cut));
    return partition;
  };
  const auto stands = [&](const Partition& partition, double share = 1) {
    const auto soft = soft_system(partition, x);
    return fastest_rate(*soft, t, x) <= share * most;
  };
  const Partition none = with_cut(HUGE_VAL);
  if (asked ? stands(none) : fastest_rate(*system_, t, x) <= most) return none;

  // Springs above the limit by themselves are stiff, then as few others as suffice.
  std::vector<double> cuts = springs.cuts(most);
  for (const double rate : rates)
    if (rate > 0 && rate < most) cuts.push_back(rate);
  cuts.push_back(most);
  std::ranges::sort(cuts, std::greater{});
  std::size_t low = 0, high = cuts.size();  // cuts[high] is known, or taken, to be enough
  while (low < high) {
    const std::size_t middle = (low + high) / 2;
    if (stands(with_cut(cuts[middle])))
      high = middle;
    else
      low = middle + 1;
  }
  // Springs that the scene keeps soft may exceed the limit whatever the partition.
  if (low == cuts.size() && !stands(with_cut(0))) return with_cut(most);
  const double cut = low < cuts.size() ? cuts[low] : 0;
  // Chains and trees are eliminated without fill, so soft springs between them would only cost.
  const long stiff = springs.from(cut);
  const bool most_of_them = static_cast<double>(stiff) > kMost * static_cast<double>(springs.all());
  const auto as_trees = [&] {
    return stiff < springs.all() && stiff <= std::ssize(stiff_particles(with_cut(cut))) &&
           stands(with_cut(cut), kApart);
  };
  return with_cut(most_of_them && !as_trees() ? 0 : cut);
}

PartitionCount StiffPart::count(const Partition& partition) const {
  PartitionCount count;
  for (std::size_t i = 0; i < system_->forces().size(); ++i) {
    for_springs(partition, i, false, [&](int, int, double, double) { ++count.springs; });
    for_springs(partition, i, true, [&](int a, int b, double k, double) {
      ++count.springs;
      ++count.stiff_springs;
      count.fastest_stiff = std::max(count.fastest_stiff, omega(a, b, k));
    });
    count.stiff_forces += accumulates_stiffly(partition, i);
  }
  return count;
}

std::unique_ptr<SoftSystem> StiffPart::soft_system(const Partition& partition,
                                                   const double* x) const {
  const int n = system_->layout().n();
  std::vector<std::unique_ptr<Force>> forces;
  // Internal variables are in X in the order of all forces; those of inactive forces are kept.
  auto memory = system_->internal_variables().begin();
  const auto pass_memories = [&](const Force* until) {
    for (; memory != system_->internal_variables().end() && memory->force != until; ++memory) {
      if (std::ranges::count(system_->forces(), memory->force) > 0) return;
      forces.push_back(std::make_unique<Lent>(*memory->force, Lent::Part::kMemory));
    }
    if (memory != system_->internal_variables().end() && until) ++memory;
  };
  for (std::size_t i = 0; i < system_->forces().size(); ++i) {
    Force& force = *system_->forces()[i];
    if (force.internal_size() > 0) pass_memories(&force);
    const bool accumulates = force.accumulates() && !accumulates_stiffly(partition, i);
    long stiff = 0, soft = 0;
    for_springs(partition, i, true, [&](int, int, double, double) { ++stiff; });
    for_springs(partition, i, false, [&](int, int, double, double) { ++soft; });
    if (stiff == 0 && (accumulates || !force.accumulates())) {
      forces.push_back(std::make_unique<Lent>(force, Lent::Part::kWhole));
      continue;
    }
    if (accumulates || force.affine())
      forces.push_back(std::make_unique<Lent>(force, Lent::Part::kWithoutSprings));
    if (soft > 0)
      forces.push_back(std::make_unique<SomeSprings>(
          n, force.springs()->sense(),
          [&](const Springs::Visit& visit) { for_springs(partition, i, false, visit); }));
  }
  pass_memories(nullptr);
  const std::span<const double> masses = system_->masses();
  auto system =
      std::make_unique<SoftSystem>(std::vector<double>(masses.begin(), masses.end()),
                                   std::vector<int>{}, std::move(forces), x, system_->pool());
  // Pinned and kinematic particles keep their velocities.
  if (system_->motion().inverse_masses)
    system->set_masses(std::vector<double>(masses.begin(), masses.end()), {}, true);
  return system;
}

std::unique_ptr<Particles> StiffPart::stiff_system(const Partition& partition,
                                                   std::span<const int> ids, const double* x,
                                                   ThreadPool& pool) const {
  const std::span<const double> all = system_->masses();
  const auto number = [&](int id) {
    return ids.empty() ? id : static_cast<int>(std::ranges::lower_bound(ids, id) - ids.begin());
  };
  std::vector<double> masses(all.begin(), all.end());
  Array start(system_->layout().size());
  std::copy_n(x, start.size(), start.data());
  if (!ids.empty()) {
    const Layout few(static_cast<int>(ids.size()));
    masses.clear();
    for (const int id : ids) masses.push_back(all[static_cast<std::size_t>(id)]);
    start = Array(few.size());
    for (int block = 0; block < 6; ++block)
      for (std::size_t i = 0; i < ids.size(); ++i)
        few.block(start.data(), block)[i] = system_->layout().block(x, block)[ids[i]];
  }
  std::vector<std::unique_ptr<Force>> forces;
  for (std::size_t i = 0; i < system_->forces().size(); ++i) {
    long stiff = 0;
    for_springs(partition, i, true, [&](int, int, double, double) { ++stiff; });
    if (stiff > 0)
      forces.push_back(std::make_unique<SomeSprings>(
          static_cast<int>(masses.size()), system_->forces()[i]->springs()->sense(),
          [&](const Springs::Visit& visit) {
            for_springs(partition, i, true, [&](int a, int b, double k, double rest) {
              visit(number(a), number(b), k, rest);
            });
          }));
    if (accumulates_stiffly(partition, i))
      forces.push_back(std::make_unique<Lent>(*system_->forces()[i], Lent::Part::kAccumulated));
  }
  auto system = std::make_unique<Particles>(masses, std::vector<int>{}, std::move(forces),
                                            start.data(), pool);
  if (system_->motion().inverse_masses) system->set_masses(masses, {}, true);
  return system;
}

std::vector<int> StiffPart::stiff_particles(const Partition& partition) const {
  std::vector<int> ids;
  for (std::size_t i = 0; i < system_->forces().size(); ++i) {
    if (accumulates_stiffly(partition, i)) return {};
    for_springs(partition, i, true, [&](int a, int b, double, double) {
      ids.push_back(a);
      ids.push_back(b);
    });
  }
  std::ranges::sort(ids);
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

}  // namespace sim
