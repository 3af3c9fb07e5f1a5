#include "proximal_newton.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr int kMostSteps = 150;    // proximal ones
constexpr int kMostNewton = 25;    // of one step
constexpr int kQuick = 6;          // Newton iterations after which s may grow
constexpr int kMostHalvings = 10;  // of an iteration
constexpr double kLeastWeight = 1, kMostWeight = 1e7;
constexpr double kGrows = 2, kShrinks = 0.25;
constexpr double kWorse = 4;                // times the least residual, by rounding: s is too large
constexpr double kInexact = 0.1;            // of the change of p: what F may be off by
constexpr double kFine = 1e-3;              // of the tolerance: the same
constexpr double kMotionRounding = 1e-13;   // of |y|
constexpr double kImpulseRounding = 3e-16;  // of |y|, times the weight of s
constexpr std::size_t kMostProducts = 8'000'000;  // of blocks, by all factors
constexpr std::size_t kFewFactors = 60;           // fewer hardly solve anything

double norm(std::span<const double> x) {
  double sum = 0;
  for (const double each : x) sum += each * each;
  return std::sqrt(sum);
}

}  // namespace

Vec3 ProximalNewton::velocity(const Point& point, std::span<const double> y) const {
  Vec3 w = point.free;
  for (const Side& side : point.side) {
    if (side.body < 0) continue;
    const double* const at = &y[BlockLu::kSize * static_cast<std::size_t>(side.body)];
    for (std::size_t k = 0; k < 3; ++k) {
      const double* const row = side.row[k];
      w[k] += (row[0] * at[0] + row[1] * at[1] + row[2] * at[2]) +
              (row[3] * at[3] + row[4] * at[4] + row[5] * at[5]);
    }
  }
  return w;
}

// y += G^T of a point times its impulse.
void ProximalNewton::add(const Point& point, const Vec3& impulse, std::span<double> y) const {
  for (const Side& side : point.side) {
    if (side.body < 0) continue;
    double* const at = &y[BlockLu::kSize * static_cast<std::size_t>(side.body)];
    double sum[BlockLu::kSize];  // which overlaps nothing, so that this becomes vector code
    for (std::size_t j = 0; j < BlockLu::kSize; ++j)
      sum[j] = ((at[j] + impulse[0] * side.row[0][j]) + impulse[1] * side.row[1][j]) +
               impulse[2] * side.row[2][j];
    std::copy_n(sum, BlockLu::kSize, at);
  }
}

void ProximalNewton::load(std::span<const SolverBody> bodies, std::span<const ContactRow> rows,
                          std::span<const int> moving) {
  rows_ = rows;
  local_.assign(bodies.size(), -1);
  root_.resize(moving.size());
  for (std::size_t i = 0; i < moving.size(); ++i) {
    const auto body = static_cast<std::size_t>(moving[i]);
    local_[body] = static_cast<int>(i);
    root_[i] = transposed(cholesky_root(bodies[body].inverse_inertia));
  }
  points_.resize(rows.size());
  y_.assign(BlockLu::kSize * moving.size(), 0);
  pairs_.clear();
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const ContactRow& row = rows[r];
    Point& point = points_[r] = {};
    for (std::size_t s = 0; s < 2; ++s) {
      const int body = s == 0 ? row.first : row.second;
      if (body < 0 || !(row.inverse_mass[s] > 0)) continue;
      Side& side = point.side[s];
      side.body = local_[static_cast<std::size_t>(body)];
      const double sign = s == 0 ? 1 : -1, root = sign * std::sqrt(row.inverse_mass[s]);
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 along = root * row.frame.row(k);
        const Vec3 turn = sign * (root_[static_cast<std::size_t>(side.body)] *
                                  row.arm[s].cross(row.frame.row(k)));
        for (std::size_t j = 0; j < 3; ++j) side.row[k][j] = along[j], side.row[k][3 + j] = turn[j];
      }
    }
    const Mat3& response = row.point.response;
    point.step = 3 / (response(0, 0) + response(1, 1) + response(2, 2));
    point.impulse = row.impulse;
    add(point, point.impulse, y_);
    if (point.side[0].body >= 0 && point.side[1].body >= 0)
      pairs_.push_back({point.side[0].body, point.side[1].body});
  }
  for (std::size_t r = 0; r < rows.size(); ++r) {
    Point& point = points_[r];
    point.free = {};
    point.free = rows[r].velocity(bodies) - velocity(point, y_);
  }
  matrix_.analyse(static_cast<int>(moving.size()), pairs_);
  for (Point& point : points_)
    for (std::size_t a = 0; a < 2; ++a)
      for (std::size_t b = 0; b < 2; ++b)
        if (point.side[a].body >= 0 && point.side[b].body >= 0)
          point.entry[2 * a + b] = matrix_.entry(point.side[a].body, point.side[b].body);
  for (auto* each : {&tried_y_, &rest_, &tried_rest_, &step_, &correction_})
    each->resize(y_.size());
}

// F(y), and how far the proximal step moves p, as a motion.
double ProximalNewton::evaluate(std::span<const double> y, std::span<double> rest) {
  std::ranges::fill(rest, 0.0);
  double moved = 0;
  for (std::size_t r = 0; r < points_.size(); ++r) {
    Point& point = points_[r];
    const Vec3 w = velocity(point, y);
    point.step_to = point.impulse - weight_ * point.step * w;
    point.tried = within_coulomb(point.step_to, rows_[r].friction);
    add(point, point.tried, rest);
    moved += (point.tried - point.impulse).squaredNorm() / point.step;
  }
  for (std::size_t k = 0; k < rest.size(); ++k) rest[k] = y[k] - rest[k];
  return std::sqrt(moved) / weight_;
}

// I + s G^T P' G at y_, where F was evaluated last.
void ProximalNewton::fill_matrix() {
  matrix_.clear();
  for (std::size_t i = 0; BlockLu::kSize * i < y_.size(); ++i) {
    const int node = static_cast<int>(i);
    BlockLu::Block& block = matrix_.block(matrix_.entry(node, node));
    for (std::size_t k = 0; k < BlockLu::kSize; ++k) block[(BlockLu::kSize + 1) * k] = 1;
  }
  for (std::size_t r = 0; r < points_.size(); ++r) {
    const Point& point = points_[r];
    if (point.tried == Vec3()) continue;
    const double s = weight_ * point.step;
    Mat3 slope;
    within_coulomb(point.step_to, rows_[r].friction, &slope);
    for (std::size_t b = 0; b < 2; ++b) {
      const Side& with = point.side[b];
      if (with.body < 0) continue;
      double product[3][BlockLu::kSize] = {};  // s P' G
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t l = 0; l < 3; ++l)
          if (const double factor = s * slope(k, l); factor != 0)  // few are not, without slip
            for (std::size_t j = 0; j < BlockLu::kSize; ++j)
              product[k][j] += factor * with.row[l][j];
      for (std::size_t a = 0; a < 2; ++a) {
        const Side& side = point.side[a];
        if (side.body < 0) continue;
        BlockLu::Block& block = matrix_.block(point.entry[2 * a + b]);
        for (std::size_t i = 0; i < BlockLu::kSize; ++i) {
          const double n = side.row[0][i], u = side.row[1][i], v = side.row[2][i];
          double* const to = &block[BlockLu::kSize * i];
          for (std::size_t j = 0; j < BlockLu::kSize; ++j)
            to[j] = ((to[j] + n * product[0][j]) + u * product[1][j]) + v * product[2][j];
        }
      }
    }
  }
}

// Solves F(y) = 0 by Newton's method. A step is halved until the next one, with the same matrix,
// would be shorter: this natural test is the same for all scales of the unknowns (Deuflhard (2004),
// Newton Methods for Nonlinear Problems, section 3.3).
bool ProximalNewton::find_motion(double tolerance, const std::function<bool()>& gives_up) {
  double moved = evaluate(y_, rest_);
  for (solves_ = 0; solves_ < kMostNewton && left_ > 0 && !gives_up(); ++solves_, --left_) {
    const double off = norm(rest_);
    const double rounding = (kMotionRounding + kImpulseRounding * weight_) * norm(y_);
    if (off <= std::max({rounding, kFine * tolerance, kInexact * moved})) return true;
    fill_matrix();
    if (!matrix_.factorise()) return false;
    step_ = rest_;
    matrix_.solve(step_);
    const double size = norm(step_);
    double share = 1;
    for (int halving = 0;; ++halving, share *= 0.5) {
      if (halving == kMostHalvings || !std::isfinite(size)) return false;
      for (std::size_t k = 0; k < y_.size(); ++k) tried_y_[k] = y_[k] - share * step_[k];
      moved = evaluate(tried_y_, tried_rest_);
      if (norm(tried_rest_) <= 0.25 * off) break;
      correction_ = tried_rest_;
      matrix_.solve(correction_);
      if (norm(correction_) <= (1 - 0.25 * share) * size) break;
    }
    y_.swap(tried_y_);
    rest_.swap(tried_rest_);
  }
  return false;
}

// The residual of the impulses p_k, which move the bodies by y_.
double ProximalNewton::residual() const {
  double most = 0;
  for (std::size_t r = 0; r < points_.size(); ++r)
    most = std::max(most, rows_[r].residual(velocity(points_[r], y_), points_[r].impulse));
  return most;
}

double ProximalNewton::solve(std::span<const SolverBody> bodies, std::span<const ContactRow> rows,
                             std::span<const int> moving, const Goal& goal,
                             const std::function<bool()>& gives_up) {
  load(bodies, rows, moving);
  const std::size_t factors = kMostProducts / (matrix_.products() + 1);
  if (factors < kFewFactors) return HUGE_VAL;
  double least = HUGE_VAL, heaviest = kMostWeight, lightest = HUGE_VAL;
  for (const Point& point : points_) lightest = std::min(lightest, point.step);
  const double fine = goal.tolerance * std::sqrt(lightest);  // as a motion
  weight_ = goal.first_weight;
  left_ = static_cast<int>(std::min(goal.factors, factors));
  best_.resize(points_.size());
  for (int step = 0; step < kMostSteps && left_ > 0 && !gives_up(); ++step) {
    begin_ = y_;
    if (!find_motion(fine, gives_up)) {
      if (!(weight_ > kLeastWeight)) break;
      weight_ = std::max(kLeastWeight, kShrinks * weight_);
      y_ = begin_;
      continue;
    }
    std::ranges::fill(y_, 0.0);
    for (Point& point : points_) {
      point.impulse = point.tried;
      add(point, point.impulse, y_);
    }
    const double now = residual();
    if (now < least) {
      least = now;
      for (std::size_t r = 0; r < points_.size(); ++r) best_[r] = points_[r].impulse;
    }
    if (now <= goal.tolerance) break;
    if (now > kWorse * least && kImpulseRounding * weight_ * norm(y_) > fine)
      weight_ = heaviest = std::max(kLeastWeight, kShrinks * weight_);
    else if (solves_ <= kQuick)
      weight_ = std::min(heaviest, kGrows * weight_);
  }
  return least;
}

}  // namespace sim
