#include "core/particles/group.h"

#include <algorithm>

#include "core/particles/force_of_another.h"

namespace sim {
namespace {

// Forwards the Jacobian blocks of the members of a group alone.
class GroupSink final : public JacobianSink {
 public:
  GroupSink(JacobianSink& sink, const std::vector<bool>& member) : sink_(&sink), member_(&member) {}

  void position(int i, int j, const Mat3& block) override {
    if (has(i)) sink_->position(i, j, block);
  }
  void velocity(int i, int j, const Mat3& block) override {
    if (has(i)) sink_->velocity(i, j, block);
  }

 private:
  bool has(int i) const { return (*member_)[static_cast<std::size_t>(i)]; }

  JacobianSink* sink_;
  const std::vector<bool>* member_;
};

class Group final : public ForceOfAnother {
 public:
  Group(std::unique_ptr<Force> force, const std::vector<int>& ids)
      : ForceOfAnother(*force), force_(std::move(force)) {
    for (const int id : ids) {
      if (ranges_.empty() || ranges_.back().end != id) ranges_.push_back({id, id});
      ++ranges_.back().end;
    }
  }

  void bind(const ParticleView& initial) override {
    member_.assign(static_cast<std::size_t>(initial.n), false);
    for (const Tile& range : ranges_)
      std::fill(member_.begin() + range.begin, member_.begin() + range.end, true);
    force_->bind(initial);
    affine_ = force_->affine();
    gathered_ = !affine_ || force_->internal_size() > 0;
  }

  void prepare(const ParticleView& view, ThreadPool& pool) override {
    if (gathered_) force_->prepare(view, pool);
  }

  void accumulate(const ParticleView& view, Tile tile, ForceSink sink) const override {
    for_each_range(tile, [&](Tile part) {
      if (gathered_) force_->accumulate(view, part, sink);
      if (!affine_) return;
      for (int i = part.begin; i < part.end; ++i)
        sink.add(i, view.free_mass(i) * affine_->acceleration);
      if (affine_->damping == 0) return;  // the view may have no velocities
      for (int i = part.begin; i < part.end; ++i) sink.add(i, -affine_->damping * view.velocity(i));
    });
  }

  bool depends_on_velocity() const override {
    return (affine_ && affine_->damping != 0) || (gathered_ && force_->depends_on_velocity());
  }

  bool has_jacobian() const override { return !gathered_ || force_->has_jacobian(); }

  void jacobian(const ParticleView& view, JacobianSink& sink) const override {
    if (gathered_) {
      GroupSink members(sink, member_);
      force_->jacobian(view, members);
    }
    if (!affine_ || affine_->damping == 0) return;
    const Mat3 block = -affine_->damping * Mat3::Identity();
    for (const Tile& range : ranges_)
      for (int i = range.begin; i < range.end; ++i) sink.velocity(i, i, block);
  }

  bool couplings(std::vector<std::array<int, 2>>& pairs) const override {
    return !gathered_ || force_->couplings(pairs);
  }

  double potential(const ParticleView& view, Tile tile) const override {
    double sum = 0;
    for_each_range(tile, [&](Tile part) { sum += force_->potential(view, part); });
    return sum;
  }

 private:
  // Visits the ranges of consecutive members in the tile.
  template <class Visit>
  void for_each_range(Tile tile, const Visit& visit) const {
    auto range = std::upper_bound(ranges_.begin(), ranges_.end(), tile.begin,
                                  [](int begin, const Tile& r) { return begin < r.end; });
    for (; range != ranges_.end() && range->begin < tile.end; ++range)
      visit(Tile{std::max(range->begin, tile.begin), std::min(range->end, tile.end)});
  }

  std::unique_ptr<Force> force_;
  std::optional<AffineForce> affine_;
  bool gathered_ = true;  // it has a part that is not affine
  std::vector<Tile> ranges_;
  std::vector<bool> member_;
};

}  // namespace

std::unique_ptr<Force> make_group(std::unique_ptr<Force> force, const std::vector<int>& ids) {
  return std::make_unique<Group>(std::move(force), ids);
}

}  // namespace sim
