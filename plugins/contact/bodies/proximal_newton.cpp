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
constexpr double kJointWeight = 100;        // of s: joints are linear
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

Vec3 ProximalNewton::projected(const Point& point, Mat3* slope) {
  if (!(point.scale > 0)) return within_coulomb(point.step_to, point.friction, slope);
  if (slope) *slope = Mat3::Identity();
  return point.step_to;
}

Vec3 ProximalNewton::velocity(const Point& point, std::span<const double> y) const {
  Vec3 w = point.free;
  for (const Side& side : sides_of(point)) {
    const double* const at = &y[BlockLu::kStride * static_cast<std::size_t>(side.node)];
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
  for (const Side& side : sides_of(point)) {
    double* const at = &y[BlockLu::kStride * static_cast<std::size_t>(side.node)];
    double sum[BlockLu::kSize];  // which overlaps nothing, so that this becomes vector code
    for (std::size_t j = 0; j < BlockLu::kSize; ++j)
      sum[j] = ((at[j] + impulse[0] * side.row[0][j]) + impulse[1] * side.row[1][j]) +
               impulse[2] * side.row[2][j];
    std::copy_n(sum, BlockLu::kSize, at);
  }
}

// The metric of the masses: a node has the inverse mass root^2, a body the inverse inertia R R^T.
void ProximalNewton::add_side(Point& point, int node, double inverse_mass, const Vec3 (&along)[3],
                              const Vec3 (&moment)[3]) {
  const double root = std::sqrt(inverse_mass);
  Side& side = sides_.emplace_back();
  side.node = node;
  ++point.count;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 shift = root * along[k];
    const Vec3 turn = static_cast<std::size_t>(node) < root_.size()
                          ? root_[static_cast<std::size_t>(node)] * moment[k]
                          : Vec3();
    for (std::size_t j = 0; j < 3; ++j) side.row[k][j] = shift[j], side.row[k][3 + j] = turn[j];
  }
}

void ProximalNewton::load_contacts(std::span<const SolverBody> bodies,
                                   std::span<const ContactRow> rows) {
  for (const ContactRow& row : rows) {
    Point& point = points_.emplace_back();
    point.sides = sides_.size();
    for (std::size_t s = 0; s < 2; ++s) {
      const int body = s == 0 ? row.first : row.second;
      if (body < 0 || !(row.inverse_mass[s] > 0)) continue;
      const double sign = s == 0 ? 1 : -1;
      Vec3 along[3], moment[3];
      for (std::size_t k = 0; k < 3; ++k) {
        along[k] = sign * row.frame.row(k);
        moment[k] = sign * row.arm[s].cross(row.frame.row(k));
      }
      add_side(point, local_[static_cast<std::size_t>(body)], row.inverse_mass[s], along, moment);
    }
    const Mat3& response = row.point.response;
    point.step = 3 / (response(0, 0) + response(1, 1) + response(2, 2));
    point.friction = row.friction;
    point.impulse = row.impulse;
    add(point, point.impulse, y_);
  }
  for (std::size_t r = 0; r < rows.size(); ++r)
    points_[r].free = rows[r].velocity(bodies) - velocity(points_[r], y_);
}

// Up to three equations of the same members are a point.
void ProximalNewton::load_joints(const JointGroup& group, int& nodes) {
  const std::span<const JointGroup::Member> members = group.members();
  particle_.assign(members.size(), -1);
  const auto node_of = [&](std::size_t m) {
    if (members[m].place >= 0) return local_[static_cast<std::size_t>(members[m].place)];
    if (particle_[m] < 0) particle_[m] = nodes++;
    return particle_[m];
  };
  const RowPattern& pattern = group.pattern();
  for (int r = 0; r < pattern.rows();) {
    const std::span<const int> of = pattern.of(r);
    int end = r + 1;
    while (end < pattern.rows() && end < r + 3 && std::ranges::equal(pattern.of(end), of)) ++end;
    Point& point = points_.emplace_back();
    point.sides = sides_.size();
    double lightest = 0, response = 0;
    for (std::size_t k = 0; k < of.size(); ++k) {
      Vec3 along[3], moment[3];
      for (int row = r; row < end; ++row) {
        const auto at = static_cast<std::size_t>(pattern.begin[static_cast<std::size_t>(row)]) + k;
        along[row - r] = group.terms()[at].along, moment[row - r] = group.terms()[at].moment;
      }
      const auto m = static_cast<std::size_t>(of[k]);
      add_side(point, node_of(m), members[m].inverse_mass, along, moment);
      lightest = std::max(lightest, members[m].inverse_mass);
      for (const auto& row : sides_.back().row)
        for (const double each : row) response += each * each;
    }
    const int equations = end - r;
    r = end;
    if (!(response > 0)) {  // they move nothing here
      sides_.resize(point.sides);
      points_.pop_back();
      continue;
    }
    point.step = equations / response;
    point.scale = std::sqrt(point.step * lightest);
    point.step *= kJointWeight;
    point.free = -velocity(point, y_);  // what the joints allow is at rest to begin with
  }
}

void ProximalNewton::load(std::span<const SolverBody> bodies, const Island& island) {
  rows_ = island.rows;
  local_.assign(bodies.size(), -1);
  root_.resize(island.bodies.size());
  for (std::size_t i = 0; i < island.bodies.size(); ++i) {
    const auto body = static_cast<std::size_t>(island.bodies[i]);
    local_[body] = static_cast<int>(i);
    root_[i] = transposed(cholesky_root(bodies[body].inverse_inertia));
  }
  points_.clear(), sides_.clear();
  auto nodes = static_cast<int>(island.bodies.size());
  for (const std::size_t group : island.groups)
    for (const JointGroup::Member& member : island.joints->group(group).members())
      nodes += member.place < 0;
  y_.assign(BlockLu::kStride * static_cast<std::size_t>(nodes), 0);
  load_contacts(bodies, island.rows);
  auto particle = static_cast<int>(island.bodies.size());
  for (const std::size_t group : island.groups) load_joints(island.joints->group(group), particle);

  pairs_.clear();
  for (const Point& point : points_)
    for (const Side& a : sides_of(point))
      for (const Side& b : sides_of(point))
        if (a.node < b.node) pairs_.push_back({a.node, b.node});
  matrix_.analyse(nodes, pairs_);
  entries_.clear();
  for (Point& point : points_) {
    point.entries = entries_.size();
    for (const Side& a : sides_of(point))
      for (const Side& b : sides_of(point)) entries_.push_back(matrix_.entry(a.node, b.node));
  }
  for (auto* each : {&tried_y_, &rest_, &tried_rest_, &step_, &correction_})
    each->resize(y_.size());
}

// F(y), and how far the proximal step moves p, as a motion.
double ProximalNewton::evaluate(std::span<const double> y, std::span<double> rest) {
  std::ranges::fill(rest, 0.0);
  double moved = 0;
  for (Point& point : points_) {
    const Vec3 w = velocity(point, y);
    point.step_to = point.impulse - weight_ * point.step * w;
    point.tried = projected(point);
    add(point, point.tried, rest);
    moved += (point.tried - point.impulse).squaredNorm() / point.step;
  }
  for (std::size_t k = 0; k < rest.size(); ++k) rest[k] = y[k] - rest[k];
  return std::sqrt(moved) / weight_;
}

// I + s G^T P' G at y_, where F was evaluated last.
void ProximalNewton::fill_matrix() {
  matrix_.clear();
  for (std::size_t i = 0; BlockLu::kStride * i < y_.size(); ++i) {
    const int node = static_cast<int>(i);
    LuBlock& block = matrix_.block(matrix_.entry(node, node));
    for (std::size_t k = 0; k < BlockLu::kSize; ++k) block(k, k) = 1;
  }
  for (const Point& point : points_) {
    if (point.tried == Vec3() && !(point.scale > 0)) continue;
    const double s = weight_ * point.step;
    Mat3 slope;
    projected(point, &slope);
    const std::span<const Side> sides = sides_of(point);
    for (std::size_t b = 0; b < sides.size(); ++b) {
      double product[3][BlockLu::kStride] = {};  // s P' G
      for (std::size_t k = 0; k < 3; ++k)
        for (std::size_t l = 0; l < 3; ++l)
          if (const double factor = s * slope(k, l); factor != 0)  // few are not, without slip
            for (std::size_t j = 0; j < BlockLu::kStride; ++j)
              product[k][j] += factor * sides[b].row[l][j];
      for (std::size_t a = 0; a < sides.size(); ++a)
        matrix_.add_product(entries_[point.entries + sides.size() * a + b], sides[a].row, product);
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
  for (std::size_t r = 0; r < points_.size(); ++r) {
    const Point& point = points_[r];
    const Vec3 w = velocity(point, y_);
    most = std::max(most,
                    point.scale > 0 ? point.scale * w.norm() : rows_[r].residual(w, point.impulse));
  }
  return most;
}

double ProximalNewton::solve(std::span<const SolverBody> bodies, const Island& island,
                             const Goal& goal, const std::function<bool()>& gives_up) {
  load(bodies, island);
  const std::size_t factors = kMostProducts / (matrix_.products() + 1);
  if (factors < kFewFactors) return HUGE_VAL;
  double least = HUGE_VAL, heaviest = kMostWeight, lightest = HUGE_VAL;
  for (const Point& point : points_) lightest = std::min(lightest, point.step);
  const double fine = goal.tolerance * std::sqrt(lightest);  // as a motion
  weight_ = goal.first_weight;
  left_ = static_cast<int>(std::min(goal.factors, factors));
  best_.resize(rows_.size());
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
      for (std::size_t r = 0; r < rows_.size(); ++r) best_[r] = points_[r].impulse;
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
