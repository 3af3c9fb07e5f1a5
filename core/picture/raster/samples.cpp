#include "core/picture/raster/samples.h"

#include <algorithm>

namespace sim::raster {
namespace {

constexpr float kGuard = 8192;  // pixels around the picture in which corners may lie

float smaller(float a, float b) { return a < b ? a : b; }
float larger(float a, float b) { return a > b ? a : b; }

// The part of a polygon where n.p >= offset; corners in `in`, written to `out`.
int clip(const V3* in, int count, const V3& n, float offset, V3* out) {
  int kept = 0;
  for (int i = 0; i < count; ++i) {
    const V3 &a = in[i], &b = in[(i + 1) % count];
    const float da = dot(n, a) - offset, db = dot(n, b) - offset;
    if (da >= 0) out[kept++] = a;
    if ((da >= 0) != (db >= 0)) out[kept++] = mix(a, b, da / (da - db));
  }
  return kept;
}

}  // namespace

int to_int(float v, int least, int most) {
  if (!(v > static_cast<float>(least))) return least;
  if (v >= static_cast<float>(most)) return most;
  return static_cast<int>(v);
}

void Rect::include(const Rect& other) {
  if (other.empty()) return;
  if (empty()) {
    *this = other;
    return;
  }
  left = std::min(left, other.left);
  top = std::min(top, other.top);
  right = std::max(right, other.right);
  bottom = std::max(bottom, other.bottom);
}

Projection::Projection(const Eye& from, int width, int height)
    : eye(from),
      half_width(0.5F * static_cast<float>(width)),
      half_height(0.5F * static_cast<float>(height)),
      scale(half_height * from.focal) {}

V3 Projection::view(const V3& p) const {
  const V3 d = p - eye.at;
  return {dot(d, eye.right), dot(d, eye.up), dot(d, eye.forward)};
}

V3 Projection::world(const V3& ray) const {
  return ray.x * eye.right + ray.y * eye.up + ray.z * eye.forward;
}

Samples::Samples(int width, int height)
    : width_(width), height_(height), inverse_(at(0, height)), id_(at(0, height)) {}

void Samples::clear(const Projection& projection) {
  projection_ = projection;
  for (int y = touched_.top; y < touched_.bottom; ++y) {
    const auto begin = static_cast<std::ptrdiff_t>(at(touched_.left, y)),
               end = static_cast<std::ptrdiff_t>(at(touched_.right, y));
    std::fill(inverse_.begin() + begin, inverse_.begin() + end, 0.0F);
    std::fill(id_.begin() + begin, id_.begin() + end, 0U);
  }
  touched_ = {};
}

Rect Samples::bounds(float left, float top, float right, float bottom) const {
  return {to_int(left, 0, width_), to_int(top, 0, height_), to_int(right + 1, 0, width_),
          to_int(bottom + 1, 0, height_)};
}

// 1/z is linear in the picture: for the rays r through a triangle with corners a, b, c it is
// (b x c + c x a + a x b).r / det(a, b, c).
void Samples::triangle(std::uint32_t id, const V3& a, const V3& b, const V3& c) {
  if (a.z < kNear && b.z < kNear && c.z < kNear) return;
  const V3 bc = cross(b, c), n = bc + cross(c, a) + cross(a, b);
  const float det = dot(a, bc);
  if (!(det > 1e-30F || det < -1e-30F)) return;
  const Projection& p = projection_;
  const float k = 1 / (det * p.scale);
  Plane plane{n.x * k, -n.y * k, n.z / det - n.x * k * p.half_width + n.y * k * p.half_height, 0,
              1 / kNear};

  const float reach_x = (p.half_width + kGuard) / p.scale,
              reach_y = (p.half_height + kGuard) / p.scale;
  const auto inside = [&](const V3& v) {
    return v.z >= kNear && std::abs(v.x) <= reach_x * v.z && std::abs(v.y) <= reach_y * v.z;
  };
  if (inside(a) && inside(b) && inside(c)) {
    plane.most = 1 / smaller(a.z, smaller(b.z, c.z));
    plane.least = 1 / larger(a.z, larger(b.z, c.z));
    fill(id, plane, a, b, c);
    return;
  }
  V3 one[9] = {a, b, c}, two[9];
  int count = clip(one, 3, {0, 0, 1}, kNear, two);
  count = clip(two, count, {1, 0, reach_x}, 0, one);
  count = clip(one, count, {-1, 0, reach_x}, 0, two);
  count = clip(two, count, {0, 1, reach_y}, 0, one);
  count = clip(one, count, {0, -1, reach_y}, 0, two);
  for (int i = 2; i < count; ++i) fill(id, plane, two[0], two[i - 1], two[i]);
}

// Exact in units of 1/256 pixel. A sample on an edge belongs to the triangle on its right or below.
void Samples::fill(std::uint32_t id, const Plane& plane, const V3& a, const V3& b, const V3& c) {
  struct Corner {
    std::int64_t x, y;
  };
  const auto corner = [&](const V3& v) {
    const float most = 2 * kGuard + 2 * larger(projection_.half_width, projection_.half_height);
    const float x = projection_.half_width + v.x / v.z * projection_.scale + 2 * kGuard,
                y = projection_.half_height - v.y / v.z * projection_.scale + 2 * kGuard;
    const int limit = static_cast<int>(2 * most + 2 * kGuard) * 256;
    constexpr int kShift = static_cast<int>(2 * kGuard) * 256;
    return Corner{to_int(x * 256 + 0.5F, 0, limit) - kShift,
                  to_int(y * 256 + 0.5F, 0, limit) - kShift};
  };
  Corner p = corner(a), q = corner(b), r = corner(c);
  const std::int64_t area = (q.x - p.x) * (r.y - p.y) - (q.y - p.y) * (r.x - p.x);
  if (area == 0) return;
  if (area < 0) std::swap(q, r);

  const auto [left, right] = std::minmax({p.x, q.x, r.x});
  const auto [top, bottom] = std::minmax({p.y, q.y, r.y});
  const auto pixel = [](std::int64_t v, int most) {
    return static_cast<int>(std::clamp<std::int64_t>(v >> 8, 0, most));
  };
  const Rect rect{pixel(left, width_), pixel(top, height_), pixel(right + 256, width_),
                  pixel(bottom + 256, height_)};
  if (rect.empty()) return;
  touched_.include(rect);

  struct Side {
    std::int64_t at, dx, dy, best;
    std::int64_t sample[kCount];
  };
  const auto side = [&](const Corner& from, const Corner& to) {
    const std::int64_t dx = -(to.y - from.y), dy = to.x - from.x;
    const std::int64_t own = dx > 0 || (dx == 0 && dy > 0) ? 0 : -1;
    Side s{dx * (rect.left * 256 - from.x) + dy * (rect.top * 256 - from.y) + own,
           dx * 256,
           dy * 256,
           0,
           {}};
    s.best = -(std::int64_t{1} << 62);
    for (std::size_t i = 0; i < kCount; ++i) {
      s.sample[i] = dx * kPlaces[i][0] + dy * kPlaces[i][1];
      s.best = std::max(s.best, s.sample[i]);
    }
    return s;
  };
  Side e = side(p, q), f = side(q, r), g = side(r, p);
  float depth_of[kCount];
  for (std::size_t i = 0; i < kCount; ++i)
    depth_of[i] = plane.a * (static_cast<float>(kPlaces[i][0]) / 256) +
                  plane.b * (static_cast<float>(kPlaces[i][1]) / 256) + plane.c;
  for (int y = rect.top; y < rect.bottom; ++y, e.at += e.dy, f.at += f.dy, g.at += g.dy) {
    std::int64_t u = e.at, v = f.at, w = g.at;
    const float row = plane.b * static_cast<float>(y);
    std::size_t sample = at(rect.left, y);
    for (int x = rect.left; x < rect.right; ++x, sample += kCount) {
      if (((u + e.best) | (v + f.best) | (w + g.best)) >= 0) {
        const float base = row + plane.a * static_cast<float>(x);
        for (std::size_t i = 0; i < kCount; ++i)
          if (((u + e.sample[i]) | (v + f.sample[i]) | (w + g.sample[i])) >= 0)
            put(sample + i, smaller(larger(base + depth_of[i], plane.least), plane.most), id);
      }
      u += e.dx;
      v += f.dx;
      w += g.dx;
    }
  }
}

// By rays: |s d - c| = r with the smaller s, which is the depth, for d has 1 forward.
void Samples::ball(std::uint32_t id, const V3& c, float radius) {
  const float beyond = dot(c, c) - radius * radius;
  if (!(radius > 0) || !(beyond > 0) || c.z + radius < kNear) return;  // the eye is in it
  float left = -1e9F, right = 1e9F, top = -1e9F, bottom = 1e9F;
  if (const float z2 = c.z * c.z - radius * radius; c.z > 0 && z2 > 0) {
    const auto around = [&](float s, float& low, float& high) {
      const float root = radius * std::sqrt(larger(s * s + z2, 0));
      low = (s * c.z - root) / z2;
      high = (s * c.z + root) / z2;
    };
    float low, high;
    around(c.x, low, high);
    left = projection_.half_width + low * projection_.scale;
    right = projection_.half_width + high * projection_.scale;
    around(c.y, low, high);
    top = projection_.half_height - high * projection_.scale;
    bottom = projection_.half_height - low * projection_.scale;
  }
  const Rect rect = bounds(left, top, right, bottom);
  if (rect.empty()) return;
  touched_.include(rect);
  for (int y = rect.top; y < rect.bottom; ++y)
    for (int x = rect.left; x < rect.right; ++x)
      for (std::size_t i = 0; i < kCount; ++i) {
        const V3 d =
            projection_.ray(static_cast<float>(x) + static_cast<float>(kPlaces[i][0]) / 256,
                            static_cast<float>(y) + static_cast<float>(kPlaces[i][1]) / 256);
        const float dd = dot(d, d), dc = dot(d, c), root = dc * dc - dd * beyond;
        if (root < 0) continue;
        const float s = (dc - std::sqrt(root)) / dd;
        if (s >= kNear) put(at(x, y) + i, 1 / s, id);
      }
}

void Samples::line(std::uint32_t id, V3 a, V3 b, float width, float nearer) {
  if (a.z < kNear && b.z < kNear) return;
  if (a.z < kNear) a = mix(b, a, (b.z - kNear) / (b.z - a.z));
  if (b.z < kNear) b = mix(a, b, (a.z - kNear) / (a.z - b.z));
  const Projection& p = projection_;
  const auto x_of = [&](const V3& v) { return p.half_width + v.x / v.z * p.scale; };
  const auto y_of = [&](const V3& v) { return p.half_height - v.y / v.z * p.scale; };
  const float radius = larger(0.5F * width, 0.4F), border = radius + 1;
  float ax = x_of(a), ay = y_of(a), bx = x_of(b), by = y_of(b);
  const float w = 2 * p.half_width, h = 2 * p.half_height;

  // The part within the picture (Liang & Barsky 1984).
  float from = 0, to = 1;
  const auto cut = [&](float start, float change, float least, float most) {
    if (change == 0) return start >= least && start <= most;
    const float s = (least - start) / change, t = (most - start) / change;
    from = larger(from, smaller(s, t));
    to = smaller(to, larger(s, t));
    return from <= to;
  };
  if (!cut(ax, bx - ax, -border, w + border) || !cut(ay, by - ay, -border, h + border)) return;
  float ia = (1 + nearer) / a.z, ib = (1 + nearer) / b.z;
  const float sx = bx - ax, sy = by - ay, si = ib - ia;
  bx = ax + to * sx, by = ay + to * sy, ib = ia + to * si;
  ax += from * sx, ay += from * sy, ia += from * si;

  const float dx = bx - ax, dy = by - ay, dd = dx * dx + dy * dy;
  const float inverse = dd > 1e-12F ? 1 / dd : 0;
  const Rect rect = bounds(smaller(ax, bx) - border, smaller(ay, by) - border,
                           larger(ax, bx) + border, larger(ay, by) + border);
  if (rect.empty()) return;
  touched_.include(rect);
  const float slope = dy != 0 ? dx / dy : 0;
  const float spread = dy != 0 ? border * std::sqrt(1 + slope * slope) + std::abs(slope) : 0;
  for (int y = rect.top; y < rect.bottom; ++y) {
    int left = rect.left, right = rect.right;
    if (dy != 0) {
      const float middle = ax + (static_cast<float>(y) + 0.5F - ay) * slope;
      left = std::max(left, to_int(middle - spread, 0, width_));
      right = std::min(right, to_int(middle + spread + 1, 0, width_));
    }
    for (int x = left; x < right; ++x)
      for (std::size_t i = 0; i < kCount; ++i) {
        const float px = static_cast<float>(x) + static_cast<float>(kPlaces[i][0]) / 256 - ax,
                    py = static_cast<float>(y) + static_cast<float>(kPlaces[i][1]) / 256 - ay;
        const float s = clamp01((px * dx + py * dy) * inverse);
        const float ex = px - s * dx, ey = py - s * dy;
        if (ex * ex + ey * ey <= radius * radius) put(at(x, y) + i, ia + s * (ib - ia), id);
      }
  }
}

}  // namespace sim::raster
