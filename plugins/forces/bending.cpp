// Bending of a surface across its edges, with an energy that is quadratic in the positions.
//
// Two triangles meet at an edge e of length |e| with the angle theta. For a shape that differs from
// the flat one by bending alone the vector
//   K_e x = (c03 + c04) x0 + (c01 + c02) x1 - (c01 + c03) x2 - (c02 + c04) x3
// is |e| theta long and stands on the surface; x0 and x1 are the ends of the edge, x2 and x3 the
// corners across it, c01, c02 the cotangents at x0 and c03, c04 those at x1 in the triangles of x2
// and x3 (Bergou et al. 2006). The curvature of a triangle of area A is the sum over its edges
//   L = sum of K_e x / (2 A) n_e n_e^T,  n_e in its plane, across the edge
// (Grinspun et al. 2006), exact for quadratic surfaces on regular lattices, and the energy is
//   U = k/2 sum of A |L|^2, about k/2 times the integral of kappa_1^2 + kappa_2^2.
#include <algorithm>
#include <array>

#include "core/geometry/triangle_mesh.h"
#include "core/particles/elements/torn_faces.h"
#include "core/plugin/plugin.h"

namespace {

// A triangle and the three corners across its edges; a missing one is replaced by the first corner
// of the triangle with coefficients 0. Its energy is k/2 sum over m of |sum over i of coef[m][i]
// x_i|^2, with m the components L_uu, L_vv and sqrt(2) L_uv in its plane.
struct Patch {
  std::array<int, 6> ids;
  std::array<std::array<double, 6>, 3> coef{};

  sim::Vec3 component(std::size_t m, const sim::ParticleView& p) const {
    const sim::Vec3 origin = p.position(ids[0]);
    sim::Vec3 sum = sim::Vec3::Zero();
    for (std::size_t i = 1; i < 6; ++i) sum += coef[m][i] * (p.position(ids[i]) - origin);
    return sum;
  }
};

// cot of the angle at `corner` of a triangle.
double cot(const sim::Vec3& corner, const sim::Vec3& a, const sim::Vec3& b) {
  const sim::Vec3 u = a - corner, v = b - corner;
  return u.dot(v) / u.cross(v).norm();
}

// The coefficients of K_e for the edge from x[0] to x[1] with x[2] and x[3] across it.
std::array<double, 4> edge_operator(const std::array<sim::Vec3, 4>& x) {
  const double c01 = cot(x[0], x[1], x[2]), c02 = cot(x[0], x[1], x[3]);
  const double c03 = cot(x[1], x[0], x[2]), c04 = cot(x[1], x[0], x[3]);
  return {c03 + c04, c01 + c02, -c01 - c03, -c02 - c04};
}

struct Places {
  int first = 0;                // particle
  std::vector<sim::Vec3> list;  // m
};

const sim::Vec3& at(const Places& p, int i) {
  return p.list[static_cast<std::size_t>(i - p.first)];
}

// far[c]: the particle across the edge from corner c to the next one; -1 if there is none.
Patch patch_of(const sim::TriangleMesh::Triangle& triangle, const std::array<int, 3>& far,
               const Places& p) {
  Patch patch;
  std::array<sim::Vec3, 3> x;
  for (std::size_t c = 0; c < 3; ++c) {
    patch.ids[c] = triangle[c];
    patch.ids[3 + c] = far[c] < 0 ? triangle[0] : far[c];
    x[c] = at(p, triangle[c]);
  }
  const sim::Vec3 u = (x[1] - x[0]).normalized(), normal = (x[1] - x[0]).cross(x[2] - x[0]);
  const sim::Vec3 v = normal.normalized().cross(u);
  const double scale = 1 / std::sqrt(2 * normal.norm());  // sqrt(A) / (2 A)
  for (std::size_t c = 0; c < 3; ++c) {
    if (far[c] < 0) continue;
    const std::size_t next = (c + 1) % 3, last = (c + 2) % 3;
    const std::array<double, 4> k = edge_operator({x[c], x[next], x[last], at(p, far[c])});
    const sim::Vec3 along = (x[next] - x[c]).normalized();
    const double nu = along.dot(v), nv = -along.dot(u);
    const double shares[3] = {nu * nu, nv * nv, std::sqrt(2.0) * nu * nv};
    for (std::size_t m = 0; m < 3; ++m) {
      const double share = scale * shares[m];
      patch.coef[m][c] += share * k[0];
      patch.coef[m][next] += share * k[1];
      patch.coef[m][last] += share * k[2];
      patch.coef[m][3 + c] += share * k[3];
    }
  }
  return patch;
}

// Faces that are torn do not bend, nor do others across an edge to them.
std::vector<Patch> patches_of(const sim::TriangleMesh& surface, const Places& p,
                              sim::TornPairs torn) {
  const auto triangles = surface.triangles();
  std::vector<std::array<int, 3>> far(triangles.size(), {-1, -1, -1});
  for (const sim::TriangleMesh::Edge& edge : surface.edges()) {
    if (edge.boundary()) continue;
    const auto gone = [&](int t) {
      return sim::torn_face(torn, triangles[static_cast<std::size_t>(t)]);
    };
    if (gone(edge.triangles[0]) || gone(edge.triangles[1])) continue;
    for (std::size_t side = 0; side < 2; ++side) {
      const auto t = static_cast<std::size_t>(edge.triangles[side]);
      const auto at = std::ranges::find(triangles[t], edge.ends[side]) - triangles[t].begin();
      far[t][static_cast<std::size_t>(at)] = edge.opposite[1 - side];
    }
  }
  std::vector<Patch> patches;
  for (std::size_t t = 0; t < triangles.size(); ++t)
    patches.push_back(patch_of(triangles[t], far[t], p));
  return patches;
}

class Bending final : public sim::Force {
 public:
  explicit Bending(const sim::Params& params)
      : surface_(params.surface("surface")), stiffness_(params.number("stiffness")) {}

  void bind(const sim::ParticleView& initial) override {
    start_ = {surface_->corners().begin(), {}};
    for (int i = start_.first; i < surface_->corners().end(); ++i)
      start_.list.push_back(initial.position(i));
    make_rows({});
    for (int i = start_.first; i < surface_->corners().end(); ++i)
      for (const Entry& entry : row(i))
        if (i < entry.j) couplings_.push_back({i, entry.j});
  }

  void tear(sim::TornPairs torn) override {
    if (!torn.empty() || torn_) make_rows(torn);
    torn_ = !torn.empty();
  }

  // The rows of Q add up to 0, so that -k sum of Q_ij x_j = k sum of Q_ij (x_i - x_j).
  void accumulate(const sim::ParticleView& p, sim::Tile tile, sim::ForceSink sink) const override {
    const auto [begin, end] = surface_->corners().within(tile.begin, tile.end);
    for (int i = begin; i < end; ++i) {
      const sim::Vec3 x = p.position(i);
      sim::Vec3 sum = sim::Vec3::Zero();
      for (const Entry& entry : row(i)) sum += entry.value * (x - p.position(entry.j));
      sink.add(i, sum);
    }
  }

  bool depends_on_velocity() const override { return false; }
  bool conservative() const override { return true; }

  bool has_jacobian() const override { return true; }

  void jacobian(const sim::ParticleView& p, sim::JacobianSink& sink) const override {
    for (int i = start_.first; i < surface_->corners().end(); ++i) {
      double diagonal = 0;
      for (const Entry& entry : row(i)) {
        sink.position(i, entry.j, -entry.value * sim::Mat3::Identity());
        diagonal += entry.value;
      }
      if (!row(i).empty()) sink.position(i, i, diagonal * sim::Mat3::Identity());
    }
  }

  bool couplings(std::vector<std::array<int, 2>>& pairs) const override {
    pairs.insert(pairs.end(), couplings_.begin(), couplings_.end());
    return true;
  }

  // Summed patch by patch, for the sum over Q would be a small difference of large numbers.
  double potential(const sim::ParticleView& p, sim::Tile tile) const override {
    double sum = 0;
    const auto [begin, end] = surface_->corners().within(tile.begin, tile.end);
    for (int i = begin; i < end; ++i)
      for (const int corner : surface_->corners(i)) {
        if (corner % 3 != 0) continue;
        const Patch& patch = patches_[static_cast<std::size_t>(corner / 3)];
        for (std::size_t m = 0; m < 3; ++m) sum += patch.component(m, p).squaredNorm();
      }
    return 0.5 * stiffness_ * sum;
  }

 private:
  struct Entry {
    int j;
    double value;  // k Q_ij, N/m
  };

  // The sum over the patches is U = k/2 x^T Q x with a matrix Q that is constant until a tear.
  void make_rows(sim::TornPairs torn) {
    patches_ = patches_of(*surface_, start_, torn);
    std::vector<int> ids;
    for (const Patch& patch : patches_) ids.insert(ids.end(), patch.ids.begin(), patch.ids.end());
    const sim::Incidence patches_at(surface_->particles(), ids);
    entries_.clear();
    rows_ = {0};
    for (int i = start_.first; i < surface_->corners().end(); ++i) {
      add_row(i, patches_at.at(i));
      rows_.push_back(entries_.size());
    }
  }

  // Appends the row of particle i, from its positions among the ids of all patches.
  void add_row(int i, std::span<const int> places) {
    std::vector<Entry> row;
    for (const int place : places) {
      const Patch& patch = patches_[static_cast<std::size_t>(place / 6)];
      const auto at = static_cast<std::size_t>(place % 6);
      for (std::size_t other = 0; other < 6; ++other) {
        if (patch.ids[other] == i) continue;
        double q = 0;
        for (const auto& coef : patch.coef) q += coef[at] * coef[other];
        row.push_back({patch.ids[other], stiffness_ * q});
      }
    }
    std::ranges::stable_sort(row, {}, &Entry::j);
    const std::size_t begin = entries_.size();
    for (const Entry& entry : row)
      if (entries_.size() > begin && entries_.back().j == entry.j)
        entries_.back().value += entry.value;
      else
        entries_.push_back(entry);
  }

  std::span<const Entry> row(int i) const {
    const auto at = static_cast<std::size_t>(i - start_.first);
    return {entries_.data() + rows_[at], rows_[at + 1] - rows_[at]};
  }

  std::shared_ptr<const sim::TriangleMesh> surface_;
  double stiffness_;
  Places start_;
  std::vector<std::array<int, 2>> couplings_;  // of the whole surface
  bool torn_ = false;
  std::vector<Patch> patches_;     // one a triangle
  std::vector<std::size_t> rows_;  // entries of start_.first + i: [rows_[i], rows_[i + 1])
  std::vector<Entry> entries_;     // off the diagonal, each row ascending
};

}  // namespace

SIM_PLUGIN(Force, "bending") {
  using sim::ParamType;
  registrar.add(sim::ForcePlugin{
      {.name = "bending",
       .summary = "resistance of a surface to bending, towards the plane",
       .formula =
           "U = k/2 x^T Q x, about k/2 times the integral of kappa_1^2 + kappa_2^2 over the\n"
           "surface, with its principal curvatures;  f = -k Q x\n"
           "Q from the angles and areas at the start: for surfaces that hardly stretch",
       .source =
           "Bergou, Wardetzky, Harmon, Zorin & Grinspun (2006), A quadratic bending model for "
           "inextensible surfaces; Grinspun, Gingold, Reisman & Zorin (2006), Computing "
           "discrete shape operators on general meshes",
       .params = {{.name = "surface",
                   .type = ParamType::kSurface,
                   .doc = "the surface; its boundary edges do not bend",
                   .required = true},
                  {.name = "stiffness",
                   .unit = "N m",
                   .doc = "k, the flexural rigidity",
                   .required = true,
                   .min = 0}}},
      [](const sim::Params& params, const sim::Elements&) {
        return std::make_unique<Bending>(params);
      }});
}
