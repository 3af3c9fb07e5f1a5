// Points and colours of a picture: three floats.
#pragma once

#include <cmath>

namespace sim::raster {

struct V3 {
  float x = 0, y = 0, z = 0;

  V3& operator+=(const V3& b) { return *this = {x + b.x, y + b.y, z + b.z}; }
};

inline V3 operator+(const V3& a, const V3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline V3 operator-(const V3& a, const V3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline V3 operator-(const V3& a) { return {-a.x, -a.y, -a.z}; }
inline V3 operator*(float s, const V3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline V3 operator*(const V3& a, const V3& b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
inline float dot(const V3& a, const V3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline V3 cross(const V3& a, const V3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline float length(const V3& a) { return std::sqrt(dot(a, a)); }
// The zero vector stays what it is.
inline V3 unit(const V3& a) {
  const float l = length(a);
  return l > 0 ? (1 / l) * a : a;
}
inline V3 mix(const V3& a, const V3& b, float s) { return a + s * (b - a); }
inline float clamp01(float s) { return s > 0 ? (s < 1 ? s : 1) : 0; }  // 0 for not-a-number

}  // namespace sim::raster
