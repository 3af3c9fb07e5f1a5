// The rasteriser: a Picture becomes pixels, on the CPU, with the same bytes on every machine. Only
// + - * / and square roots of floats and integers are used.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "core/picture/picture.h"

namespace sim {

// Rows from the top, three bytes a pixel: red, green, blue of sRGB.
struct Image {
  int width = 0, height = 0;
  std::vector<std::uint8_t> rgb;

  const std::uint8_t* pixel(int x, int y) const {
    return rgb.data() + 3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
                             static_cast<std::size_t>(x));
  }
};

// Caches the sky and the ground as long as the eye rests, so that one rasteriser serves a whole
// film.
class Raster {
 public:
  // 1 .. kMostPixels pixels a side; throws Error{kUsage}.
  Raster(int width, int height);
  ~Raster();
  Raster(const Raster&) = delete;
  Raster& operator=(const Raster&) = delete;

  static constexpr int kMostPixels = 8192;

  // A stop() is asked between rows and items; true ends a picture, which is worth nothing then.
  void stop_when(std::function<bool()> stop);

  // Valid until the next call. Items that are not finite, or further than 1e6 away, are left out.
  const Image& draw(const Picture& picture);

  // Pixels of the last picture that hold a triangle, a line or a ball.
  std::int64_t covered() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace sim
