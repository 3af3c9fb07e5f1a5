// Shadows of the key light: on surfaces by a shadow map, on the ground by a map of what lies above
// it, the softer the higher.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/cancellation.h"
#include "core/picture/raster/samples.h"

namespace sim::raster {

// The shadow of a ball is that of a ball; triangles and lines are taken as they are.
class ShadowMap {
 public:
  void draw(const Picture& picture, Cancellation& cancellation);

  // 0 .. 1: the share of the light that arrives at a point with that normal towards the light.
  float light(const V3& p, const V3& normal) const;

 private:
  static constexpr int kSize = 768;

  V3 map(const V3& p) const;  // texels, and nearness to the light
  void put(int x, int y, float near) {
    float& held = depth_[static_cast<std::size_t>(y * kSize + x)];
    if (near > held) held = near;
  }
  void triangle(const V3& a, const V3& b, const V3& c);
  void ball(const PictureBall& ball);

  V3 u_, v_, light_;
  float left_ = 0, top_ = 0, texels_ = 1;  // texels a unit
  bool empty_ = true;
  std::vector<float> depth_ = std::vector<float>(static_cast<std::size_t>(kSize) * kSize);
};

class GroundShadow {
 public:
  void draw(const Picture& picture, Cancellation& cancellation);

  // 0 .. 1, at the point of the ground that is u, w away from its origin.
  float dark(float u, float w) const;
  // The pixels that may be dark.
  Rect bounds(const Projection& projection, int width, int height) const;

 private:
  static constexpr int kSize = 384, kBlock = 8, kBlocks = kSize / kBlock;

  struct Cast {
    float x, y, height;  // along the ground, and where it comes from
    bool above;
  };
  Cast cast(const V3& p) const;
  void put(int x, int y, float height, float weight);
  void triangle(const Cast& a, const Cast& b, const Cast& c, float weight);
  void ball(const PictureBall& ball);
  void blur(std::vector<float>& map, int radius);
  void blur_columns(std::vector<float>& map, int radius);
  void transpose(std::vector<float>& map);
  void find_shade();

  Ground ground_;
  V3 light_;
  float left_ = 0, top_ = 0, texels_ = 1;
  bool empty_ = true;
  std::vector<float> near_, far_, other_;
  std::vector<std::uint8_t> shade_ =
      std::vector<std::uint8_t>(kBlocks * kBlocks);  // any in a block
};

}  // namespace sim::raster
