#include "core/picture/raster/raster.h"

#include <algorithm>

#include "core/base/cancellation.h"
#include "core/base/error.h"
#include "core/picture/raster/ground.h"
#include "core/picture/raster/samples.h"
#include "core/picture/raster/shadow.h"
#include "core/picture/raster/text.h"
#include "core/picture/raster/tone.h"

namespace sim {
namespace {

constexpr float kFar = 1e6F;

bool usable(const V3& p) {
  return std::abs(p.x) < kFar && std::abs(p.y) < kFar && std::abs(p.z) < kFar;
}

const V3 kSkyLight = colour(0xC4D2E6), kEarthLight = colour(0x8E867C), kKey = colour(0xFFF3E2),
         kFill = colour(0xB8C8E0);

}  // namespace

struct Raster::Impl {
  Impl(int width, int height)
      : samples(width, height), backdrop(width, height), image{width, height, {}} {}

  void place(const Picture& picture);
  void resolve();
  V3 shade(std::uint32_t id, int x, int y) const;
  V3 shade_triangle(const PictureTriangle& triangle, const V3& ray, const V3& direction) const;
  V3 shade_ball(const PictureBall& ball, const V3& ray, const V3& direction) const;
  V3 lit(const V3& albedo, const V3& p, const V3& normal, const V3& towards_eye, float gloss,
         bool thin) const;
  V3 behind(int x, int y, bool shadowed) const;

  raster::Tone tone;
  raster::Samples samples;
  raster::Backdrop backdrop;
  raster::ShadowMap shadow;
  raster::GroundShadow ground_shadow;
  raster::Projection projection;
  const Picture* picture = nullptr;
  std::vector<V3> view;  // of the points
  std::vector<bool> good;
  V3 up, side;  // of the scene, for the light from all around
  Image image;
  std::int64_t covered = 0;
  Cancellation cancellation;
};

Raster::Raster(int width, int height) {
  if (width < 1 || height < 1 || width > kMostPixels || height > kMostPixels)
    throw Error(
        ErrorKind::kUsage,
        {"bad size of a picture", std::to_string(width) + "x" + std::to_string(height),
         "a side has 1 to " + std::to_string(kMostPixels) + " pixels", "1280x720 is usual"});
  impl_ = std::make_unique<Impl>(width, height);
}

Raster::~Raster() = default;

std::int64_t Raster::covered() const { return impl_->covered; }

void Raster::stop_when(std::function<bool()> stop) { impl_->cancellation.when(std::move(stop)); }

const Image& Raster::draw(const Picture& picture) {
  Impl& r = *impl_;
  const Cancellation::Step step(r.cancellation);
  r.picture = &picture;
  r.projection = raster::Projection(picture.eye, r.image.width, r.image.height);
  r.up = picture.ground ? picture.ground->up : V3{0, 1, 0};
  r.backdrop.draw(picture, r.projection, r.tone, r.cancellation);
  r.image.rgb = r.backdrop.screen();
  r.place(picture);
  r.shadow.draw(picture, r.cancellation);
  r.ground_shadow.draw(picture, r.cancellation);
  r.resolve();
  raster::draw_patches(picture, r.tone, r.image);
  raster::draw_texts(picture, r.tone, r.image);
  return r.image;
}

// Ids: triangles from 1 on, then balls, then lines.
void Raster::Impl::place(const Picture& p) {
  samples.clear(projection);
  view.resize(p.points.size());
  good.resize(p.points.size());
  for (std::size_t i = 0; i < view.size(); ++i) {
    good[i] = usable(p.points[i]);
    view[i] = good[i] ? projection.view(p.points[i]) : V3{};
  }
  std::uint32_t id = 0;
  for (const PictureTriangle& t : p.triangles) {
    if (++id % raster::kItems == 0 && cancellation.gives_up()) return;
    const auto a = static_cast<std::size_t>(t.points[0]), b = static_cast<std::size_t>(t.points[1]),
               c = static_cast<std::size_t>(t.points[2]);
    if (t.visible && good[a] && good[b] && good[c]) samples.triangle(id, view[a], view[b], view[c]);
  }
  for (const PictureBall& ball : p.balls) {
    if (++id % raster::kItems == 0 && cancellation.gives_up()) return;
    if (usable(ball.centre) && ball.radius < kFar)
      samples.ball(id, projection.view(ball.centre), ball.radius);
  }
  const float pixel = static_cast<float>(image.height) / 720;
  for (const PictureLine& line : p.lines) {
    if (++id % raster::kItems == 0 && cancellation.gives_up()) return;
    if (usable(line.a) && usable(line.b))
      samples.line(id, projection.view(line.a), projection.view(line.b), line.width * pixel,
                   line.in_front ? 0.02F : 0.004F);
  }
}

// Each surface in a pixel is shaded once, and counts by its samples.
void Raster::Impl::resolve() {
  covered = 0;
  const raster::Rect dark = ground_shadow.bounds(projection, image.width, image.height);
  raster::Rect rect = samples.touched();
  rect.include(dark);
  for (int y = rect.top; y < rect.bottom && !cancellation.gives_up(); ++y)
    for (int x = rect.left; x < rect.right; ++x) {
      const std::uint32_t* ids = samples.ids(x, y);
      const bool in_dark = x >= dark.left && x < dark.right && y >= dark.top && y < dark.bottom;
      const bool any = (ids[0] | ids[1] | ids[2] | ids[3]) != 0;
      if (!any && !in_dark) continue;
      V3 light;
      if (!any) {
        light = behind(x, y, true);
      } else {
        ++covered;
        const bool one_surface = ids[0] == ids[1] && ids[0] == ids[2] && ids[0] == ids[3];
        if (one_surface) light = shade(ids[0], x, y);
        for (int i = 0; i < raster::Samples::kCount && !one_surface; ++i) {
          int count = 1;
          bool first = true;
          for (int j = 0; j < raster::Samples::kCount; ++j) {
            if (j < i && ids[j] == ids[i]) first = false;
            if (j > i && ids[j] == ids[i]) ++count;
          }
          if (!first) continue;
          const V3 one = ids[i] ? shade(ids[i], x, y) : behind(x, y, in_dark);
          light += (0.25F * static_cast<float>(count)) * one;
        }
      }
      tone.put(light, x, y,
               image.rgb.data() +
                   3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                        static_cast<std::size_t>(x)));
    }
}

V3 Raster::Impl::behind(int x, int y, bool shadowed) const {
  const V3& light = backdrop.light(x, y);
  if (!shadowed) return light;
  const raster::Backdrop::Spot& spot = backdrop.spot(x, y);
  const float dark = spot.clear > 0 ? ground_shadow.dark(spot.u, spot.w) : 0;
  if (dark == 0) return light;
  const float k = 0.62F * dark * spot.clear;
  return light * V3{1 - k, 1 - 0.96F * k, 1 - 0.88F * k};
}

V3 Raster::Impl::shade(std::uint32_t id, int x, int y) const {
  const V3 ray = projection.ray(static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F);
  const V3 direction = unit(projection.world(ray));
  std::size_t index = id - 1;
  if (index < picture->triangles.size())
    return shade_triangle(picture->triangles[index], ray, direction);
  index -= picture->triangles.size();
  if (index < picture->balls.size()) return shade_ball(picture->balls[index], ray, direction);
  return picture->lines[index - picture->balls.size()].colour;
}

// The shares of the corners on a ray r are as (b x c).r, (c x a).r, (a x b).r.
V3 Raster::Impl::shade_triangle(const PictureTriangle& t, const V3& ray,
                                const V3& direction) const {
  const auto i = static_cast<std::size_t>(t.points[0]), j = static_cast<std::size_t>(t.points[1]),
             k = static_cast<std::size_t>(t.points[2]);
  const V3 &a = view[i], &b = view[j], &c = view[k];
  const V3 bc = cross(b, c);
  const bool front = dot(a, bc) > 0;  // counter-clockwise as the eye sees it
  const float sign = front ? 1 : -1;
  float u = std::max(0.0F, sign * dot(bc, ray)), v = std::max(0.0F, sign * dot(cross(c, a), ray)),
        w = std::max(0.0F, sign * dot(cross(a, b), ray));
  const float sum = u + v + w;
  if (sum > 0)
    u /= sum, v /= sum, w /= sum;
  else
    u = v = w = 1.0F / 3;
  const std::vector<V3>& p = picture->points;
  const V3 point = u * p[i] + v * p[j] + w * p[k];
  const std::vector<V3>& n = picture->normals;
  V3 normal = unit(u * n[i] + v * n[j] + w * n[k]);
  if (!front) normal = -normal;
  // A smooth normal may turn away from the eye at a fold: it is bent back into sight.
  if (const float away = dot(normal, direction); away > -0.02F)
    normal = unit(normal - (away + 0.02F) * direction);
  const Skin& skin = picture->skins[static_cast<std::size_t>(t.skin)];
  V3 albedo = front ? skin.front : skin.back;
  if (!picture->colours.empty() && (front || skin.two_sided_colour)) {
    const std::vector<V3>& colours = picture->colours;
    albedo = u * colours[i] + v * colours[j] + w * colours[k];
  }
  return lit(albedo, point, normal, -direction, skin.gloss, skin.gloss < 0.2F);
}

V3 Raster::Impl::shade_ball(const PictureBall& ball, const V3& ray, const V3& direction) const {
  const V3 c = projection.view(ball.centre);
  const float dd = dot(ray, ray), dc = dot(ray, c),
              root = dc * dc - dd * (dot(c, c) - ball.radius * ball.radius);
  const float s = (dc - (root > 0 ? std::sqrt(root) : 0)) / dd;
  const V3 point = projection.eye.at + s * projection.world(ray);
  return lit(ball.colour, point, unit(point - ball.centre), -direction, 1, false);
}

// Light from the sky and the ground, a warm key light with shadow, a cool fill light from the other
// side, light at the rim; through a thin surface some of the key light comes from behind.
V3 Raster::Impl::lit(const V3& albedo, const V3& p, const V3& normal, const V3& towards_eye,
                     float gloss, bool thin) const {
  const V3& key = picture->light;
  const float facing = dot(normal, key), rise = dot(normal, up);
  const V3 around = mix(kEarthLight, kSkyLight, 0.5F + 0.5F * rise);
  V3 light = 0.54F * around;
  const V3 fill = unit(0.35F * up - 0.8F * (key - dot(key, up) * up) + 0.6F * towards_eye);
  light += 0.16F * std::max(0.0F, dot(normal, fill)) * kFill;
  float arrives = 0;
  if (facing > 0 || thin) arrives = shadow.light(p, facing > 0 ? normal : -normal);
  if (facing > 0)
    light += 0.78F * facing * arrives * kKey;
  else if (thin)
    light += 0.30F * -facing * arrives * kKey;
  V3 out = albedo * light;
  const float grazing = 1 - raster::clamp01(dot(normal, towards_eye)), g2 = grazing * grazing;
  out += (0.16F * g2 * g2) * around;
  if (gloss > 0 && facing > 0) {
    const float s = raster::clamp01(dot(normal, unit(key + towards_eye)));
    float power = s * s;     // 2
    power *= power;          // 4
    power *= power;          // 8
    power *= power * power;  // 24
    out += (0.55F * gloss * power * power * arrives) * kKey;
  }
  return out;
}

}  // namespace sim
