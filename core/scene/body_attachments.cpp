#include "core/scene/body_attachments.h"

#include <algorithm>
#include <map>

#include "core/base/error.h"

namespace sim {
namespace {

bool names_points(const Elements& of, const SystemSpec& spec, int n) {
  const int points = static_cast<int>(spec.points.size());
  return points > 0 &&
         std::ranges::any_of(of.ids, [&](int id) { return id >= n && id - n < points; });
}

}  // namespace

BodyAttachments::BodyAttachments(const Elements& of, const SystemSpec& spec,
                                 std::span<const RigidBody> bodies, int n)
    : own(names_points(of, spec, n) ? of : Elements()), elements(own.empty() ? of : own), count(n) {
  if (own.empty()) return;
  const int points = static_cast<int>(spec.points.size());
  if (!of.grids.empty() || of.cells)
    throw Error(ErrorKind::kScene, {"points of bodies", "", "they are not joined by grids or cells",
                                    "make a part of its own for them"});
  std::map<int, int> known;
  for (int& id : own.ids) {
    const auto [node, is_new] = known.emplace(id, static_cast<int>(nodes.size()));
    if (is_new && id < n) {
      nodes.push_back({1, {id}, {1}});
    } else if (is_new) {
      if (id - n >= points)
        throw Error(ErrorKind::kScene, {"a point of a body", "", "it does not exist", ""});
      const BodyPoint& point = spec.points[static_cast<std::size_t>(id - n)];
      const RigidBody& body = bodies[static_cast<std::size_t>(point.body)];
      const int a = body.first();
      nodes.push_back({4, {a, a + 1, a + 2, a + 3}, body.weights(point.at)});
    }
    id = node->second;
  }
  own.carried.clear();  // which nodes have not
  count = static_cast<int>(nodes.size());
}

}  // namespace sim
