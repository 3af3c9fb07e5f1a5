#include "core/picture/raster/shadow.h"

#include <algorithm>

namespace sim::raster {
namespace {

float least_of(float a, float b, float c) { return std::min(a, std::min(b, c)); }
float most_of(float a, float b, float c) { return std::max(a, std::max(b, c)); }

// Calls visit(x, y, u, v, w) for the texels in a triangle of points with x and y, with the share of
// each corner; the border counts as inside.
template <class Point, class Visit>
void scan(const Point& a, const Point& b, const Point& c, int size, Visit visit) {
  const float area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  if (!(area > 1e-12F || area < -1e-12F)) return;
  const float k = 1 / area;
  const int left = to_int(least_of(a.x, b.x, c.x), 0, size),
            right = to_int(most_of(a.x, b.x, c.x) + 1, 0, size),
            top = to_int(least_of(a.y, b.y, c.y), 0, size),
            bottom = to_int(most_of(a.y, b.y, c.y) + 1, 0, size);
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x) {
      const float px = static_cast<float>(x) + 0.5F, py = static_cast<float>(y) + 0.5F;
      const float v = ((px - a.x) * (c.y - a.y) - (py - a.y) * (c.x - a.x)) * k,
                  w = ((b.x - a.x) * (py - a.y) - (b.y - a.y) * (px - a.x)) * k, u = 1 - v - w;
      if (u >= 0 && v >= 0 && w >= 0) visit(x, y, u, v, w);
    }
}

}  // namespace

V3 ShadowMap::map(const V3& p) const {
  return {(dot(p, u_) - left_) * texels_, (dot(p, v_) - top_) * texels_, dot(p, light_)};
}

void ShadowMap::draw(const Picture& picture, Cancellation& cancellation) {
  light_ = picture.light;
  u_ = unit(cross(std::abs(light_.y) < 0.9F ? V3{0, 1, 0} : V3{1, 0, 0}, light_));
  v_ = cross(light_, u_);
  float right = -1e9F, bottom = -1e9F;
  left_ = top_ = 1e9F;
  const auto include = [&](const V3& p, float radius) {
    const float x = dot(p, u_), y = dot(p, v_);
    left_ = std::min(left_, x - radius), right = std::max(right, x + radius);
    top_ = std::min(top_, y - radius), bottom = std::max(bottom, y + radius);
  };
  for (const PictureTriangle& t : picture.triangles)
    if (t.visible && t.casts)
      for (const int i : t.points) include(picture.points[static_cast<std::size_t>(i)], 0);
  for (const PictureBall& b : picture.balls)
    if (b.casts) include(b.centre, b.radius);
  const float extent = std::max(right - left_, bottom - top_);
  empty_ = !(extent > 0) || !(extent < 1e6F);
  if (empty_) return;
  texels_ = static_cast<float>(kSize - 16) / extent;
  left_ -= 8 / texels_, top_ -= 8 / texels_;
  std::ranges::fill(depth_, -1e30F);
  int items = 0;
  for (const PictureTriangle& t : picture.triangles) {
    if (++items % kItems == 0 && cancellation.gives_up()) return;
    if (t.visible && t.casts)
      triangle(map(picture.points[static_cast<std::size_t>(t.points[0])]),
               map(picture.points[static_cast<std::size_t>(t.points[1])]),
               map(picture.points[static_cast<std::size_t>(t.points[2])]));
  }
  for (const PictureBall& b : picture.balls) {
    if (++items % kItems == 0 && cancellation.gives_up()) return;
    if (b.casts) ball(b);
  }
}

void ShadowMap::triangle(const V3& a, const V3& b, const V3& c) {
  scan(a, b, c, kSize,
       [&](int x, int y, float u, float v, float w) { put(x, y, u * a.z + v * b.z + w * c.z); });
}

void ShadowMap::ball(const PictureBall& b) {
  const V3 c = map(b.centre);
  const float r = b.radius * texels_;
  const int left = to_int(c.x - r, 0, kSize), right = to_int(c.x + r + 1, 0, kSize),
            top = to_int(c.y - r, 0, kSize), bottom = to_int(c.y + r + 1, 0, kSize);
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x) {
      const float dx = static_cast<float>(x) + 0.5F - c.x, dy = static_cast<float>(y) + 0.5F - c.y;
      const float rest = r * r - dx * dx - dy * dy;
      if (rest > 0) put(x, y, c.z + std::sqrt(rest) / texels_);
    }
}

// The mean of 4 x 4 texels around the point, those at the border by the part that is within 3 x 3
// texels; the point is moved off its own surface.
float ShadowMap::light(const V3& p, const V3& normal) const {
  if (empty_) return 1;
  const float texel = 1 / texels_;
  V3 q = map(p + 3 * texel * normal);
  q.z += (3 + 3 * (1 - dot(normal, light_))) * texel;
  q.x -= 2, q.y -= 2;
  const int x = to_int(q.x, 0, kSize - 5), y = to_int(q.y, 0, kSize - 5);
  const float fx = clamp01(q.x - static_cast<float>(x)), fy = clamp01(q.y - static_cast<float>(y));
  const float wx[4] = {1 - fx, 1, 1, fx}, wy[4] = {1 - fy, 1, 1, fy};
  float sum = 0;
  for (int j = 0; j < 4; ++j)
    for (int i = 0; i < 4; ++i)
      if (depth_[static_cast<std::size_t>((y + j) * kSize + x + i)] <= q.z) sum += wx[i] * wy[j];
  return sum / 9;
}

GroundShadow::Cast GroundShadow::cast(const V3& p) const {
  const V3 d = p - ground_.origin;
  const float height = dot(d, ground_.up), rise = dot(light_, ground_.up);
  const V3 q = d - (height / rise) * light_;
  return {(dot(q, ground_.u) - left_) * texels_, (dot(q, ground_.w) - top_) * texels_, height,
          height > -1e-3F};
}

void GroundShadow::draw(const Picture& picture, Cancellation& cancellation) {
  empty_ = true;
  if (!picture.ground || !(dot(picture.light, picture.ground->up) > 0.05F)) return;
  ground_ = *picture.ground;
  light_ = picture.light;
  left_ = top_ = 0, texels_ = 1;
  float left = 1e9F, top = 1e9F, right = -1e9F, bottom = -1e9F;
  const auto include = [&](const Cast& c, float radius) {
    if (!c.above) return;
    left = std::min(left, c.x - radius), right = std::max(right, c.x + radius);
    top = std::min(top, c.y - radius), bottom = std::max(bottom, c.y + radius);
  };
  for (const PictureTriangle& t : picture.triangles)
    for (const int i : t.points)
      if (t.casts) include(cast(picture.points[static_cast<std::size_t>(i)]), 0);
  for (const PictureBall& b : picture.balls)
    if (b.casts) include(cast(b.centre), 1.5F * b.radius);
  const float extent = std::max(right - left, bottom - top);
  if (!(extent > 0) || !(extent < 1e4F)) return;
  const float border = 0.25F;  // room for the blur
  texels_ = static_cast<float>(kSize) / (extent + 2 * border);
  left_ = left - border, top_ = top - border;
  empty_ = false;
  near_.assign(static_cast<std::size_t>(kSize) * kSize, 0);
  far_.assign(near_.size(), 0);
  const auto at = [&](int i) { return cast(picture.points[static_cast<std::size_t>(i)]); };
  int items = 0;
  for (const PictureTriangle& t : picture.triangles) {
    if (++items % kItems == 0 && cancellation.gives_up()) return;
    if (t.casts) triangle(at(t.points[0]), at(t.points[1]), at(t.points[2]), t.visible ? 1 : 0.45F);
  }
  for (const PictureBall& b : picture.balls) {
    if (++items % kItems == 0 && cancellation.gives_up()) return;
    if (b.casts) ball(b);
  }
  blur(near_, to_int(0.010F * texels_ + 0.5F, 1, 40));
  blur(far_, to_int(0.045F * texels_ + 0.5F, 1, 60));
  find_shade();
}

void GroundShadow::put(int x, int y, float height, float weight) {
  const auto at = static_cast<std::size_t>(y * kSize + x);
  const float far = clamp01(height / 0.5F);
  near_[at] = std::max(near_[at], weight * (1 - far));
  far_[at] = std::max(far_[at], weight * far);
}

void GroundShadow::triangle(const Cast& a, const Cast& b, const Cast& c, float weight) {
  if (!a.above || !b.above || !c.above) return;
  scan(a, b, c, kSize, [&](int x, int y, float u, float v, float w) {
    put(x, y, u * a.height + v * b.height + w * c.height, weight);
  });
}

void GroundShadow::ball(const PictureBall& b) {
  const Cast c = cast(b.centre);
  if (!c.above) return;
  const float r = 1.5F * b.radius * texels_, rise = dot(light_, ground_.up);
  const int left = to_int(c.x - r, 0, kSize), right = to_int(c.x + r + 1, 0, kSize),
            top = to_int(c.y - r, 0, kSize), bottom = to_int(c.y + r + 1, 0, kSize);
  const V3 away = b.centre - ground_.origin;
  for (int y = top; y < bottom; ++y)
    for (int x = left; x < right; ++x) {
      const V3 q = ((static_cast<float>(x) + 0.5F) / texels_ + left_) * ground_.u +
                   ((static_cast<float>(y) + 0.5F) / texels_ + top_) * ground_.w;
      const V3 d = away - q, off = d - dot(d, light_) * light_;
      if (dot(off, off) < b.radius * b.radius)
        put(x, y, std::max(0.0F, c.height - b.radius * rise), 1);
    }
}

// Three passes of a running mean in each direction come near to a bell.
void GroundShadow::blur(std::vector<float>& map, int radius) {
  for (int direction = 0; direction < 2; ++direction) {
    transpose(map);
    for (int times = 0; times < 3; ++times) blur_columns(map, radius);
  }
}

void GroundShadow::transpose(std::vector<float>& map) {
  other_.resize(map.size());
  for (std::size_t top = 0; top < kSize; top += kBlock)
    for (std::size_t left = 0; left < kSize; left += kBlock)
      for (std::size_t y = top; y < top + kBlock; ++y)
        for (std::size_t x = left; x < left + kBlock; ++x)
          other_[x * kSize + y] = map[y * kSize + x];
  map.swap(other_);
}

// All columns side by side: a row of sums goes down the map.
void GroundShadow::blur_columns(std::vector<float>& map, int radius) {
  static constexpr float kNothing[kSize]{};
  float sums[kSize]{};
  other_.resize(map.size());
  const float share = 1 / static_cast<float>(2 * radius + 1);
  const auto row = [&](int y) {
    return y < 0 || y >= kSize ? kNothing : map.data() + static_cast<std::size_t>(y) * kSize;
  };
  for (int y = -radius; y < kSize; ++y) {
    const float *comes = row(y + radius), *goes = row(y - radius - 1);
    for (int x = 0; x < kSize; ++x) sums[x] += comes[x] - goes[x];
    if (y < 0) continue;
    float* out = other_.data() + static_cast<std::size_t>(y) * kSize;
    for (int x = 0; x < kSize; ++x) out[x] = std::max(0.0F, sums[x] * share);
  }
  map.swap(other_);
}

// A block includes the texels after it, which its last points read.
void GroundShadow::find_shade() {
  std::ranges::fill(shade_, std::uint8_t{0});
  for (int y = 0; y < kSize; ++y)
    for (int x = 0; x < kSize; ++x) {
      const auto at = static_cast<std::size_t>(y * kSize + x);
      if (near_[at] == 0 && far_[at] == 0) continue;
      for (const int j : {std::max(y - 1, 0) / kBlock, y / kBlock})
        for (const int i : {std::max(x - 1, 0) / kBlock, x / kBlock})
          shade_[static_cast<std::size_t>(j * kBlocks + i)] = 1;
    }
}

float GroundShadow::dark(float u, float w) const {
  if (empty_) return 0;
  const float x = (u - left_) * texels_ - 0.5F, y = (w - top_) * texels_ - 0.5F;
  if (!(x >= 0 && y >= 0 && x < kSize - 1 && y < kSize - 1)) return 0;
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  if (!shade_[static_cast<std::size_t>(j / kBlock * kBlocks + i / kBlock)]) return 0;
  const float fx = x - static_cast<float>(i), fy = y - static_cast<float>(j);
  const auto sample = [&](const std::vector<float>& map) {
    const float* m = map.data() + j * kSize + i;
    return (1 - fy) * ((1 - fx) * m[0] + fx * m[1]) +
           fy * ((1 - fx) * m[kSize] + fx * m[kSize + 1]);
  };
  return std::min(1.0F, sample(near_) + sample(far_));
}

Rect GroundShadow::bounds(const Projection& projection, int width, int height) const {
  if (empty_) return {};
  float left = 1e9F, top = 1e9F, right = -1e9F, bottom = -1e9F;
  for (const float x : {0.0F, static_cast<float>(kSize)})
    for (const float y : {0.0F, static_cast<float>(kSize)}) {
      const V3 v = projection.view(ground_.origin + (x / texels_ + left_) * ground_.u +
                                   (y / texels_ + top_) * ground_.w);
      if (v.z < 0.01F) return {0, 0, width, height};
      const float px = projection.half_width + v.x / v.z * projection.scale,
                  py = projection.half_height - v.y / v.z * projection.scale;
      left = std::min(left, px), right = std::max(right, px);
      top = std::min(top, py), bottom = std::max(bottom, py);
    }
  return {to_int(left, 0, width), to_int(top, 0, height), to_int(right + 2, 0, width),
          to_int(bottom + 2, 0, height)};
}

}  // namespace sim::raster
