#include "core/picture/trail.h"

#include <algorithm>
#include <cmath>

#include "core/base/error.h"
#include "core/picture/scenery.h"
#include "core/scene/simulation.h"

namespace sim {
namespace {

constexpr int kPerBody = 4;            // particles
constexpr std::size_t kFewEnough = 8;  // free particles of a system whose last one leaves a trail
constexpr double kBend = 0.07;         // rad, of a path from point to point

bool has(const Model& model, const Look::Trail& wish) {
  return wish.id <
         (wish.body ? static_cast<int>(model.in_bodies.size()) / kPerBody : model.particles);
}

double angle(const Vec3& a, const Vec3& b) { return std::atan2(a.cross(b).norm(), a.dot(b)); }

// The cubic between two states h apart (Hermite), at the share s of it.
Vec3 between(const Vec3& x0, const Vec3& v0, const Vec3& x1, const Vec3& v1, double h, double s) {
  const double r = 1 - s;
  return r * r * ((1 + 2 * s) * x0 + s * h * v0) + s * s * ((1 + 2 * r) * x1 - r * h * v1);
}

}  // namespace

std::vector<Trail> trails_of(const Model& model, const Look& look) {
  std::vector<Trail> trails;
  for (std::size_t k = 0; k < look.trails.size(); ++k) {
    const Look::Trail& wish = look.trails[k];
    if (!has(model, wish)) continue;
    ModelPoint point{1, {wish.id}, {1}};
    if (wish.body) {
      const auto first = static_cast<std::size_t>(kPerBody * wish.id);
      point = {kPerBody, {}, {0.25, 0.25, 0.25, 0.25}};
      for (std::size_t p = 0; p < kPerBody; ++p) point.ids[p] = model.in_bodies[first + p];
    }
    trails.push_back({point, family_colour(k)});
  }
  return trails;
}

void check_trails(std::span<const Model> models, const Look& look) {
  for (const Look::Trail& wish : look.trails) {
    if (std::ranges::any_of(models, [&](const Model& model) { return has(model, wish); })) continue;
    std::size_t most = 0;
    for (const Model& model : models)
      most = std::max(most, wish.body ? model.in_bodies.size() / kPerBody
                                      : static_cast<std::size_t>(model.particles));
    const std::string what = wish.body ? "body" : "particle";
    throw Error(ErrorKind::kUsage,
                {"nothing to show",
                 "--trail " + std::string(wish.body ? "body:" : "") + std::to_string(wish.id),
                 "the scene has no " + what + " of that number",
                 most == 0 ? "it has none at all"
                           : "they are numbered from 0 to " + std::to_string(most - 1)});
  }
}

int own_trail(const Model& model, const Look& look) {
  if (look.own_trails || !model.triangles.empty() || !model.in_bodies.empty() ||
      static_cast<std::size_t>(model.particles) - model.pinned.size() > kFewEnough)
    return -1;
  int last = model.particles - 1;
  while (last >= 0 && std::ranges::binary_search(model.pinned, last)) --last;
  return last;
}

TrailRecorder::TrailRecorder(const Model& model, const Look& look)
    : trails_(trails_of(model, look)), second_order_(model.second_order) {}

TrailRecorder::State TrailRecorder::look_at(const Simulation& system,
                                            const ModelPoint& point) const {
  State now{{0, 0, 0}, {0, 0, 0}};
  if (system.flat()) {
    const Frame frame = take_frame(system);  // its first numbers as a point
    now.x = frame.at(point.ids[0]);
    return now;
  }
  for (std::size_t k = 0; k < static_cast<std::size_t>(point.count); ++k) {
    now.x += point.weights[k] * system.position(point.ids[k]);
    if (second_order_) now.v += point.weights[k] * system.velocity(point.ids[k]);
  }
  return now;
}

// A path goes straight on while it keeps the direction in which it left the last point that stays.
const std::vector<std::vector<TrailRecorder::Point>>& TrailRecorder::follow(
    const Simulation& system) {
  constexpr int kMostParts = 32;
  points_.resize(trails_.size());
  const bool begins = before_.empty();
  const double h = system.t() - t_;
  t_ = system.t();
  if (begins) before_.resize(trails_.size());
  for (std::size_t k = 0; k < trails_.size(); ++k) {
    State now = look_at(system, trails_[k].point);
    State& before = before_[k];
    points_[k].clear();
    if (begins) {
      before = now;
      points_[k].push_back({now.x, false});
      continue;
    }
    int parts = 1;
    if (second_order_ && h > 0)
      parts =
          std::clamp(static_cast<int>(std::ceil(angle(before.v, now.v) / kBend)), 1, kMostParts);
    Vec3 last = before.x, direction = before.direction;
    for (int part = 1; part <= parts; ++part) {
      const Vec3 next = part == parts ? now.x
                                      : between(before.x, before.v, now.x, now.v, h,
                                                static_cast<double>(part) / parts);
      const Vec3 step = next - last;
      if (step.squaredNorm() > 0) {
        const bool goes_on = direction.squaredNorm() > 0 && angle(direction, step) < kBend;
        points_[k].push_back({next, goes_on});
        if (!goes_on) direction = step;
      }
      last = next;
    }
    before = now;
    before.direction = direction;
  }
  return points_;
}

}  // namespace sim
