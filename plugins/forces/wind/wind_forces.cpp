#include "wind_forces.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>

#include "core/particles/elements/torn_faces.h"

namespace sim {
namespace {

// A run is worth its arrays if this share of the particles begins a triangle of it.
constexpr std::size_t kShare = 8;

constexpr std::size_t kPadding = 16;

}  // namespace

// With N = (b - a) x (c - a) = 2 A n, q = N.N, s = w.N, w_t = w - s N / q:
//   quadratic  F = normal |s| s / (2 q) N + tangential sqrt(q) / 2 |w_t| w_t
//   linear     F = normal s / (2 sqrt(q)) N + tangential sqrt(q) / 2 w_t
WindOnTriangle wind_on_triangle(const WindLaw& law, const AirNow& air, const std::array<Vec3, 3>& x,
                                const std::array<Vec3, 3>& v) {
  WindOnTriangle result{Vec3(0, 0, 0), {Mat3::Zero(), Mat3::Zero(), Mat3::Zero()}, Mat3::Zero()};
  Mat3 slope = Mat3::Zero();
  const Vec3 w =
      air.velocity((1.0 / 3) * (x[0] + x[1] + x[2]), &slope) - (1.0 / 3) * (v[0] + v[1] + v[2]);
  const Vec3 u1 = x[1] - x[0], u2 = x[2] - x[0], N = u1.cross(u2);
  const double q = N.dot(N), s = w.dot(N), root = std::sqrt(q);
  if (!(q > 0)) return result;
  const Vec3 across = w - (s / q) * N;
  const Mat3 one = Mat3::Identity();

  Mat3 by_w, by_N;  // of F
  Vec3 force;
  const Mat3 flat = one - (1 / q) * outer(N, N);
  const Mat3 across_by_N =
      -1.0 * ((1 / q) * outer(N, w) + (s / q) * one - (2 * s / (q * q)) * outer(N, N));
  if (law.linear) {
    const double a = 0.5 * law.normal / root, b = 0.5 * law.tangential * root;
    force = a * s * N + b * across;
    by_w = a * outer(N, N) + b * flat;
    by_N = a * (outer(N, w) + s * one - (s / q) * outer(N, N)) +
           (0.5 * law.tangential / root) * outer(across, N) + b * across_by_N;
  } else {
    const double a = 0.5 * law.normal * std::fabs(s) / q, speed = across.norm();
    const double b = 0.5 * law.tangential * root;
    force = a * s * N + b * speed * across;
    Mat3 drag = speed * one;
    if (speed > 0) drag += (1 / speed) * outer(across, across);
    by_w = 2 * a * outer(N, N) + b * (drag * flat);
    by_N = a * (2 * outer(N, w) + s * one - (2 * s / q) * outer(N, N)) +
           (0.5 * law.tangential * speed / root) * outer(across, N) + b * (drag * across_by_N);
  }

  constexpr double kThird = 1.0 / 3;
  result.force = kThird * force;
  result.by_velocity = -kThird * kThird * by_w;
  const Mat3 by_b = -1.0 * (by_N * cross_matrix(u2));
  const Mat3 by_c = by_N * cross_matrix(u1);
  const Mat3 by_place = kThird * (by_w * slope);
  result.by_position = {kThird * (by_place - by_b - by_c), kThird * (by_place + by_b),
                        kThird * (by_place + by_c)};
  return result;
}

WindSweep::WindSweep(const WindLaw& law, const Air& air, std::span<const TriangleRun> runs)
    : law_(law), air_(&air) {
  std::vector<std::int64_t> entries;
  std::size_t total = 0;
  for (const TriangleRun& run : runs) {
    const std::int64_t furthest = std::max(run.b, run.c);
    reach_ = std::max(reach_, static_cast<int>(furthest));
    entries.push_back(static_cast<std::int64_t>(
        std::bit_ceil(static_cast<std::uint64_t>(furthest + kWindChunk))));
    total += 3 * static_cast<std::size_t>(entries.back() + kWindBlock);
  }
  memory_ = Array(total);
  double* next = memory_.data();
  for (std::size_t i = 0; i < runs.size(); ++i) {
    TriangleRing& ring = rings_.emplace_back(
        TriangleRing{runs[i].b, runs[i].c, entries[i] - 1, runs[i].bits.data(), {}});
    for (double*& axis : ring.third) {
      axis = next;
      next += entries[i] + kWindBlock;
    }
  }
}

void WindSweep::start(const ParticleView& view, int begin) {
  now_ = air_->at(view.t);
  std::ranges::fill(memory_.span(), 0.0);
  const int before = std::max(0, begin - (reach_ + kWindBlock - 1) / kWindBlock * kWindBlock);
  turn_ = begin - before;
  kernels_.sweep(law_, now_, view, rings_, 0, {before, begin}, {nullptr, nullptr, nullptr});
}

void WindSweep::add(const ParticleView& view, Tile tile, ForceSink sink) {
  kernels_.sweep(law_, now_, view, rings_, turn_, tile, sink);
  turn_ += tile.end - tile.begin;
}

WindForces::WindForces(const WindLaw& law, const Air& air, const TriangleMesh& surface)
    : law_(law),
      air_(&air),
      stride_((static_cast<std::size_t>(surface.particles()) + kWindBlock - 1) / kWindBlock *
              kWindBlock) {
  const auto n = static_cast<std::size_t>(surface.particles());
  // Each triangle begins at its lowest corner, which preserves its orientation.
  std::map<std::array<int, 2>, std::vector<TriangleMesh::Triangle>> by_stride;
  for (TriangleMesh::Triangle triangle : surface.triangles()) {
    std::rotate(triangle.begin(), std::ranges::min_element(triangle), triangle.end());
    const auto [a, b, c] = triangle;
    by_stride[{b - a, c - a}].push_back(triangle);
  }
  for (const auto& [strides, triangles] : by_stride) {
    std::vector<std::uint8_t> bits((n + 7) / 8 + 2);
    bool fits = kShare * triangles.size() >= n;
    for (const auto& triangle : triangles) {
      std::uint8_t& entry = bits[static_cast<std::size_t>(triangle[0] / 8)];
      const auto bit = static_cast<std::uint8_t>(1 << triangle[0] % 8);
      fits = fits && !(entry & bit);  // the same triangle twice
      entry |= bit;
    }
    if (fits)
      runs_.push_back({strides[0], strides[1], std::move(bits)});
    else
      for (const auto& triangle : triangles)
        loose_.insert(loose_.end(), triangle.begin(), triangle.end());
  }
  if (!runs_.empty()) sums_ = Array(3 * stride_);
  at_ = Incidence(surface.particles(), loose_);
  loose_stride_ = loose_.size() / 3 + kPadding;
  loose_thirds_ = Array(3 * loose_stride_);
}

void WindForces::tear(TornPairs torn) {
  for (std::size_t r = 0; r < runs_.size(); ++r) {
    TriangleRun& run = runs_[r];
    if (whole_.size() == r) whole_.push_back(run.bits);
    std::ranges::copy(whole_[r], run.bits.begin());
    for (std::size_t a = 0; a < 8 * run.bits.size(); ++a) {
      const auto bit = static_cast<std::uint8_t>(1 << a % 8);
      const int id = static_cast<int>(a);
      if ((run.bits[a / 8] & bit) &&
          torn_face(torn, {id, id + static_cast<int>(run.b), id + static_cast<int>(run.c)}))
        run.bits[a / 8] &= static_cast<std::uint8_t>(~bit);
    }
  }
  loose_gone_.assign(loose_.size() / 3, 0);
  for (std::size_t t = 0; t < loose_gone_.size(); ++t)
    loose_gone_[t] = torn_face(torn, {loose_[3 * t], loose_[3 * t + 1], loose_[3 * t + 2]});
}

std::unique_ptr<ForceSweep> WindForces::sweep() const {
  if (!loose_.empty()) return nullptr;
  return std::make_unique<WindSweep>(law_, *air_, runs_);
}

void WindForces::prepare(const ParticleView& view, ThreadPool& pool) {
  if (!runs_.empty()) {
    while (static_cast<int>(sweeps_.size()) < pool.most()) sweeps_.emplace_back(law_, *air_, runs_);
    double* const sums = sums_.data();
    pool.run([&](int rank) {
      const Part part = part_of(view.n, kWindBlock, rank, pool.size());
      for (double* sum : {sums, sums + stride_, sums + 2 * stride_})
        std::fill(sum + part.begin, sum + part.end, 0.0);
      WindSweep& sweep = sweeps_[static_cast<std::size_t>(rank)];
      sweep.start(view, part.begin);
      sweep.add(view, {part.begin, part.end}, {sums, sums + stride_, sums + 2 * stride_});
    });
  }
  if (loose_.empty()) return;
  const AirNow air = air_->at(view.t);
  pool.run_parts(static_cast<int>(loose_.size() / 3), 8, [&](int begin, int end) {
    kernels_.any(law_, air, view, loose_.data(), begin, end, loose_thirds_.data(), loose_stride_);
  });
}

void WindForces::add(Tile tile, ForceSink sink) const {
  const double* const sum = sums_.data();
  for (int i = tile.begin; i < tile.end && !runs_.empty(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    sink.add(i, {sum[at], sum[stride_ + at], sum[2 * stride_ + at]});
  }
  if (loose_.empty()) return;
  const double* const third = loose_thirds_.data();
  const auto [begin, end] = at_.within(tile.begin, tile.end);
  for (int i = begin; i < end; ++i)
    for (const int place : at_.at(i)) {
      const auto at = static_cast<std::size_t>(place / 3);
      if (!loose_gone_.empty() && loose_gone_[at]) continue;
      sink.add(i, {third[at], third[loose_stride_ + at], third[2 * loose_stride_ + at]});
    }
}

}  // namespace sim
