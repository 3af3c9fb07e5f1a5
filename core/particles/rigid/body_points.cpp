#include "core/particles/rigid/body_points.h"

#include <algorithm>

#include "core/base/array.h"
#include "core/base/layout.h"
#include "core/particles/breakable.h"
#include "core/particles/springs/springs.h"

namespace sim {
namespace {

// The joint nodes, shown as particles.
class NodeView {
 public:
  explicit NodeView(std::vector<JointNode> nodes)
      : nodes_(std::move(nodes)),
        layout_(static_cast<int>(nodes_.size())),
        state_(layout_.size()),
        mass_(nodes_.size()) {}

  const std::vector<JointNode>& nodes() const { return nodes_; }
  int size() const { return static_cast<int>(nodes_.size()); }

  ParticleView look(const ParticleView& from) {
    const double* const in[6] = {from.x, from.y, from.z, from.vx, from.vy, from.vz};
    for (int block = 0; block < 6; ++block) {
      double* const out = layout_.block(state_.data(), block);
      if (!in[block]) continue;
      for (std::size_t k = 0; k < nodes_.size(); ++k) {
        const JointNode& node = nodes_[k];
        double sum = in[block][node.ids[0]];
        if (node.count > 1) {
          sum *= node.weights[0];
          for (std::size_t p = 1; p < 4; ++p) sum += node.weights[p] * in[block][node.ids[p]];
        }
        out[k] = sum;
      }
    }
    // A point of a body has no mass of its own; it reports the mass of the whole body.
    for (std::size_t k = 0; k < nodes_.size(); ++k) {
      mass_[k] = 0;
      for (int p = 0; p < nodes_[k].count; ++p)
        mass_[k] += from.mass[nodes_[k].ids[static_cast<std::size_t>(p)]];
    }
    const double* const x = state_.data();
    ParticleView view = from;
    view.n = size();
    view.x = layout_.block(x, 0), view.y = layout_.block(x, 1), view.z = layout_.block(x, 2);
    if (from.vx)
      view.vx = layout_.block(x, 3), view.vy = layout_.block(x, 4), view.vz = layout_.block(x, 5);
    view.mass = mass_.data();
    return view;
  }

 private:
  std::vector<JointNode> nodes_;
  Layout layout_;
  Array state_;
  std::vector<double> mass_;
};

// A force or a constraint between nodes, and its ties: those of grids alone bridge others, and
// grids join no points of bodies.
template <class Part>
class PartOnNodes : public Part, public Breakable {
 public:
  Breakable* breakable() override { return part_->breakable() ? this : nullptr; }
  int ties() const override { return part_->breakable()->ties(); }
  // A point of a body is represented by the first of its particles.
  std::array<int, 2> ends(int tie) const override {
    std::array<int, 2> ends = part_->breakable()->ends(tie);
    for (int& end : ends) end = seen_.nodes()[static_cast<std::size_t>(end)].ids[0];
    return ends;
  }
  double energy(const ParticleView& view, int tie) const override {
    return part_->breakable()->energy(seen_.look(view), tie);
  }
  void find_overloaded(const ParticleView& view, std::span<const double> multipliers,
                       std::vector<int>& ties) const override {
    part_->breakable()->find_overloaded(seen_.look(view), multipliers, ties);
  }
  void set_broken(std::span<const int> ties) override {
    part_->breakable()->set_broken(ties);
    list();
  }

 protected:
  PartOnNodes(std::unique_ptr<Part> part, std::vector<JointNode> nodes)
      : part_(std::move(part)), seen_(std::move(nodes)) {}
  virtual void list() = 0;  // reads what is whole of it

  std::unique_ptr<Part> part_;
  mutable NodeView seen_;  // constraints, and ties that may break, are asked for on one thread
};

// A force between nodes: evaluated as a whole on one thread before the tiles, and then distributed.
class NodeForce final : public PartOnNodes<Force> {
 public:
  NodeForce(std::unique_ptr<Force> force, std::vector<JointNode> nodes)
      : PartOnNodes(std::move(force), std::move(nodes)),
        layout_(seen_.size(), 3),
        sums_(layout_.size()) {
    for (int k = 0; k < seen_.size(); ++k) {
      const JointNode& node = seen_.nodes()[static_cast<std::size_t>(k)];
      for (std::size_t p = 0; p < static_cast<std::size_t>(node.count); ++p)
        shares_.push_back({node.ids[p], k, node.weights[p]});
    }
    std::ranges::stable_sort(shares_, {}, &Share::particle);
  }

  void bind(const ParticleView& initial) override {
    part_->bind(seen_.look(initial));
    list();
    gathers_ = part_->accumulates();
  }

  void prepare(const ParticleView& view, ThreadPool& pool) override {
    now_ = seen_.look(view);
    std::ranges::fill(sums_.span(), 0.0);
    const ForceSink sink = sink_of(sums_);
    for (const Spring& s : springs_) {
      const Vec3 force = spring_force(part_->springs()->sense(),
                                      now_.position(s.a) - now_.position(s.b), s.k, s.rest);
      sink.add(s.a, force);
      sink.add(s.b, -force);
    }
    part_->prepare(now_, pool);
    if (gathers_) part_->accumulate(now_, all(), sink);
  }

  void accumulate(const ParticleView&, Tile tile, ForceSink sink) const override {
    hand_out(sums_, tile, sink);
  }
  bool depends_on_velocity() const override { return gathers_ && part_->depends_on_velocity(); }

  int internal_size() const override { return part_->internal_size(); }
  void start(std::span<double> memory) const override { part_->start(memory); }
  void derive(const ParticleView& view, std::span<double> rate) const override {
    ParticleView own = now_;
    own.t = view.t, own.internal = view.internal;
    part_->derive(part_->internal_depends_on_particles() ? own : view, rate);
  }
  bool internal_depends_on_particles() const override {
    return part_->internal_depends_on_particles();
  }

  double potential(const ParticleView&, Tile tile) const override {
    return tile.begin == 0 ? part_->potential(now_, all()) : 0;
  }
  bool conservative() const override { return !has_dissipative_part() && part_->conservative(); }
  bool has_dissipative_part() const override {
    return gathers_ && (part_->springs() != nullptr || part_->has_dissipative_part());
  }
  // Called rarely. All that a spring accumulates is its damping.
  void dissipative_part(const ParticleView&, Tile tile, ForceSink sink) const override {
    Array friction(layout_.size());
    if (part_->springs())
      part_->accumulate(now_, all(), sink_of(friction));
    else
      part_->dissipative_part(now_, all(), sink_of(friction));
    hand_out(friction, tile, sink);
  }
  std::vector<std::pair<std::string, long>> families() const override { return part_->families(); }

 private:
  void list() override {
    springs_.clear();
    const Springs* const springs = part_->springs();
    if (!springs) return;
    springs->for_each([&](int a, int b, double k, double rest) {
      springs_.push_back({a, b, k, rest});
    });
  }

  struct Spring {
    int a, b;
    double k, rest;  // N/m, m
  };
  struct Share {
    int particle, node;
    double weight;
  };

  Tile all() const { return {0, seen_.size()}; }
  ForceSink sink_of(Array& sums) const {
    const auto [fx, fy, fz] = layout_.axes(sums.data());
    return {fx, fy, fz};
  }

  void hand_out(const Array& forces, Tile tile, ForceSink sink) const {
    const auto axes = layout_.axes(forces.data());
    auto share = std::ranges::lower_bound(shares_, tile.begin, {}, &Share::particle);
    for (; share != shares_.end() && share->particle < tile.end; ++share)
      sink.add(share->particle, share->weight * Vec3(axes[0][share->node], axes[1][share->node],
                                                     axes[2][share->node]));
  }

  ParticleView now_;
  Layout layout_;
  Array sums_;
  std::vector<Spring> springs_;
  std::vector<Share> shares_;  // by particle
  bool gathers_ = true;
};

class NodeConstraint final : public PartOnNodes<Constraint> {
 public:
  NodeConstraint(std::unique_ptr<Constraint> constraint, std::vector<JointNode> nodes)
      : PartOnNodes(std::move(constraint), std::move(nodes)) {}

  void bind(const ParticleView& initial) override {
    part_->bind(seen_.look(initial));
    list();
  }

  RowPattern pattern() const override { return pattern_; }

  void evaluate(const ParticleView& view, const Rows& rows) const override {
    part_->evaluate(seen_.look(view), {rows.phi, gradient_.data(), rows.drive, rows.bias});
    std::fill_n(rows.gradient, pattern_.ids.size(), Vec3());
    for (const Share& share : shares_)
      rows.gradient[at(share.slot)] += share.weight * gradient_[at(share.entry)];
  }

  bool moves() const override { return part_->moves(); }
  int internal_size() const override { return part_->internal_size(); }
  void start(std::span<double> memory) const override { part_->start(memory); }
  void follow(const ParticleView& view, std::span<double> memory) const override {
    part_->follow(seen_.look(view), memory);
  }
  std::string name(int row) const override { return part_->name(row) + " of its points"; }
  std::string complaint() const override { return part_->complaint(); }
  std::string note() const override { return part_->note(); }

 private:
  void list() override {
    own_ = part_->pattern();
    pattern_ = {};
    shares_.clear();
    gradient_.resize(own_.ids.size());
    // Each row joins a particle once, through however many nodes.
    for (int r = 0; r < own_.rows(); ++r) {
      const auto first = pattern_.ids.size();
      for (int e = own_.begin[at(r)]; e < own_.begin[at(r + 1)]; ++e) {
        const JointNode& node = seen_.nodes()[at(own_.ids[at(e)])];
        for (std::size_t p = 0; p < static_cast<std::size_t>(node.count); ++p) {
          auto place = std::find(pattern_.ids.begin() + static_cast<std::ptrdiff_t>(first),
                                 pattern_.ids.end(), node.ids[p]);
          const auto slot = static_cast<int>(place - pattern_.ids.begin());
          if (place == pattern_.ids.end()) pattern_.ids.push_back(node.ids[p]);
          shares_.push_back({e, slot, node.weights[p]});
        }
      }
      pattern_.begin.push_back(static_cast<int>(pattern_.ids.size()));
    }
  }

  struct Share {
    int entry, slot;  // of the rows on nodes, and of those on particles
    double weight;
  };
  static std::size_t at(int i) { return static_cast<std::size_t>(i); }

  mutable std::vector<Vec3> gradient_;
  RowPattern own_, pattern_;
  std::vector<Share> shares_;
};

}  // namespace

std::unique_ptr<Force> force_on_nodes(std::unique_ptr<Force> force, std::vector<JointNode> nodes) {
  return std::make_unique<NodeForce>(std::move(force), std::move(nodes));
}

std::unique_ptr<Constraint> constraint_on_nodes(std::unique_ptr<Constraint> constraint,
                                                std::vector<JointNode> nodes) {
  return std::make_unique<NodeConstraint>(std::move(constraint), std::move(nodes));
}

}  // namespace sim
