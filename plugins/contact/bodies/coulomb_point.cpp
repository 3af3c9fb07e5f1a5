#include "coulomb_point.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr int kMostTurns = 24;
constexpr double kSingular = 1e-12;   // of the product of the diagonal
constexpr double kJammed = 1e-3;      // of W_nn: the least response under friction
constexpr double kDirection = 1e-8;   // of a radian: its square is rounding
constexpr double kLongestTurn = 0.7;  // of tan(angle / 2)

// A slipping point with friction along (c, s): p_n from w_n = 0, and the slip.
struct Slip {
  double softness = 0, push = 0, along = 0, across = 0;  // 1/kg, N s, and of w_t, m/s
  double across_rate = 0;                                // m/s per radian
};

Slip slip_along(const Mat3& W, double friction, const Vec3& free, double c, double s) {
  Slip slip;
  const double turned = friction * (W(0, 2) * c - W(0, 1) * s);
  slip.softness = W(0, 0) + friction * (W(0, 1) * c + W(0, 2) * s);
  slip.push = -free[0] / slip.softness;
  const double added = -slip.push * turned / slip.softness;
  const auto rate = [&](std::size_t k) { return W(k, 0) + friction * (W(k, 1) * c + W(k, 2) * s); };
  const auto bend = [&](std::size_t k) { return friction * (W(k, 2) * c - W(k, 1) * s); };
  const double u = free[1] + slip.push * rate(1), v = free[2] + slip.push * rate(2);
  const double du = added * rate(1) + slip.push * bend(1),
               dv = added * rate(2) + slip.push * bend(2);
  slip.along = c * u + s * v;
  slip.across = c * v - s * u;
  slip.across_rate = c * dv - s * du - slip.along;
  return slip;
}

// With friction along e the normal equation gives p_n(e), and this the slip w_t(e), to which
// friction must be opposite: e x w_t = 0 and e . w_t < 0.
class SlipDirection {
 public:
  SlipDirection(const Mat3& response, double friction, const Vec3& free)
      : response_(response), friction_(friction), free_(free) {}

  // Newton's method from a direction near the solution; false if it does not converge.
  bool find_near(double c, double s) {
    for (int turn = 0; turn < kMostTurns; ++turn) {
      const Slip slip = set(c, s);
      if (!(slip.softness > kJammed * response_(0, 0)) || !(slip.along < 0) ||
          !(slip.across_rate > 0))
        return false;
      const double turned = -slip.across / slip.across_rate;
      if (std::fabs(turned) < kDirection) {
        set(c_ - turned * s_, s_ + turned * c_);
        return true;
      }
      // A rotation by the angle, to third order.
      const double half = std::clamp(0.5 * turned, -kLongestTurn, kLongestTurn);
      c = (1 - half * half) * c_ - 2 * half * s_;
      s = (1 - half * half) * s_ + 2 * half * c_;
    }
    return false;
  }

  // Bisection in the first of some sectors in which e x w_t rises through 0.
  bool find_anywhere() {
    constexpr int kSectors = 16;
    constexpr double kCos = 0.92387953251128674, kSin = 0.38268343236508977;  // of 1/16 of a turn
    double c = 1, s = 0;
    Slip from = set(c, s);
    for (int k = 0; k < kSectors; ++k) {
      const double next_c = kCos * c - kSin * s, next_s = kCos * s + kSin * c;
      const Slip to = set(next_c, next_s);
      const double stiff = kJammed * response_(0, 0);
      if (from.softness > stiff && to.softness > stiff && from.across <= 0 && to.across > 0 &&
          bisect(c, s, next_c, next_s))
        return true;
      c = next_c, s = next_s, from = to;
    }
    return false;
  }

  Vec3 impulse() const { return {push_, friction_ * push_ * c_, friction_ * push_ * s_}; }

 private:
  Slip set(double c, double s) {
    const double size = std::sqrt(c * c + s * s);
    c_ = c / size, s_ = s / size;
    const Slip slip = slip_along(response_, friction_, free_, c_, s_);
    push_ = slip.push;
    return slip;
  }
  bool bisect(double c0, double s0, double c1, double s1) {
    constexpr int kHalves = 52;
    double along = 0;
    for (int k = 0; k < kHalves; ++k) {
      const Slip slip = set(c0 + c1, s0 + s1);
      along = slip.along;
      if (slip.across > 0)
        c1 = c_, s1 = s_;
      else
        c0 = c_, s0 = s_;
    }
    return along <= 0;
  }

  Mat3 response_;
  double friction_, c_ = 1, s_ = 0, push_ = 0;
  Vec3 free_;
};

}  // namespace

Vec3 within_coulomb(const Vec3& a, double friction, Mat3* slope) {
  if (slope) *slope = {};
  if (!(a[0] > 0)) return {};
  if (slope) (*slope)(0, 0) = 1;
  if (!(friction > 0)) return {a[0], 0, 0};
  const double size = std::sqrt(a[1] * a[1] + a[2] * a[2]), most = friction * a[0];
  if (size <= most) {
    if (slope) *slope = Mat3::Identity();
    return a;
  }
  const double c = a[1] / size, s = a[2] / size, share = most / size;
  if (slope) {
    (*slope)(1, 0) = friction * c, (*slope)(2, 0) = friction * s;
    (*slope)(1, 1) = share * s * s, (*slope)(2, 2) = share * c * c;
    (*slope)(1, 2) = (*slope)(2, 1) = -share * c * s;
  }
  return {a[0], most * c, most * s};
}

Mat3 cholesky_root(const Mat3& m) {
  Mat3 root;
  for (std::size_t j = 0; j < 3; ++j)
    for (std::size_t i = j; i < 3; ++i) {
      double sum = m(i, j);
      for (std::size_t k = 0; k < j; ++k) sum -= root(i, k) * root(j, k);
      if (i == j)
        root(j, j) = sum > 0 ? std::sqrt(sum) : 0;
      else
        root(i, j) = root(j, j) > 0 ? sum / root(j, j) : 0;
    }
  return root;
}

PointResponse PointResponse::of(const Mat3& W) {
  PointResponse point{.response = W};
  const Vec3 a = {W(0, 0), W(0, 1), W(0, 2)}, b = {W(1, 0), W(1, 1), W(1, 2)},
             c = {W(2, 0), W(2, 1), W(2, 2)};
  const double determinant = a.dot(b.cross(c));
  point.regular = determinant > kSingular * W(0, 0) * W(1, 1) * W(2, 2);
  if (point.regular)
    point.inverse = 1 / determinant * transposed({b.cross(c), c.cross(a), a.cross(b)});
  return point;
}

Vec3 coulomb_impulse(const PointResponse& of, double friction, const Vec3& w, const Vec3& p) {
  const Mat3& W = of.response;
  const Vec3 free = w - W * p;
  if (free[0] >= 0) return {};
  if (!(friction > 0)) return {-free[0] / W(0, 0), 0, 0};
  if (of.regular) {
    const Vec3 stuck = p - of.inverse * w;
    const double most = friction * stuck[0];
    if (stuck[0] >= 0 && stuck[1] * stuck[1] + stuck[2] * stuck[2] <= most * most) return stuck;
  }
  SlipDirection direction(W, friction, free);
  const bool slipped = p[1] != 0 || p[2] != 0;
  const double c = slipped ? p[1] : -free[1], s = slipped ? p[2] : -free[2];
  if ((c != 0 || s != 0) && direction.find_near(c, s)) return direction.impulse();
  if (slipped && (free[1] != 0 || free[2] != 0) && direction.find_near(-free[1], -free[2]))
    return direction.impulse();
  if (direction.find_anywhere()) return direction.impulse();
  const double step = 1 / (W(0, 0) + W(1, 1) + W(2, 2));
  return within_coulomb(p - step * w, friction);
}

}  // namespace sim
