// A matrix of 3 x 3 numbers, as blocks of Jacobians are. Names are those of Eigen.
#pragma once

#include "core/math/vec3.h"

namespace sim {

class Mat3 {
 public:
  constexpr Mat3() = default;  // zero
  static constexpr Mat3 Zero() { return {}; }
  static constexpr Mat3 Identity() { return Diagonal({1, 1, 1}); }
  static constexpr Mat3 Diagonal(const Vec3& d) {
    return {{d[0], 0, 0}, {0, d[1], 0}, {0, 0, d[2]}};
  }
  // By rows.
  constexpr Mat3(const Vec3& a, const Vec3& b, const Vec3& c) : rows_{a, b, c} {}
  constexpr const Vec3& row(std::size_t k) const { return rows_[k]; }
  constexpr Vec3 column(std::size_t k) const { return {rows_[0][k], rows_[1][k], rows_[2][k]}; }

  constexpr double operator()(std::size_t row, std::size_t column) const {
    return rows_[row][column];
  }
  constexpr double& operator()(std::size_t row, std::size_t column) { return rows_[row][column]; }

  constexpr Mat3& operator+=(const Mat3& b) { return *this = *this + b; }
  constexpr Mat3& operator-=(const Mat3& b) { return *this = *this - b; }
  constexpr Mat3& operator*=(double s) { return *this = *this * s; }

  constexpr Mat3 operator-() const { return {-rows_[0], -rows_[1], -rows_[2]}; }
  friend constexpr Mat3 operator+(const Mat3& a, const Mat3& b) {
    return {a.rows_[0] + b.rows_[0], a.rows_[1] + b.rows_[1], a.rows_[2] + b.rows_[2]};
  }
  friend constexpr Mat3 operator-(const Mat3& a, const Mat3& b) {
    return {a.rows_[0] - b.rows_[0], a.rows_[1] - b.rows_[1], a.rows_[2] - b.rows_[2]};
  }
  friend constexpr Mat3 operator*(const Mat3& a, double s) {
    return {a.rows_[0] * s, a.rows_[1] * s, a.rows_[2] * s};
  }
  friend constexpr Mat3 operator*(double s, const Mat3& a) { return a * s; }
  friend constexpr Mat3 operator/(const Mat3& a, double s) {
    return {a.rows_[0] / s, a.rows_[1] / s, a.rows_[2] / s};
  }
  // The last row is summed in another order than the first two; results are held to these bits.
  friend constexpr Vec3 operator*(const Mat3& a, const Vec3& b) {
    const Vec3& last = a.rows_[2];
    return {a.rows_[0].dot(b), a.rows_[1].dot(b),
            last[0] * b[0] + (last[1] * b[1] + last[2] * b[2])};
  }
  friend constexpr Mat3 operator*(const Mat3& a, const Mat3& b) {
    Mat3 product;
    for (int column = 0; column < 3; ++column) {
      const Vec3 sums = a * Vec3(b(0, column), b(1, column), b(2, column));
      for (int row = 0; row < 3; ++row) product(row, column) = sums[row];
    }
    return product;
  }
  friend constexpr bool operator==(const Mat3&, const Mat3&) = default;

 private:
  Vec3 rows_[3];
};

// It also makes a matrix of columns from one that was given them as rows.
constexpr Mat3 transposed(const Mat3& m) { return {m.column(0), m.column(1), m.column(2)}; }

// a b^T.
constexpr Mat3 outer(const Vec3& a, const Vec3& b) { return {a[0] * b, a[1] * b, a[2] * b}; }

// m x = u x x for every x.
constexpr Mat3 cross_matrix(const Vec3& u) {
  return {{0, -u[2], u[1]}, {u[2], 0, -u[0]}, {-u[1], u[0], 0}};
}

}  // namespace sim
