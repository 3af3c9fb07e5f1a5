#include "core/picture/raster/tone.h"

#include <cmath>

#include "core/picture/picture.h"

namespace sim::raster {
namespace {

// Newton's method; from above it converges monotonically.
double cube_root(double y) {
  if (!(y > 0)) return 0;
  double c = y < 1 ? 1 : y;
  for (int i = 0; i < 100; ++i) c = (2 * c + y / (c * c)) / 3;
  return c;
}

double fifth_root(double y) {
  if (!(y > 0)) return 0;
  double c = y < 1 ? 1 : y;
  for (int i = 0; i < 100; ++i) c = (4 * c + y / (c * c * c * c)) / 5;
  return c;
}

}  // namespace

double Tone::encode(double light) {
  if (light <= 0.0031308) return 12.92 * light;
  const double fifth = light * light * light * light * light;
  return 1.055 * std::sqrt(std::sqrt(cube_root(fifth))) - 0.055;
}

double Tone::decode(double screen) {
  if (screen <= 0.04045) return screen / 12.92;
  const double w = fifth_root((screen + 0.055) / 1.055);
  const double w4 = w * w * w * w;
  return w4 * w4 * w4;
}

Tone::Tone() {
  for (std::size_t i = 0; i < screen_.size(); ++i)
    screen_[i] =
        static_cast<std::uint16_t>(std::lround(encode(static_cast<double>(i) / 4096) * 255 * 16));
  for (std::size_t i = 0; i < light_.size(); ++i)
    light_[i] = static_cast<float>(decode(static_cast<double>(i) / 255));
}

}  // namespace sim::raster

namespace sim {

V3 colour(unsigned rgb) {
  const auto channel = [&](int shift) {
    return static_cast<float>(
        raster::Tone::decode(static_cast<double>((rgb >> shift) & 255U) / 255));
  };
  return {channel(16), channel(8), channel(0)};
}

}  // namespace sim
