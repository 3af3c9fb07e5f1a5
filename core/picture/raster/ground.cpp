#include "core/picture/raster/ground.h"

#include <algorithm>

namespace sim::raster {
namespace {

const V3 kHorizon = colour(0xBFC8D3), kZenith = colour(0xDCE3EA), kNadir = colour(0xC9CDD3),
         kFloor = colour(0xD6D7DA), kThin = colour(0xB2B5BB), kThick = colour(0x92969E);

bool same(const V3& a, const V3& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

bool same(const Eye& a, const Eye& b) {
  return same(a.at, b.at) && same(a.right, b.right) && same(a.up, b.up) &&
         same(a.forward, b.forward) && a.focal == b.focal;
}

bool same(const std::optional<Ground>& a, const std::optional<Ground>& b) {
  if (!a || !b) return !a && !b;
  return same(a->origin, b->origin) && same(a->u, b->u) && same(a->up, b->up) && same(a->w, b->w) &&
         a->spacing == b->spacing && a->fade == b->fade;
}

// The distance of s from the nearest whole number.
float to_whole(float s) {
  const float folded = s < 0 ? -s : s;
  if (!(folded < 1e6F)) return 0.5F;
  const float part = folded - static_cast<float>(static_cast<int>(folded));
  return part < 0.5F ? part : 1 - part;
}

// The share of a pixel of some width that lies on lines at the whole numbers, all in their unit.
float coverage(float s, float half, float width) {
  const float mean = 2 * half;
  const float sharp =
      clamp01((half + 0.5F * width - to_whole(s)) / width) * (mean < width ? mean / width : 1);
  return sharp + (mean - sharp) * clamp01(2 * width - 0.6F);
}

}  // namespace

Backdrop::Backdrop(int width, int height)
    : width_(width),
      height_(height),
      light_(at(0, height)),
      spots_(at(0, height)),
      screen_(3 * at(0, height)) {}

V3 Backdrop::sky(const V3& direction) const {
  const float rise = ground_ ? dot(direction, ground_->up) : 0.5F * direction.y + 0.2F;
  if (rise < 0) return mix(kHorizon, kNadir, clamp01(-3 * rise));
  return mix(kHorizon, kZenith, clamp01(2.2F * rise));
}

float Backdrop::distance(const V3& direction) const {
  if (!ground_) return 0;
  const float fall = -dot(direction, ground_->up);
  return fall > 1e-6F && above_ > 0 ? above_ / fall : 0;
}

float Backdrop::clear(float distance) const {
  const float s = clamp01(1 - distance / ground_->fade);
  return s * s * (3 - 2 * s);
}

// `width`: of a pixel, along the ground.
V3 Backdrop::grid(float u, float v, float width) const {
  const float s = 1 / ground_->spacing, f = width * s;
  const float thin = std::max(coverage(u * s, 0.010F, f), coverage(v * s, 0.010F, f));
  const float thick =
      std::max(coverage(u * s / 4, 0.0045F, f / 4), coverage(v * s / 4, 0.0045F, f / 4));
  return mix(mix(kFloor, kThin, thin), kThick, thick);
}

void Backdrop::draw(const Picture& picture, const Projection& projection, const Tone& tone,
                    Cancellation& cancellation) {
  if (drawn_ && same(eye_, picture.eye) && same(ground_, picture.ground)) return;
  drawn_ = false;
  eye_ = picture.eye;
  ground_ = picture.ground;
  above_ = ground_ ? dot(eye_.at - ground_->origin, ground_->up) : 0;
  const V3 over = ground_ ? eye_.at - ground_->origin : V3{};
  for (int y = 0; y < height_; ++y) {
    if (cancellation.gives_up()) return;
    for (int x = 0; x < width_; ++x) {
      const V3 ray = projection.ray(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
      const V3 d = projection.world(ray);
      const float size = std::sqrt(dot(ray, ray));
      V3 light = sky((1 / size) * d);
      Spot& spot = spots_[at(x, y)] = {};
      if (const float s = distance(d); s > 0) {
        const V3 p = over + s * d;
        const float far = s * size, seen = clear(far);
        const V3 below = eye_.at + s * d - ground_->origin;
        spot = {dot(below, ground_->u), dot(below, ground_->w), clear(s * length(d))};
        if (seen > 0) {
          // A pixel is wider along the ground the flatter the ray meets it.
          const float flat = above_ / far, pixel = far / projection.scale / size;
          const V3 floor = grid(dot(p, ground_->u), dot(p, ground_->w),
                                pixel * (0.4F + 0.6F / std::max(flat, 0.05F)));
          light = mix(light, floor, seen);
        }
      }
      light_[at(x, y)] = light;
      tone.put(light, x, y, screen_.data() + 3 * at(x, y));
    }
  }
  drawn_ = true;
}

}  // namespace sim::raster
