#include "fem_forces.h"

#include <cmath>

#include "core/base/error.h"
#include "core/geometry/cells.h"
#include "core/geometry/incidence.h"
#include "core/particles/elements/element_couplings.h"

namespace sim {
namespace {

constexpr int kSide = 8;  // cells of a block

// True if the volumes at all its points have one sign and exceed rounding.
bool has_volume(std::span<const int> ids, const PlaceOf& at) {
  double longest = 0;
  for (const int id : ids) longest = std::max(longest, (at(id) - at(ids[0])).norm());
  const double least = 1e-12 * longest * longest * longest;
  int signs = 0;
  const int points = cell_points(static_cast<int>(ids.size()));
  for (int point = 0; point < points; ++point) {
    const double weight = cell_point(ids, at, point).weight;
    signs += weight > least ? 1 : weight < -least ? -1 : 0;
  }
  return std::abs(signs) == points;
}

}  // namespace

FemForces::FemForces(const ConstitutiveLaw& law, std::vector<int> ids, int nodes)
    : law_(law), ids_(std::move(ids)), nodes_(nodes), points_(cell_points(nodes)) {}

void FemForces::bind(const ParticleView& initial) {
  const auto at = [&](int id) { return initial.position(id); };
  const auto arity = static_cast<std::size_t>(nodes_), columns = 3 * (arity - 1) + 1;
  const auto points = static_cast<std::size_t>(points_);
  const auto cells = static_cast<std::size_t>(cell_count());
  const std::size_t blocks = (cells + kSide - 1) / kSide;
  block_ids_.resize(blocks * arity * kSide);
  rest_ = Array(blocks * points * columns * kSide);
  forces_ = Array(blocks * arity * 3 * kSide);
  const Incidence incidence(initial.n, ids_);
  begin_ = incidence.begin(), end_ = incidence.end();
  packed_ = Array(4 * static_cast<std::size_t>(end_ - begin_));
  for (std::size_t slot = 0; slot < blocks * kSide; ++slot) {
    const std::size_t cell = std::min(slot, cells - 1), block = slot / kSide, lane = slot % kSide;
    const std::span<const int> own = std::span(ids_).subspan(cell * arity, arity);
    if (slot == cell && !has_volume(own, at))
      throw Error(ErrorKind::kScene,
                  {"bad tetrahedron " + std::to_string(cell + 1), "",
                   "where its particles start it is flat, or its edges turn it inside out",
                   "its particles are those of a body at rest"});
    for (std::size_t node = 0; node < arity; ++node)
      block_ids_[(block * arity + node) * kSide + lane] = own[node] - begin_;
    for (std::size_t p = 0; p < points; ++p) {
      const CellPoint point = cell_point(own, at, static_cast<int>(p));
      double* const out = rest_.data() + (block * points + p) * columns * kSide + lane;
      out[0] = std::fabs(point.weight);
      for (std::size_t node = 1; node < arity; ++node)
        for (std::size_t axis = 0; axis < 3; ++axis)
          out[(1 + 3 * (node - 1) + axis) * kSide] = point.gradient[node][axis];
    }
  }

  first_ = {0};
  cells_first_ = {0};
  places_.clear();
  cells_of_.clear();
  for (int i = begin_; i < end_; ++i) {
    for (const int place : incidence.at(i)) {
      const auto cell = static_cast<std::size_t>(place) / arity,
                 node = static_cast<std::size_t>(place) % arity;
      places_.push_back(((cell / kSide * arity + node) * 3) * kSide + cell % kSide);
      if (node == 0) cells_of_.push_back(static_cast<int>(cell));
    }
    first_.push_back(places_.size());
    cells_first_.push_back(static_cast<int>(cells_of_.size()));
  }
}

void FemForces::prepare(const ParticleView& view, ThreadPool& pool) {
  if (ids_.empty()) return;
  double* const packed = packed_.data();
  pool.run_parts(end_ - begin_, kSide, [&](int begin, int end) {
    for (std::ptrdiff_t i = begin; i < end; ++i) {
      packed[4 * i] = view.x[begin_ + i];
      packed[4 * i + 1] = view.y[begin_ + i];
      packed[4 * i + 2] = view.z[begin_ + i];
    }
  });
  pool.run_parts((cell_count() + kSide - 1) / kSide, 1, [&](int begin, int end) {
    kernels_.evaluate(law_, blocks(), forces_.data(), begin, end);
  });
}

void FemForces::add(Tile tile, ForceSink sink) const {
  if (ids_.empty()) return;
  const int end = std::min(tile.end, end_);
  for (int i = std::max(tile.begin, begin_); i < end; ++i) {
    Vec3 sum = Vec3::Zero();
    const auto at = static_cast<std::size_t>(i - begin_);
    for (std::size_t place = first_[at]; place < first_[at + 1]; ++place) {
      const double* const force = forces_.data() + places_[place];
      sum += Vec3(force[0], force[kSide], force[2 * kSide]);
    }
    sink.add(i, sum);
  }
}

FemCells FemForces::blocks() const {
  return {nodes_, packed_.data(), block_ids_.data(), rest_.data()};
}

const double* FemForces::rest(int cell, int point) const {
  const auto columns = static_cast<std::size_t>(3 * nodes_ - 2);
  const auto block = static_cast<std::size_t>(cell / kSide * points_ + point);
  return rest_.data() + block * columns * kSide + cell % kSide;
}

Vec3 FemForces::gradient(int cell, int point, int node) const {
  const double* const from = rest(cell, point) + (1 + 3 * (node - 1)) * kSide;
  return {from[0], from[kSide], from[2 * kSide]};
}

// F = sum of (x_a - x_0) grad N_a^T, for the gradients add up to 0.
Mat3 FemForces::deformation(const ParticleView& view, int cell, int point) const {
  const int* const ids = ids_.data() + cell * nodes_;
  const Vec3 first = view.position(ids[0]);
  Mat3 F;
  for (int node = 1; node < nodes_; ++node)
    F += outer(view.position(ids[node]) - first, gradient(cell, point, node));
  return F;
}

double FemForces::potential(Tile tile) const {
  if (ids_.empty()) return 0;
  const auto cells_before = [&](int particle) {
    return cells_first_[static_cast<std::size_t>(std::clamp(particle, begin_, end_) - begin_)];
  };
  const int begin = cells_before(tile.begin), end = cells_before(tile.end);
  return kernels_.energy(law_, blocks(), cells_of_.data() + begin, end - begin);
}

// df_a/dx_b = -sum over the points of w (dP/dF : (. grad N_b^T)) grad N_a.
void FemForces::couplings(std::vector<std::array<int, 2>>& pairs) const {
  add_element_couplings(ids_, nodes_, pairs);
}

void FemForces::jacobian(const ParticleView& view, JacobianSink& sink) const {
  for (int cell = 0; cell < cell_count(); ++cell) {
    Mat3 blocks[10][10];  // [a][b] for a >= b: the others are their transposes
    for (int point = 0; point < points_; ++point) {
      Vec3 g[10];
      for (int node = 1; node < nodes_; ++node) {
        g[node] = gradient(cell, point, node);
        g[0] -= g[node];
      }
      // dP is linear in dF: nine entries of F make all of it.
      const StressSlope slope(law_, deformation(view, cell, point));
      Mat3 dP[3][3];  // [row][column] of dF
      for (std::size_t row = 0; row < 3; ++row)
        for (std::size_t column = 0; column < 3; ++column) {
          Mat3 dF;
          dF(row, column) = 1;
          dP[row][column] = slope.along(dF);
        }
      const double w = weight(cell, point);
      for (int b = 0; b < nodes_; ++b)
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const Mat3 along =
              -w * (g[b][0] * dP[axis][0] + g[b][1] * dP[axis][1] + g[b][2] * dP[axis][2]);
          for (int a = b; a < nodes_; ++a) {
            const Vec3 df = along * g[a];
            for (std::size_t row = 0; row < 3; ++row) blocks[a][b](row, axis) += df[row];
          }
        }
    }
    const int* const ids = ids_.data() + cell * nodes_;
    for (int a = 0; a < nodes_; ++a)
      for (int b = 0; b < nodes_; ++b)
        sink.position(ids[a], ids[b], a >= b ? blocks[a][b] : transposed(blocks[b][a]));
  }
}

}  // namespace sim
