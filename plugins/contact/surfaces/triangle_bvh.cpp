#include "triangle_bvh.h"

#include <algorithm>
#include <numeric>

#include "core/particles/elements/torn_faces.h"

namespace sim {
namespace {

constexpr int kLeaf = 4;        // triangles
constexpr int kTaskDepth = 12;  // levels of pairs of nodes above the tasks of threads

Aabb joined(Aabb a, const Aabb& b) {
  a.add(b);
  return a;
}

bool among(int id, const TriangleMesh::Triangle& t) {
  return id == t[0] || id == t[1] || id == t[2];
}

}  // namespace

bool BodyElements::are_tied(int body, std::span<const int> ids) const {
  return !tied.empty() && std::ranges::any_of(ids, [&](int id) {
    return tied.contains({body, id});
  });
}

TriangleBvh::TriangleBvh(std::span<const std::shared_ptr<const TriangleMesh>> surfaces, bool self,
                         std::span<const Vec3> start, BodyElements bodies)
    : self_(self), bodies_(std::move(bodies)) {
  std::vector<std::uint8_t> has_owner(start.size());
  for (std::size_t s = 0; s < surfaces.size(); ++s) {
    const auto first = triangles_.size();
    for (const TriangleMesh::Triangle& t : surfaces[s]->triangles())
      own(t, static_cast<int>(s), has_owner);
    for (const TriangleMesh::Edge& edge : surfaces[s]->edges()) {
      auto& mine = owned_[first + slot(edge.triangles[0])].edges;
      *std::ranges::find(mine, -1) = static_cast<int>(edges_.size());
      edges_.push_back(edge.ends);
    }
  }
  particles_ = vertices_.size();
  std::set<std::array<int, 2>> known;
  for (std::size_t k = 0; k < bodies_.triangles.size(); ++k) {
    const TriangleMesh::Triangle& t = bodies_.triangles[k];
    own(t, -1 - bodies_.body_of[k], has_owner);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto [low, high] = std::minmax(t[c], t[(c + 1) % 3]);
      if (low == high || !known.insert({low, high}).second) continue;
      owned_.back().edges[c] = static_cast<int>(edges_.size());
      edges_.push_back({low, high});
    }
  }
  std::ranges::sort(vertices_);
  std::vector<Vec3> middles;
  for (const auto& [a, b, c] : triangles_)
    middles.push_back(start[slot(a)] + start[slot(b)] + start[slot(c)]);
  order_.resize(triangles_.size());
  std::iota(order_.begin(), order_.end(), 0);
  triangle_boxes_.resize(triangles_.size());
  if (triangles_.empty()) return;
  build(0, static_cast<int>(order_.size()), middles);
  split_tasks(0, 0, 0);
}

// A triangle owns those of its vertices that none before it has.
void TriangleBvh::own(TriangleMesh::Triangle t, int surface, std::vector<std::uint8_t>& has_owner) {
  triangles_.push_back(t);
  surface_of_.push_back(surface);
  Owned& mine = owned_.emplace_back();
  for (std::size_t k = 0; k < 3; ++k)
    if (!has_owner[slot(t[k])]) {
      has_owner[slot(t[k])] = 1;
      mine.vertices[k] = t[k];
      vertices_.push_back(t[k]);
    }
}

bool TriangleBvh::touch(int a, int b) const {
  const int s = surface_of_[slot(a)], t = surface_of_[slot(b)];
  return s < 0 ? t >= 0 : self_ || s != t;
}

// Splits at the median along the longest side of the box of the centroids; ties by number.
int TriangleBvh::build(int begin, int end, std::span<const Vec3> middles) {
  const int node = static_cast<int>(nodes_.size());
  nodes_.push_back({{}, begin, end - begin <= kLeaf ? end - begin : 0, -1});
  if (end - begin <= kLeaf) return node;
  Aabb box{middles[slot(order_[slot(begin)])], middles[slot(order_[slot(begin)])]};
  for (int i = begin; i < end; ++i)
    box.add({middles[slot(order_[slot(i)])], middles[slot(order_[slot(i)])]});
  const Vec3 sides = box.most - box.least;
  const std::size_t axis = sides.x() >= sides.y() && sides.x() >= sides.z() ? 0
                           : sides.y() >= sides.z()                         ? 1
                                                                            : 2;
  const int middle = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](int a, int b) {
                     const double left = middles[slot(a)][axis], right = middles[slot(b)][axis];
                     return left != right ? left < right : a < b;
                   });
  std::sort(order_.begin() + begin, order_.begin() + middle);
  std::sort(order_.begin() + middle, order_.begin() + end);
  build(begin, middle, middles);
  const int second = build(middle, end, middles);
  nodes_[slot(node)].second = second;
  return node;
}

// Splits without testing boxes, so that tasks and their order depend on the tree alone.
void TriangleBvh::split_tasks(int a, int b, int depth) {
  const Node &left = nodes_[slot(a)], &right = nodes_[slot(b)];
  if (depth >= kTaskDepth || (left.count > 0 && right.count > 0)) {
    tasks_.push_back({a, b, {}});
  } else if (a == b) {
    split_tasks(a + 1, a + 1, depth + 2);
    split_tasks(a + 1, left.second, depth + 2);
    split_tasks(left.second, left.second, depth + 2);
  } else if (right.count > 0 || (left.count == 0 && depth % 2 == 0)) {
    split_tasks(a + 1, b, depth + 1);
    split_tasks(left.second, b, depth + 1);
  } else {
    split_tasks(a, b + 1, depth + 1);
    split_tasks(a, right.second, depth + 1);
  }
}

void TriangleBvh::refit(std::span<const Aabb> boxes) {
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const auto& [a, b, c] = triangles_[t];
    triangle_boxes_[t] = joined(joined(boxes[slot(a)], boxes[slot(b)]), boxes[slot(c)]);
  }
  for (std::size_t i = nodes_.size(); i-- > 0;) {
    Node& node = nodes_[i];
    if (node.count == 0) {
      node.box = joined(nodes_[i + 1].box, nodes_[slot(node.second)].box);
      continue;
    }
    node.box = triangle_boxes_[slot(order_[slot(node.first)])];
    for (int k = 1; k < node.count; ++k)
      node.box.add(triangle_boxes_[slot(order_[slot(node.first + k)])]);
  }
}

void TriangleBvh::find_pairs(std::span<const Aabb> boxes, ThreadPool& pool,
                             std::vector<SurfacePair>& pairs) {
  pairs.clear();
  refit(boxes);
  pool.run([&](int rank) {
    for (std::size_t i = slot(rank); i < tasks_.size(); i += slot(pool.size())) {
      tasks_[i].found.clear();
      walk(tasks_[i].a, tasks_[i].b, boxes, tasks_[i].found);
    }
  });
  for (const Task& task : tasks_) pairs.insert(pairs.end(), task.found.begin(), task.found.end());
}

void TriangleBvh::walk(int a, int b, std::span<const Aabb> boxes,
                       std::vector<SurfacePair>& found) const {
  const Node &left = nodes_[slot(a)], &right = nodes_[slot(b)];
  if (!left.box.meets(right.box)) return;
  if (left.count > 0 && right.count > 0) {
    leaves(left, right, boxes, found);
  } else if (a == b) {
    walk(a + 1, a + 1, boxes, found);
    walk(a + 1, left.second, boxes, found);
    walk(left.second, left.second, boxes, found);
  } else if (left.count == 0 && right.count == 0) {
    walk(a + 1, b + 1, boxes, found);
    walk(a + 1, right.second, boxes, found);
    walk(left.second, b + 1, boxes, found);
    walk(left.second, right.second, boxes, found);
  } else if (left.count == 0) {
    walk(a + 1, b, boxes, found);
    walk(left.second, b, boxes, found);
  } else {
    walk(a, b + 1, boxes, found);
    walk(a, right.second, boxes, found);
  }
}

void TriangleBvh::leaves(const Node& a, const Node& b, std::span<const Aabb> boxes,
                         std::vector<SurfacePair>& found) const {
  for (int i = a.first; i < a.first + a.count; ++i) {
    const int t = order_[slot(i)];
    const Aabb& box = triangle_boxes_[slot(t)];
    if (!box.meets(b.box)) continue;
    for (int j = &a == &b ? i + 1 : b.first; j < b.first + b.count; ++j) {
      const int u = order_[slot(j)];
      if (!touch(t, u)) continue;
      if (box.meets(triangle_boxes_[slot(u)])) triangle_pairs(t, u, boxes, found);
    }
  }
}

void TriangleBvh::tear(TornPairs torn) { gone_ = torn_parts(torn, triangles_, edges_); }

void TriangleBvh::triangle_pairs(int a, int b, std::span<const Aabb> boxes,
                                 std::vector<SurfacePair>& found) const {
  const int body = -1 - std::min(surface_of_[slot(a)], surface_of_[slot(b)]);
  const auto add = [&](const SurfacePair& pair) {
    if (body < 0 || !bodies_.are_tied(body, pair.ids)) found.push_back(pair);
  };
  const auto vertices_at = [&](int of, int other) {
    if (triangle_gone(slot(other))) return;
    const TriangleMesh::Triangle& t = triangles_[slot(other)];
    if (t[0] == t[1]) return;  // an edge or a vertex of a body
    for (const int v : owned_[slot(of)].vertices)
      if (v >= 0 && !among(v, t) && boxes[slot(v)].meets(triangle_boxes_[slot(other)]))
        add({{v, t[0], t[1], t[2]}, PairKind::kVertexTriangle});
  };
  vertices_at(a, b);
  vertices_at(b, a);
  for (const int e : owned_[slot(a)].edges) {
    if (e < 0 || edge_gone(slot(e))) continue;
    const auto [p, q] = edges_[slot(e)];
    const Aabb box = joined(boxes[slot(p)], boxes[slot(q)]);
    if (!box.meets(triangle_boxes_[slot(b)])) continue;
    for (const int f : owned_[slot(b)].edges) {
      if (f < 0 || edge_gone(slot(f))) continue;
      const auto [r, s] = edges_[slot(f)];
      if (p == r || p == s || q == r || q == s) continue;
      if (box.meets(joined(boxes[slot(r)], boxes[slot(s)])))
        add({{p, q, r, s}, PairKind::kEdgeEdge});
    }
  }
}

}  // namespace sim
