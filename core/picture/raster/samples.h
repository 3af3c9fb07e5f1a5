// Visibility samples: four a pixel, each with the nearest surface and its depth.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/picture/picture.h"

namespace sim::raster {

inline constexpr int kItems = 64;  // of a picture, between two questions whether it is given up

// The projection onto the picture's plane: pixels (x, y) from the upper left corner are rays from
// the eye.
struct Projection {
  Projection() = default;
  Projection(const Eye& eye, int width, int height);

  V3 view(const V3& p) const;       // right, up, forward of the eye
  V3 ray(float x, float y) const {  // in the same axes; 1 forward
    return {(x - half_width) / scale, (half_height - y) / scale, 1};
  }
  V3 world(const V3& ray) const;  // the direction of a ray

  Eye eye;
  float half_width = 0, half_height = 0, scale = 1;  // pixels
};

struct Rect {
  int left = 0, top = 0, right = 0, bottom = 0;  // [left, right) x [top, bottom)

  bool empty() const { return left >= right || top >= bottom; }
  void include(const Rect& other);
};

// v as an integer between the two; the lower one for a value that is not a number.
int to_int(float v, int least, int most);

class Samples {
 public:
  static constexpr int kCount = 4;
  static constexpr float kNear = 1e-3F;
  // The positions of the samples in a pixel, in 1/256 of it: a rotated square.
  static constexpr std::array<std::array<int, 2>, kCount> kPlaces{
      {{96, 32}, {224, 96}, {32, 160}, {160, 224}}};

  Samples(int width, int height);

  void clear(const Projection& projection);

  // Draws an item under an id > 0; corners in the axes of the eye.
  void triangle(std::uint32_t id, const V3& a, const V3& b, const V3& c);
  void ball(std::uint32_t id, const V3& centre, float radius);
  // Draws a line of a width in pixels; `nearer` moves it towards the eye by a fraction of its
  // distance.
  void line(std::uint32_t id, V3 a, V3 b, float width, float nearer);

  const std::uint32_t* ids(int x, int y) const { return id_.data() + at(x, y); }
  const Rect& touched() const { return touched_; }  // outside of it all ids are 0

 private:
  struct Plane {  // 1/z = a x + b y + c, between two bounds
    float a, b, c, least, most;
  };

  std::size_t at(int x, int y) const {
    return kCount * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                     static_cast<std::size_t>(x));
  }
  void put(std::size_t sample, float inverse, std::uint32_t id) {
    if (!(inverse > inverse_[sample])) return;
    inverse_[sample] = inverse;
    id_[sample] = id;
  }
  Rect bounds(float left, float top, float right, float bottom) const;
  void fill(std::uint32_t id, const Plane& plane, const V3& a, const V3& b, const V3& c);

  int width_, height_;
  Projection projection_;
  Rect touched_;
  std::vector<float> inverse_;  // 1 / distance forward; 0: nothing
  std::vector<std::uint32_t> id_;
};

}  // namespace sim::raster
