// A point, direction or force in space. Names are those of Eigen, which plugin authors know.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace sim {

class Vec3 {
 public:
  constexpr Vec3() = default;  // zero
  constexpr Vec3(double x, double y, double z) : at_{x, y, z} {}
  static constexpr Vec3 Zero() { return {}; }
  static constexpr Vec3 Constant(double c) { return {c, c, c}; }

  constexpr const double& operator[](std::size_t axis) const { return at_[axis]; }
  constexpr double& operator[](std::size_t axis) { return at_[axis]; }
  constexpr double x() const { return at_[0]; }
  constexpr double y() const { return at_[1]; }
  constexpr double z() const { return at_[2]; }
  constexpr double& x() { return at_[0]; }
  constexpr double& y() { return at_[1]; }
  constexpr double& z() { return at_[2]; }
  constexpr const double* begin() const { return at_; }
  constexpr const double* end() const { return at_ + 3; }

  constexpr Vec3& operator+=(const Vec3& b) { return *this = *this + b; }
  constexpr Vec3& operator-=(const Vec3& b) { return *this = *this - b; }
  constexpr Vec3& operator*=(double s) { return *this = *this * s; }
  constexpr Vec3& operator/=(double s) { return *this = *this / s; }

  constexpr Vec3 operator-() const { return {-x(), -y(), -z()}; }
  friend constexpr Vec3 operator+(const Vec3& a, const Vec3& b) {
    return {a.x() + b.x(), a.y() + b.y(), a.z() + b.z()};
  }
  friend constexpr Vec3 operator-(const Vec3& a, const Vec3& b) {
    return {a.x() - b.x(), a.y() - b.y(), a.z() - b.z()};
  }
  friend constexpr Vec3 operator*(const Vec3& a, double s) {
    return {a.x() * s, a.y() * s, a.z() * s};
  }
  friend constexpr Vec3 operator*(double s, const Vec3& a) { return a * s; }
  friend constexpr Vec3 operator/(const Vec3& a, double s) {
    return {a.x() / s, a.y() / s, a.z() / s};
  }
  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;

  constexpr double dot(const Vec3& b) const { return x() * b.x() + y() * b.y() + z() * b.z(); }
  constexpr Vec3 cross(const Vec3& b) const {
    return {y() * b.z() - z() * b.y(), z() * b.x() - x() * b.z(), x() * b.y() - y() * b.x()};
  }
  constexpr double squaredNorm() const { return dot(*this); }
  double norm() const { return std::sqrt(squaredNorm()); }
  // The same where squares would overflow or underflow.
  double stableNorm() const {
    const double square = squaredNorm();
    if (square > 1e-290 && square < 1e290) return std::sqrt(square);
    const double scale = cwiseAbs().maxCoeff();
    return scale > 0 && scale < HUGE_VAL ? scale * (*this / scale).norm() : scale;
  }
  Vec3 normalized() const {  // zero stays zero
    const double square = squaredNorm();
    return square > 0 ? *this / std::sqrt(square) : *this;
  }
  Vec3 cwiseAbs() const { return {std::fabs(x()), std::fabs(y()), std::fabs(z())}; }
  constexpr Vec3 cwiseMin(const Vec3& b) const {
    return {std::min(x(), b.x()), std::min(y(), b.y()), std::min(z(), b.z())};
  }
  constexpr Vec3 cwiseMax(const Vec3& b) const {
    return {std::max(x(), b.x()), std::max(y(), b.y()), std::max(z(), b.z())};
  }
  constexpr double maxCoeff() const { return std::max(std::max(x(), y()), z()); }
  bool allFinite() const { return std::isfinite(x()) && std::isfinite(y()) && std::isfinite(z()); }

 private:
  double at_[3] = {};
};

}  // namespace sim
