// Colliders as a scene adds them and turns them on and off.
#include <algorithm>

#include "core/base/error.h"
#include "core/base/text.h"
#include "core/particles/contacts.h"

namespace sim {

void Contacts::add(std::unique_ptr<Collider> collider, const std::string& name,
                   const ParticleView& initial, int count) {
  if (!work_sums_) work_sums_ = std::make_unique<ContactWorkSums>(initial.n);
  auto sides = collider->sides();
  if (sides.empty())
    sides.push_back(std::move(collider));
  else
    bodies_.push_back({std::move(collider), parts_});
  for (auto& side : sides) {
    add_one(std::move(side), name, initial, count);
    turn_on(*entries_.back().collider);
  }
  ++parts_;
}

void Contacts::set_off(std::span<const std::size_t> colliders) {
  off_.assign(colliders.begin(), colliders.end());
  on_.clear();
  sampled_ = move_ = false;
  for (const Entry& entry : entries_)
    if (!std::ranges::binary_search(colliders, entry.part)) turn_on(*entry.collider);
}

void Contacts::turn_on(Collider& collider) {
  on_.push_back(&collider);
  sampled_ = sampled_ || collider.sampled();
  move_ = move_ || collider.moves();
}

void Contacts::add_one(std::unique_ptr<Collider> collider, const std::string& name,
                       const ParticleView& initial, int count) {
  const std::string title = "collider '" + name + "'";
  collider->bind(initial);
  if (collider->sampled()) collider->prepare_interval(initial.t, initial.t);
  int held = 0;
  for (int i = 0; i < count; ++i) {
    const SurfaceSample start = collider->query(initial.t, initial.position(i));
    if (start.gap >= -slack(initial.position(i))) continue;
    if (!initial.free(i)) {
      if (held++ == 0)
        notes_.push_back("particle " + std::to_string(i) + " is inside " + title +
                         ", where it stays, for it is pinned");
      continue;
    }
    throw Error(ErrorKind::kScene, {title, "",
                                    "particle " + std::to_string(i) + " starts " +
                                        brief(-start.gap, 3) + " m inside of it",
                                    "move the particle out, or pin it"});
  }
  if (held > 1) notes_.back() += "; " + std::to_string(held) + " such particles";
  if (const std::string note = collider->note(); !note.empty())
    notes_.push_back(title + ": " + note);
  entries_.push_back({std::move(collider), parts_});
}

void Contacts::prepare_interval(double t0, double t1) const {
  for (Collider* const collider : on_)
    if (collider->sampled()) collider->prepare_interval(t0, t1);
  for (const Entry& body : bodies_)
    if (body.collider->sampled()) body.collider->prepare_interval(t0, t1);
}

std::vector<RenderShape> Contacts::shapes(double t) const {
  std::vector<RenderShape> list;
  for (std::size_t part = 0; part < parts_; ++part) {
    if (std::ranges::count(off_, part) > 0) continue;
    for (const auto* entries : {&bodies_, &entries_})
      for (const Entry& entry : *entries)
        if (entry.part == part)
          if (const RenderShape shape = entry.collider->shape(t);
              shape.form != RenderShape::Form::kNone)
            list.push_back(shape);
  }
  return list;
}

}  // namespace sim
