#include "core/picture/viewpoint.h"

#include <algorithm>

#include "core/picture/quantity.h"

namespace sim {
namespace {

constexpr std::size_t kMostPoints = 40000;  // that the eye is fitted to

struct Box {
  Vec3 low{HUGE_VAL, HUGE_VAL, HUGE_VAL}, high{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};

  void include(const Vec3& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  bool empty() const { return !(low.x() <= high.x()); }
  Vec3 middle() const { return 0.5 * (low + high); }
  double size() const { return empty() ? 0 : (high - low).norm(); }
};

// 30 times the size at the start, around its middle.
Reach reach_of(const Model& model, const Moments& moments, std::size_t system) {
  Box start;
  if (moments.empty()) return {};
  Moment room;
  const Frame& first = moments.at(0, room)[system];
  const auto whole = [](const Vec3& p) { return p.allFinite() && p.norm() < 1e100; };
  for (int i = 0; i < model.particles; ++i)
    if (const Vec3 p = first.at(i); whole(p)) start.include(p);
  for (const RenderShape& solid : first.solids)
    if (solid.form != RenderShape::Form::kPlane && solid.form != RenderShape::Form::kNone)
      start.include(solid.center);
  if (start.empty()) return {};
  return {start.middle(), start.size() > 0 ? 30 * start.size() : 1e100};
}

// The four lowest corners of a room: what is in it will flow there, while its walls may be high.
void add_floor(const RenderShape& room, const Vec3& up, std::vector<Vec3>& points) {
  if (room.form != RenderShape::Form::kBox) return;
  std::array<Vec3, 3> half = room.axes;
  std::ranges::sort(half, {}, [&](const Vec3& axis) { return std::abs(axis.dot(up)); });
  const Vec3 down = half[2].dot(up) > 0 ? Vec3(-1 * half[2]) : half[2];
  for (const double u : {-1.0, 1.0})
    for (const double v : {-1.0, 1.0})
      points.push_back(room.center + down + u * half[0] + v * half[1]);
}

// The points of one system that a picture has to show, a cloud in m.
std::vector<Vec3> cloud_of(const Model& model, const Moments& moments, std::size_t system,
                           const Reach& reach, std::size_t most) {
  std::vector<Vec3> points;
  if (reach.radius == 0) return points;
  const std::size_t total = static_cast<std::size_t>(model.particles) * moments.size();
  const std::size_t stride = 1 + total / most;
  std::size_t count = 0;
  Moment room;
  for (std::size_t at = 0; at < moments.size(); ++at) {
    const Frame& frame = moments.at(at, room)[system];
    for (int i = 0; i < model.particles; ++i)
      if (count++ % stride == 0 || at == 0) {
        const Vec3 p = frame.at(i);
        if (reach.holds(p)) points.push_back(p);
      }
    for (const RenderShape& solid : frame.solids) {
      if (solid.inside) {
        add_floor(solid, model.up, points);
        continue;
      }
      if (solid.form == RenderShape::Form::kPlane || solid.form == RenderShape::Form::kNone)
        continue;
      for (const Vec3& axis : solid.axes) {
        const bool round =
            solid.form == RenderShape::Form::kSphere || solid.form == RenderShape::Form::kMesh;
        const double size = round ? solid.radius : axis.norm() + solid.radius;
        const Vec3 d = size / axis.norm() * axis;
        points.push_back(solid.center + d);
        points.push_back(solid.center - d);
      }
    }
  }
  return points;
}

// Sine and cosine of degrees up to 90 by their series: the same bits everywhere.
double tangent(double degrees) {
  const double x = degrees * (3.14159265358979323846 / 180);
  double sine = 0, cosine = 0, term = 1;
  for (int k = 0; k < 30; ++k) {
    (k % 2 ? sine : cosine) += (k / 2) % 2 ? -term : term;
    term *= x / (k + 1);
  }
  return sine / cosine;
}

V3 to_v3(const Vec3& v) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z())};
}

Vec3 unit_of(const Vec3& v) { return v / v.norm(); }

struct Sight {
  Vec3 at, right, up, forward;
};

Sight view_from(const Vec3& at, const Vec3& towards_eye, const Vec3& up) {
  const Vec3 forward = -unit_of(towards_eye);
  Vec3 right = forward.cross(up);
  if (!(right.norm() > 1e-9)) right = forward.cross(Vec3(0.3, 0.5, 0.8));
  right = unit_of(right);
  return {at, right, right.cross(forward), forward};
}

// The nearest place of the eye from which all points are within the picture, moved along its plane
// until they lie in the middle.
double fit(Sight& view, std::span<const Vec3> points, double tan_x, double tan_y) {
  double distance = 0;
  for (int round = 0; round < 6; ++round) {
    distance = 0;
    for (const Vec3& point : points) {
      const Vec3 p = point - view.at;
      const double deep = p.dot(view.forward);
      distance = std::max({distance, std::abs(p.dot(view.right)) / tan_x - deep,
                           std::abs(p.dot(view.up)) / tan_y - deep});
    }
    double left = HUGE_VAL, right = -HUGE_VAL, low = HUGE_VAL, high = -HUGE_VAL;
    for (const Vec3& point : points) {
      const Vec3 p = point - view.at;
      const double z = std::max(1e-6 * distance, distance + p.dot(view.forward));
      left = std::min(left, p.dot(view.right) / z), right = std::max(right, p.dot(view.right) / z);
      low = std::min(low, p.dot(view.up) / z), high = std::max(high, p.dot(view.up) / z);
    }
    view.at += 0.5 * distance * ((left + right) * view.right + (low + high) * view.up);
  }
  return distance;
}

// A horizontal plane that things fall on is the ground.
std::optional<double> floor_of(const Moments& moments, std::size_t systems, const Vec3& up) {
  for (std::size_t m = 0; m < systems; ++m)
    for (const RenderShape& solid : moments.head(0, m).solids)
      if (solid.form == RenderShape::Form::kPlane && solid.axes[1].dot(up) > 0.999999)
        return solid.center.dot(up);
  return {};
}

// A scene of nothing that moves in space, but of numbers: no ground.
bool only_numbers(std::span<const Model> models) {
  return std::ranges::all_of(
      models, [](const Model& model) { return model.flat && std::ranges::min(model.grid) < 2; });
}

}  // namespace

Viewpoint make_viewpoint(std::span<const Model> models, const Moments& moments, const Look& look) {
  Viewpoint viewpoint;
  for (const Model& model : models)
    if (model.second_order) {
      viewpoint.up = model.up;
      break;
    }
  const Vec3 up = viewpoint.up;
  Vec3 along = Vec3(1, 0, 0) - up.x() * up;
  if (!(along.norm() > 0.1)) along = Vec3(0, 0, 1) - up.z() * up;
  along = unit_of(along);
  const Vec3 front = along.cross(up);

  // Side by side, with a quarter of the mean width between them.
  std::vector<Vec3> points;
  Box box;
  double end = 0, gap = 0;
  std::vector<std::vector<Vec3>> clouds;
  std::vector<double> lows, highs;
  for (std::size_t m = 0; m < models.size(); ++m) {
    viewpoint.reaches.push_back(reach_of(models[m], moments, m));
    clouds.push_back(
        cloud_of(models[m], moments, m, viewpoint.reaches.back(), kMostPoints / models.size()));
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (const Vec3& p : clouds.back()) {
      low = std::min(low, p.dot(along)), high = std::max(high, p.dot(along));
    }
    if (clouds.back().empty()) low = high = 0;
    lows.push_back(low), highs.push_back(high);
    gap += 0.25 * (high - low) / static_cast<double>(models.size());
  }
  for (std::size_t m = 0; m < models.size(); ++m) {
    const Vec3 offset = models.size() > 1 ? Vec3((end - lows[m]) * along) : Vec3(0, 0, 0);
    viewpoint.offsets.push_back(offset);
    end += highs[m] - lows[m] + gap;
    for (const Vec3& p : clouds[m]) points.push_back(p + offset), box.include(p + offset);
  }
  if (points.empty()) points.emplace_back(0, 0, 0), box.include(Vec3(0, 0, 0));
  viewpoint.origin = box.middle();
  viewpoint.scale = box.size() > 0 ? 1.6 / box.size() : 1;

  double low = HUGE_VAL;
  for (const Vec3& p : points) low = std::min(low, p.dot(up));
  const auto floor = floor_of(moments, models.size(), up);
  const double ground = look.ground.value_or(floor.value_or(low - 0.16 / viewpoint.scale));
  viewpoint.grid = round_up(0.12 / viewpoint.scale);
  if (!only_numbers(models)) {
    const Vec3 foot = viewpoint.origin + (ground - viewpoint.origin.dot(up)) * up;
    viewpoint.ground = Ground{viewpoint.point(foot),
                              to_v3(along),
                              to_v3(up),
                              to_v3(front),
                              static_cast<float>(viewpoint.grid * viewpoint.scale),
                              9};
  }
  // Numbers are shown in the colours of their scale.
  viewpoint.light = only_numbers(models)
                        ? to_v3(front)
                        : raster::unit(to_v3(0.62 * along + 1.0 * up + 0.62 * front));

  const double tan_y = tangent(0.5 * look.fov),
               tan_x = tan_y * static_cast<double>(look.width) / look.height;
  const Vec3 camera_up = look.up ? unit_of(*look.up) : up;
  const Vec3 usual = only_numbers(models) ? Vec3(0, 0, 1) : Vec3(0.42 * along + 0.30 * up + front);
  const Vec3 towards = look.eye ? Vec3(*look.eye - look.at.value_or(viewpoint.origin)) : usual;
  Sight view = view_from(look.at.value_or(viewpoint.origin), towards.norm() > 0 ? towards : usual,
                         camera_up);
  Vec3 eye = look.eye.value_or(Vec3(0, 0, 0));
  if (!look.eye) {
    const Vec3 at = view.at;
    double distance = fit(view, points, 0.80 * tan_x, 0.76 * tan_y);
    if (look.at) view.at = at;  // the target was given
    distance = std::max(distance, 0.2 / viewpoint.scale);
    eye = view.at - distance * view.forward;
    if (!look.at) eye -= 0.07 * distance * tan_y * view.up;  // room for words above
  }
  viewpoint.eye = {viewpoint.point(eye), to_v3(view.right), to_v3(view.up), to_v3(view.forward),
                   static_cast<float>(1 / tan_y)};
  if (viewpoint.ground)
    viewpoint.ground->fade = 7 + 1.5F * raster::length(viewpoint.eye.at - viewpoint.ground->origin);
  return viewpoint;
}

}  // namespace sim
