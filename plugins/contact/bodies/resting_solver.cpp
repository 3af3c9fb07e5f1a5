#include "resting_solver.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>

#include "anderson.h"
#include "body_joints.h"

namespace sim {
namespace {

constexpr int kMostSweeps = 2000, kPatience = 300;  // of which one must halve the residual
constexpr int kSlow = 60;                           // sweeps between tries of Newton's method
constexpr int kSoon = 4;         // the same with joints, whose sweeps take long, while it converges
constexpr double kCloser = 0.2;  // of the tolerance, for that: a sweep sums what points ask for
// An island that is nearly solved to begin with rests: Newton's method solves it in a few
// factorisations, and so finely that the next steps find nothing to solve.
constexpr double kNearly = 100, kFinely = 1e-3;  // tolerances
constexpr std::size_t kQuickFactors = 20;
constexpr double kQuickWeight = 1000;
constexpr std::size_t kMostWork = 4'000'000;  // rows visited, of one island
constexpr std::size_t kWorthThreads = 256;    // rows and equations
constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();

}  // namespace

void RestingSolver::project(Bodies bodies, const Island& island, JointGroup::What what) {
  for (const std::size_t group : island.groups) joints_->project(bodies, group, what);
}

// Islands are in the order of their first contacts, and in each the contacts in their order.
void RestingSolver::find_islands(Bodies bodies, std::span<const ContactPoint> contacts) {
  const auto moves = [&](int body) {
    return body >= 0 && bodies[static_cast<std::size_t>(body)].inverse_mass > 0;
  };
  joined_.separate(bodies.size());
  for (const ContactPoint& contact : contacts)
    if (contact.active && moves(contact.first) && moves(contact.second))
      joined_.join(contact.first, contact.second);
  const std::size_t groups = joints_ ? joints_->groups() : 0;
  for (std::size_t group = 0; group < groups; ++group) joined_.join(joints_->bodies_of(group));

  island_of_.assign(bodies.size(), -1);
  count_ = 0;
  const auto island_of = [&](const ContactPoint& contact) -> int& {
    const int body = moves(contact.first) ? contact.first : std::max(0, contact.second);
    return island_of_[slot(joined_.root(body))];
  };
  for (const ContactPoint& contact : contacts) {
    if (!contact.active) continue;
    int& island = island_of(contact);
    if (island < 0) {
      island = static_cast<int>(count_++);
      if (islands_.size() < count_) islands_.emplace_back();
      islands_[count_ - 1].end = 0;
      islands_[count_ - 1].bodies.clear();
      islands_[count_ - 1].groups.clear();
    }
    ++islands_[static_cast<std::size_t>(island)].end;
  }
  std::size_t sum = 0;
  for (std::size_t k = 0; k < count_; ++k) {
    const std::size_t rows = islands_[k].end;
    islands_[k].begin = islands_[k].end = sum;
    sum += rows;
  }
  rows_.resize(sum);
  for (std::size_t i = 0; i < contacts.size(); ++i)
    if (contacts[i].active) {
      Island& island = islands_[static_cast<std::size_t>(island_of(contacts[i]))];
      rows_[island.end++].contact = i;
    }
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (moves(static_cast<int>(i)))
      if (const int k = island_of_[slot(joined_.root(static_cast<int>(i)))]; k >= 0)
        islands_[static_cast<std::size_t>(k)].bodies.push_back(static_cast<int>(i));
  for (std::size_t group = 0; group < groups; ++group)
    if (const auto of = joints_->bodies_of(group); !of.empty())
      if (const int k = island_of_[slot(joined_.root(of[0]))]; k >= 0)
        islands_[static_cast<std::size_t>(k)].groups.push_back(group);
}

RestingSolver::Sweep RestingSolver::sweep(Bodies bodies, const Island& island) {
  Sweep sum;
  for (std::size_t r = island.begin; r < island.end; ++r) {
    ContactRow& row = rows_[r];
    const Vec3 w = row.velocity(bodies);
    const Vec3 impulse = coulomb_impulse(row.point, row.friction, w, row.impulse);
    const Vec3 added = impulse - row.impulse;
    const double softness = row.scale[0] * row.scale[0];
    sum.rounding = std::max(sum.rounding, kRounding * softness * impulse[0]);
    if (added == Vec3()) continue;
    row.apply(bodies, added);
    row.impulse = impulse;
    for (std::size_t k = 0; k < 3; ++k)
      sum.residual = std::max(sum.residual, row.scale[k] * row.scale[k] * std::fabs(added[k]));
  }
  if (sum.residual > 0) project(bodies, island, JointGroup::What::kVelocities);
  return sum;
}

// Takes the solution of Newton's method if its residual is below `least`; true if it is the goal.
bool RestingSolver::solve_by_newton(Bodies bodies, const Island& island,
                                    const ProximalNewton::Goal& goal, double least,
                                    ProximalNewton& newton, const std::function<bool()>& gives_up) {
  const std::span<ContactRow> rows =
      std::span(rows_).subspan(island.begin, island.end - island.begin);
  const double left =
      newton.solve(bodies, {rows, island.bodies, island.groups, joints_}, goal, gives_up);
  if (left < least) {
    for (std::size_t r = 0; r < rows.size(); ++r) {
      rows[r].apply(bodies, newton.impulses()[r] - rows[r].impulse);
      rows[r].impulse = newton.impulses()[r];
    }
    project(bodies, island, JointGroup::What::kVelocities);
  }
  return left <= goal.tolerance;
}

double RestingSolver::solve_island(Bodies bodies, Island& island, double tolerance,
                                   ProximalNewton& newton, const std::function<bool()>& gives_up) {
  const std::size_t rows = island.end - island.begin, n = 3 * rows;
  const std::size_t each = Anderson::memory(3);
  const std::span<double> x = std::span(unknowns_).subspan(3 * island.begin, n),
                          g = std::span(images_).subspan(3 * island.begin, n);
  Anderson mixing{std::span(history_).subspan(each * island.begin, each * rows), n};
  const auto read = [&](std::span<double> to) {
    for (std::size_t r = 0; r < rows; ++r)
      for (std::size_t k = 0; k < 3; ++k)
        to[3 * r + k] = rows_[island.begin + r].scale[k] * rows_[island.begin + r].impulse[k];
  };
  const auto put = [&](std::span<const double> from) {
    for (std::size_t r = 0; r < rows; ++r) {
      ContactRow& row = rows_[island.begin + r];
      Vec3 impulse;
      for (std::size_t k = 0; k < 3; ++k) impulse[k] = from[3 * r + k] / row.scale[k];
      row.apply(bodies, impulse - row.impulse);
      row.impulse = impulse;
    }
    project(bodies, island, JointGroup::What::kVelocities);
  };
  const auto most = static_cast<int>(std::min<std::size_t>(kMostSweeps, kMostWork / rows + 1));
  double least = HUGE_VAL, better = HUGE_VAL, closer = kCloser;
  int newton_turn = island.groups.empty() ? kSlow : kSoon;
  project(bodies, island, JointGroup::What::kVelocities);  // impulses that it starts from
  for (int turn = 1, last = most;; ++turn) {
    read(x);
    const Sweep swept = sweep(bodies, island);
    if (swept.residual <= std::max(tolerance, swept.rounding)) return 0;
    const bool best = swept.residual <= least;
    least = std::min(least, swept.residual);
    const bool rests =
        turn == 1 && swept.residual <= kNearly * tolerance && swept.rounding < kFinely * tolerance;
    if ((turn >= newton_turn || rests) && turn < last) {
      if (!best) put(mixing.best());
      const ProximalNewton::Goal goal =
          rests ? ProximalNewton::Goal{kFinely * tolerance, kQuickFactors, kQuickWeight}
                : ProximalNewton::Goal{closer * tolerance};
      const bool solved = solve_by_newton(bodies, island, goal, least, newton, gives_up);
      if (solved) closer = std::max(kFinely, kCloser * closer);
      if (!rests) newton_turn = turn + (solved && !island.groups.empty() ? kSoon : kSlow);
      mixing = Anderson{std::span(history_).subspan(each * island.begin, each * rows), n};
      read(g);
      mixing.begin_at(g);
      continue;
    }
    if (turn >= last || gives_up()) {
      // Mixing may have led far away from the best state.
      if (!best) put(mixing.best());
      return least;
    }
    if (least < 0.5 * better) {
      better = least;
      last = std::min(most, turn + kPatience);
    }
    read(g);
    mixing.mix(x, g);
    put(g);
  }
}

double RestingSolver::solve(Bodies bodies, std::span<ContactPoint> contacts, double tolerance,
                            ThreadPool& pool) {
  find_islands(bodies, contacts);
  unknowns_.resize(3 * rows_.size());
  images_.resize(3 * rows_.size());
  history_.resize(Anderson::memory(3) * rows_.size());
  residuals_.assign(count_, 0);
  newtons_.resize(static_cast<std::size_t>(pool.size()));
  std::atomic<std::size_t> next = 0;
  const auto solve_some = [&](int rank) {
    const std::function<bool()> gives_up = [&pool, rank] { return pool.gives_up(rank); };
    for (std::size_t k; (k = next++) < count_;) {
      Island& island = islands_[k];
      for (std::size_t r = island.begin; r < island.end; ++r)
        std::construct_at(&rows_[r], bodies, contacts[rows_[r].contact], rows_[r].contact);
      residuals_[k] = solve_island(bodies, island, tolerance,
                                   newtons_[static_cast<std::size_t>(rank)], gives_up);
      store(bodies, island, contacts);
      project(bodies, island, JointGroup::What::kDisplacements);
    }
  };
  const std::span<const Island> islands = std::span(islands_).first(count_);
  std::size_t equations = 0;
  for (const Island& island : islands)
    for (const std::size_t group : island.groups) equations += joints_->group(group).rows().size();
  if (count_ > 1 && rows_.size() + equations >= kWorthThreads)
    pool.run(solve_some);
  else
    solve_some(0);
  return count_ > 0 ? *std::ranges::max_element(residuals_) : 0;
}

void RestingSolver::store(Bodies bodies, const Island& island,
                          std::span<ContactPoint> contacts) const {
  for (const ContactRow& row : std::span(rows_).subspan(island.begin, island.end - island.begin)) {
    ContactPoint& m = contacts[row.contact];
    const Vec3 added =
        row.impulse - Vec3(m.normal_impulse, m.tangent_impulse[0], m.tangent_impulse[1]);
    if (added != Vec3()) row.move(bodies, added, m.duration);
    m.normal_impulse = row.impulse[0];
    m.tangent_impulse[0] = row.impulse[1], m.tangent_impulse[1] = row.impulse[2];
  }
}

}  // namespace sim
