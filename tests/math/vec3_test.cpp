// Vectors and matrices of three.
#include "core/math/vec3.h"

#include <catch2/catch.hpp>

#include <cmath>
#include <limits>

#include "core/math/mat3.h"

using sim::Mat3;
using sim::Vec3;

TEST_CASE("the length of a vector survives extremes") {
  for (const double scale : {1e-310, 1e-200, 1e-3, 1.0, 1e200, 5e307}) {
    CHECK(Vec3(2 * scale, -scale, 2 * scale).stableNorm() == Approx(3 * scale).epsilon(1e-12));
    CHECK(Vec3(0, -scale, 0).stableNorm() == scale);
  }
  CHECK(Vec3(1, 2, 3).stableNorm() == Vec3(1, 2, 3).norm());
  CHECK(Vec3::Zero().stableNorm() == 0);
  CHECK(Vec3(1, -HUGE_VAL, 0).stableNorm() == HUGE_VAL);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const Vec3& v : {Vec3(nan, 1, 2), Vec3(1, nan, 2), Vec3(1, 2, nan)}) {
    CHECK(std::isnan(v.stableNorm()));
    CHECK_FALSE(v.allFinite());
  }
  CHECK(Vec3::Zero().normalized() == Vec3::Zero());
}

TEST_CASE("products of vectors and matrices") {
  const Vec3 a(1, 2, 3), b(-2, 0.5, 4);
  CHECK(a.dot(b) == 11);
  CHECK(a.cross(b) == Vec3(6.5, -10, 4.5));
  const Mat3 m(a, b, {0, 1, -1});  // by rows
  CHECK(m(1, 2) == 4);
  CHECK(m * a == Vec3(14, 11, -1));
  CHECK(outer(a, b) * a == a * b.dot(a));
  CHECK(cross_matrix(a) * b == a.cross(b));
  CHECK((m * outer(a, b)) * b == (m * a) * b.dot(b));
  CHECK(Mat3::Identity() * 2 - Mat3::Diagonal({2, 2, 1}) == Mat3::Diagonal({0, 0, 1}));
}

// Rounding tells (x + y) + z from x + (y + z): the first two rows are the one, the last is the
// other.
TEST_CASE("a matrix times a vector is summed in the order that results are held to") {
  const Vec3 row(1e16, -1e16, 1);
  CHECK(Mat3(row, row, row) * Vec3(1, 1, 1) == Vec3(1, 1, 0));
}
