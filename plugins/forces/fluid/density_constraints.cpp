#include "density_constraints.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

std::size_t as_size(std::ptrdiff_t i) { return static_cast<std::size_t>(i); }

}  // namespace

void DensityConstraints::bind(const FluidLaw& law, const ParticleView& initial) {
  law_ = law;
  neighbours_ = Neighbours(2 * law_.smoothing, kFluidSkin * law_.smoothing);
  mirrors_.bind(initial, fluid_spacing(law_.volume, law_.dimensions));
}

void DensityConstraints::make(const ParticleView& view, ThreadPool& pool) {
  neighbours_.update(view, pool);
  const int count = static_cast<int>(neighbours_.blocks().size());
  if (rows_.empty()) {
    rows_.resize(as_size(count));
    densities_ = Array(8 * as_size(count));
    wall_rates_ = Array(8 * as_size(count));
    mirrors_.reserve(as_size(count));
  }
  while (std::ssize(shares_) < pool.most()) shares_.emplace_back();
  mirrors_.look(view.t);
  if (mirrors_.count() > 0)
    pool.run_parts(8 * count, 8, [&](int begin, int end) {
      mirrors_.find(view.t, neighbours_.points(), view.n, kFluidSeen * law_.smoothing, begin / 8,
                    end / 8);
    });
  // The gaps of neighbours to a wall are needed, too.
  pool.run([&](int rank) {
    const Part part = part_of(8 * count, 8, rank, pool.size());
    make_rows(part.begin / 8, part.end / 8, view.t, shares_[as_size(rank)]);
  });
}

void DensityConstraints::make_rows(int begin, int end, double t, Share& share) {
  for (auto* const list : {&share.slots, &share.image_slots}) list->clear();
  for (auto* const list : {&share.slopes, &share.weights, &share.images}) list->clear();
  for (int b = begin; b < end; ++b) {
    add_pairs(b, share);
    add_images(b, t, share);
  }
  std::ptrdiff_t pairs = 0, images = 0;
  for (int b = begin; b < end; ++b) {
    DensityConstraintRow& row = rows_[as_size(b)];
    row.slots = share.slots.data() + 8 * pairs;
    row.slopes = share.slopes.data() + 24 * pairs;
    row.weights = share.weights.empty() ? nullptr : share.weights.data() + 8 * pairs;
    row.image_slots = share.image_slots.data() + 8 * images;
    row.images = share.images.data() + 48 * images;
    pairs += row.length;
    images += row.image_length;
  }
}

// Lists reach slightly beyond the smoothing radius; rows leave out the pairs beyond it.
void DensityConstraints::add_pairs(int b, Share& share) {
  const NeighbourBlock& list = neighbours_.blocks()[as_size(b)];
  const bool viscous = law_.viscosity > 0;
  share.all.resize(24 * as_size(list.length));
  share.all_weights.resize(viscous ? 8 * as_size(list.length) : 0);
  kernels_.slopes(law_, list, neighbours_.points(), b, densities_.data() + 8 * b, share.all.data(),
                  viscous ? share.all_weights.data() : nullptr);
  const std::size_t first = share.slots.size();
  share.slots.resize(first + 8 * as_size(list.length));
  share.slopes.resize(3 * first + 24 * as_size(list.length));
  if (viscous) share.weights.resize(first + 8 * as_size(list.length));
  std::int32_t* const slots = share.slots.data() + first;
  float* const slopes = share.slopes.data() + 3 * first;
  float* const weights = viscous ? share.weights.data() + first : nullptr;
  int counts[8] = {}, length = 0;
  for (int lane = 0; lane < 8; ++lane) {
    int count = 0;
    for (std::int32_t k = 0; k < list.count[lane]; ++k) {
      const float* const from = share.all.data() + 24 * k + lane;
      float* const to = slopes + 24 * count + lane;
      slots[8 * count + lane] = list.slots[8 * k + lane];
      for (int axis = 0; axis < 24; axis += 8) to[axis] = from[axis];
      if (viscous) weights[8 * count + lane] = share.all_weights[as_size(8 * k + lane)];
      count += (from[0] != 0) | (from[8] != 0) | (from[16] != 0);
    }
    counts[lane] = count;
    length = std::max(length, count);
  }
  for (int lane = 0; lane < 8; ++lane)
    for (int k = counts[lane]; k < length; ++k) {
      slots[8 * k + lane] = 8 * b + lane;
      for (int axis = 0; axis < 24; axis += 8) slopes[24 * k + axis + lane] = 0;
      if (viscous) weights[8 * k + lane] = 0;
    }
  rows_[as_size(b)].length = length;
  share.slots.resize(first + 8 * as_size(length));
  share.slopes.resize(3 * first + 24 * as_size(length));
  if (viscous) share.weights.resize(first + 8 * as_size(length));
}

void DensityConstraints::add_images(int b, double t, Share& share) {
  rows_[as_size(b)].image_length = 0;
  for (int lane = 0; lane < 8; ++lane) wall_rates_.data()[8 * b + lane] = 0;
  if (mirrors_.count() == 0 || mirrors_.near()[b] == 0) return;
  const std::size_t first = share.image_slots.size();
  int length = 0;
  for (int lane = 0; lane < 8; ++lane) {
    find_images(8 * b + lane, b, t, share);
    const int count = static_cast<int>(share.lane_slots.size());
    if (count > length) {
      share.image_slots.resize(first + 8 * as_size(count));
      share.images.resize(6 * first + 48 * as_size(count), 0);
      for (int k = length; k < count; ++k)
        for (int other = 0; other < 8; ++other)
          share.image_slots[first + 8 * as_size(k) + as_size(other)] = 8 * b + other;
      length = count;
    }
    for (int k = 0; k < count; ++k) {
      share.image_slots[first + as_size(8 * k + lane)] = share.lane_slots[as_size(k)];
      for (int c = 0; c < 6; ++c)
        share.images[6 * first + as_size(48 * k + 8 * c + lane)] =
            share.lane_images[as_size(6 * k + c)];
    }
  }
  rows_[as_size(b)].image_length = length;
}

namespace {

// A wall as seen from one of two particles.
struct WallSide {
  double gap;
  Vec3 normal;
};

Vec3 three_at(const double* numbers, std::ptrdiff_t p) {
  return {numbers[4 * p], numbers[4 * p + 1], numbers[4 * p + 2]};
}

}  // namespace

// With the gaps g_i and g_j to walls, an image is at r^2 + 4 sum of g_i g_j, and with s = -5
// scale/h^2 u^3 there
//   dn_i = s/2 d(r^2 + 4 sum of g_i g_j) = s (d + 2 sum g_j n_i).w_i - s (d - 2 sum g_i n_j).w_j
// less 2 s sum of (g_j n_i.u_i + g_i n_j.u_j) for walls with velocities u.
void DensityConstraints::find_images(int place, int b, double t, Share& share) {
  share.lane_slots.clear();
  share.lane_images.clear();
  const double hh = law_.smoothing * law_.smoothing, limit = 4 * hh;
  int walls[MirrorBoundary::kMost], count = 0;
  WallSide own[MirrorBoundary::kMost], others[MirrorBoundary::kMost];
  for (int wall = 0; wall < mirrors_.count(); ++wall) {
    if (!(mirrors_.near()[b] >> wall & 1)) continue;
    const double* const seen = mirrors_.seen(wall);
    if (!(seen[4 * place + 3] < 2 * law_.smoothing)) continue;
    own[count] = {seen[4 * place + 3], three_at(seen, place)};
    walls[count++] = wall;
  }
  if (count == 0) return;
  const Vec3 here = three_at(neighbours_.points(), place);
  double density = 0, wall_rate = 0;
  const auto add = [&](int other, double rr, const Vec3& d, std::initializer_list<int> of) {
    const double q = std::sqrt(std::max(rr, 0.0)) / law_.smoothing, u = 1 - 0.5 * q;
    if (u <= 0) return;
    const double cube = u * u * u, s = -5 * law_.scale / hh * cube;
    density += cube * u * (2 * q + 1);
    Vec3 own_way = d, displacement = d;
    for (const int k : of) {
      own_way += 2 * others[k].gap * own[k].normal;
      displacement -= 2 * own[k].gap * others[k].normal;
      if (mirrors_.move())
        wall_rate -=
            2 * s *
            (others[k].gap * mirrors_.speed(walls[k], t, here, own[k].normal) +
             own[k].gap * mirrors_.speed(walls[k], t, three_at(neighbours_.points(), other),
                                         others[k].normal));
    }
    share.lane_slots.push_back(other);
    for (const Vec3& slope : {s * own_way, -s * displacement})
      for (std::size_t axis = 0; axis < 3; ++axis)
        share.lane_images.push_back(static_cast<float>(slope[axis]));
  };
  // In one wall, in two that meet, and in three.
  const auto add_all = [&](int other, double rr, const Vec3& d) {
    for (int k = 0; k < count; ++k) {
      const double* const seen = mirrors_.seen(walls[k]);
      if (mirrors_.planes() >> walls[k] & 1)
        others[k] = {own[k].gap - own[k].normal.dot(d), own[k].normal};
      else
        others[k] = {seen[4 * other + 3], three_at(seen, other)};
    }
    const auto product = [&](int k) { return 4 * (own[k].gap * others[k].gap); };
    for (int i = 0; i < count; ++i) {
      const double one = rr + product(i);
      if (!(one < limit)) continue;
      add(other, one, d, {i});
      for (int j = i + 1; j < count; ++j) {
        const double two = one + product(j);
        if (!(two < limit)) continue;
        add(other, two, d, {i, j});
        for (int k = j + 1; k < count; ++k)
          if (const double three = two + product(k); three < limit) add(other, three, d, {i, j, k});
      }
    }
  };
  const NeighbourBlock& list = neighbours_.blocks()[as_size(b)];
  const int lane = place % 8;
  for (std::int32_t k = 0; k < list.count[lane]; ++k) {
    const int other = list.slots[8 * k + lane];
    const Vec3 d = here - three_at(neighbours_.points(), other);
    if (const double rr = d.squaredNorm(); rr < limit) add_all(other, rr, d);
  }
  add_all(place, 0, {});
  densities_.data()[place] += law_.scale * density;
  wall_rates_.data()[place] = wall_rate;
}

void DensityConstraints::push(const double* p, double* pressure_forces, ThreadPool& pool) const {
  pool.run_parts(places(), 8, [&](int begin, int end) {
    kernels_.pressure_forces(rows_.data(), p, begin / 8, end / 8, pressure_forces);
  });
}

void DensityConstraints::rate(const double* displacements, double* rates, ThreadPool& pool) const {
  pool.run_parts(places(), 8, [&](int begin, int end) {
    kernels_.rates(rows_.data(), displacements, begin / 8, end / 8, rates);
  });
}

void DensityConstraints::apply_viscosity(const double* velocities, double* viscous_forces,
                                         ThreadPool& pool) const {
  pool.run_parts(places(), 8, [&](int begin, int end) {
    kernels_.viscous_forces(rows_.data(), velocities, begin / 8, end / 8, viscous_forces);
  });
}

}  // namespace sim
