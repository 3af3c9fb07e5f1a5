// Pairs of parts of surfaces whose boxes meet, against a loop over all parts.
#include "plugins/contact/surfaces/triangle_bvh.h"

#include <algorithm>
#include <catch2/catch.hpp>
#include <random>
#include <tuple>

using namespace sim;

namespace {

using Pair = std::tuple<int, std::array<int, 4>>;  // kind, ids in one order

Pair pair_of(PairKind kind, std::array<int, 4> ids) {
  if (kind == PairKind::kVertexTriangle) {
    std::sort(ids.begin() + 1, ids.end());
    return {0, ids};
  }
  if (ids[0] > ids[1]) std::swap(ids[0], ids[1]);
  if (ids[2] > ids[3]) std::swap(ids[2], ids[3]);
  if (ids[0] > ids[2] || (ids[0] == ids[2] && ids[1] > ids[3]))
    std::swap(ids[0], ids[2]), std::swap(ids[1], ids[3]);
  return {1, ids};
}

bool overlap(const Aabb& a, const Aabb& b) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    if (a.most[axis] < b.least[axis] || b.most[axis] < a.least[axis]) return false;
  return true;
}

struct Surfaces {
  int n = 0;
  std::vector<std::shared_ptr<const TriangleMesh>> meshes;
  std::vector<Vec3> places;

  // Sheets of rows x columns particles on random folds, one beside the other.
  Surfaces(const std::vector<std::array<int, 2>>& sheets, std::mt19937& random) {
    for (const auto& [rows, cols] : sheets) n += rows * cols;
    std::uniform_real_distribution<double> uniform(-1, 1);
    int first = 0;
    for (const auto& [rows, cols] : sheets) {
      auto triangles = grid_triangles({rows, cols, 1}, false);
      for (auto& triangle : triangles)
        for (int& id : triangle) id += first;
      meshes.push_back(std::make_shared<const TriangleMesh>(n, triangles));
      for (int i = 0; i < rows * cols; ++i)
        places.push_back({0.5 * (i / cols) + 0.3 * uniform(random),
                          0.5 * (i % cols) + 0.3 * uniform(random), 0.5 * uniform(random)});
      first += rows * cols;
    }
  }
};

Aabb box_of(const std::vector<Aabb>& boxes, std::initializer_list<int> ids) {
  Aabb box = boxes[static_cast<std::size_t>(*ids.begin())];
  for (const int id : ids)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const Aabb& other = boxes[static_cast<std::size_t>(id)];
      box.least[axis] = std::min(box.least[axis], other.least[axis]);
      box.most[axis] = std::max(box.most[axis], other.most[axis]);
    }
  return box;
}

// The pairs of parts that share no particle, whose boxes and whose triangles' boxes meet.
std::vector<Pair> all_pairs(const Surfaces& surfaces, bool self, const std::vector<Aabb>& boxes,
                            std::span<const std::array<int, 2>> torn) {
  struct Triangle {
    std::array<int, 3> ids;
    std::size_t surface;
  };
  const auto is_torn = [&](int a, int b) {
    return std::ranges::count(torn, std::array<int, 2>{std::min(a, b), std::max(a, b)}) > 0;
  };
  std::vector<Triangle> triangles;  // that are there
  std::vector<std::pair<int, std::size_t>> vertices;
  std::vector<std::pair<std::array<int, 2>, std::size_t>> edges;
  for (std::size_t s = 0; s < surfaces.meshes.size(); ++s) {
    for (const auto& t : surfaces.meshes[s]->triangles()) {
      for (const int id : t) vertices.emplace_back(id, s);
      if (is_torn(t[0], t[1]) || is_torn(t[1], t[2]) || is_torn(t[2], t[0])) continue;
      triangles.push_back({t, s});
      for (std::size_t k = 0; k < 3; ++k) {
        const int a = t[k], b = t[(k + 1) % 3];
        edges.push_back({{std::min(a, b), std::max(a, b)}, s});
      }
    }
  }
  for (auto* list : {&edges}) {
    std::ranges::sort(*list);
    list->erase(std::unique(list->begin(), list->end()), list->end());
  }
  std::ranges::sort(vertices);
  vertices.erase(std::unique(vertices.begin(), vertices.end()), vertices.end());
  std::vector<Pair> found;
  for (const auto& [v, s] : vertices)
    for (const Triangle& t : triangles)
      if ((self || s != t.surface) && std::ranges::count(t.ids, v) == 0 &&
          overlap(boxes[static_cast<std::size_t>(v)],
                  box_of(boxes, {t.ids[0], t.ids[1], t.ids[2]})))
        found.push_back(pair_of(PairKind::kVertexTriangle, {v, t.ids[0], t.ids[1], t.ids[2]}));
  for (std::size_t e = 0; e < edges.size(); ++e)
    for (std::size_t f = e + 1; f < edges.size(); ++f) {
      const auto& [p, q] = edges[e].first;
      const auto& [r, u] = edges[f].first;
      if ((!self && edges[e].second == edges[f].second) || p == r || p == u || q == r || q == u)
        continue;
      if (overlap(box_of(boxes, {p, q}), box_of(boxes, {r, u})))
        found.push_back(pair_of(PairKind::kEdgeEdge, {p, q, r, u}));
    }
  std::ranges::sort(found);
  return found;
}

}  // namespace

TEST_CASE("the pairs of a tree of boxes are those of a loop over all parts, each once") {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> uniform(0, 1);
  ThreadPool one(1), three(3);
  std::size_t most = 0, least = SIZE_MAX;
  // From two triangles on, so that leaves have 1 to 4 of them and trees every shape.
  for (const std::vector<std::array<int, 2>>& sheets :
       std::vector<std::vector<std::array<int, 2>>>{{},
                                                    {{2, 2}},
                                                    {{2, 3}},
                                                    {{2, 4}},
                                                    {{3, 3}},
                                                    {{2, 6}},
                                                    {{4, 4}},
                                                    {{2, 2}, {2, 2}},
                                                    {{3, 3}, {2, 5}},
                                                    {{6, 7}},
                                                    {{4, 5}, {5, 4}, {2, 3}},
                                                    {{15, 16}}})
    for (const bool self : {true, false})
      for (const double size : {0.0, 0.02, 0.3}) {
        const Surfaces surfaces(sheets, random);
        TriangleBvh tree(surfaces.meshes, self, surfaces.places);
        // The particles have moved since the tree was built.
        std::vector<Aabb> boxes;
        for (const Vec3& place : surfaces.places) {
          const Vec3 at = place + 0.2 * Vec3(uniform(random), uniform(random), uniform(random));
          const Vec3 half = size * Vec3(uniform(random), uniform(random), uniform(random));
          boxes.push_back({at - half, at + half});
        }
        std::vector<std::array<int, 2>> torn;
        for (const bool tear : {false, true}) {
          if (tear) {
            if (sheets.empty()) continue;
            for (const auto& edge : surfaces.meshes[0]->edges())
              if (uniform(random) < 0.2)
                torn.push_back(
                    {std::min(edge.ends[0], edge.ends[1]), std::max(edge.ends[0], edge.ends[1])});
            std::ranges::sort(torn);
            tree.tear(torn);
          }
          INFO(sheets.size() << " sheets of " << surfaces.n << ", self " << self << ", boxes of "
                             << size << ", torn " << torn.size());
          const std::vector<Pair> expected = all_pairs(surfaces, self, boxes, torn);
          std::vector<SurfacePair> pairs, again;
          tree.find_pairs(boxes, one, pairs);
          tree.find_pairs(boxes, three, again);
          CHECK(std::ranges::equal(pairs, again, [](const SurfacePair& a, const SurfacePair& b) {
            return a.ids == b.ids && a.kind == b.kind;
          }));
          std::vector<Pair> found;
          for (const SurfacePair& pair : pairs) found.push_back(pair_of(pair.kind, pair.ids));
          std::ranges::sort(found);
          CHECK(found == expected);
          most = std::max(most, found.size());
          least = std::min(least, found.size());
        }
      }
  CHECK(least == 0);
  CHECK(most > 1000);
}

TEST_CASE("boxes that touch meet, in every direction, and no others do") {
  const Aabb box{{0, 0, 0}, {1, 2, 4}};
  const double sides[] = {1, 2, 4};
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (const double shift : {-1.0, 1.0})
      for (const double more : {0.0, 1e-12}) {
        Aabb other = box;
        other.least[axis] += shift * (sides[axis] + more);
        other.most[axis] += shift * (sides[axis] + more);
        CHECK(box.meets(other) == (more == 0));
        CHECK(other.meets(box) == (more == 0));
      }
}
