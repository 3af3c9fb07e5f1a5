#include "resting_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "anderson.h"

namespace sim {
namespace {

constexpr int kMostSweeps = 2000, kPatience = 300;  // of which one must halve the residual
constexpr int kFewSweeps = 12;  // before points that stick are solved together, twice as many
                                // after each time that this did no good
constexpr std::size_t kMostWork = 4'000'000;  // rows visited, of one island
constexpr std::size_t kWorthThreads = 256;    // rows
constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();

double tangent(const Vec3& impulse) {
  return std::sqrt(impulse[1] * impulse[1] + impulse[2] * impulse[2]);
}

}  // namespace

// d.(v1 - v2) + (arm1 x d).w1 - (arm2 x d).w2 of each direction.
Vec3 RestingSolver::velocity(std::span<const SolverBody> bodies, const Row& row) {
  const SolverBody& a = bodies[static_cast<std::size_t>(row.first)];
  Vec3 w;
  for (std::size_t k = 0; k < 3; ++k) {
    const Direction& d = row.direction[k];
    w[k] = d.along.dot(a.velocity) + d.moment[0].dot(a.angular_velocity) - d.ground;
  }
  if (row.second < 0) return w;
  const SolverBody& b = bodies[static_cast<std::size_t>(row.second)];
  for (std::size_t k = 0; k < 3; ++k) {
    const Direction& d = row.direction[k];
    w[k] -= d.along.dot(b.velocity) + d.moment[1].dot(b.angular_velocity);
  }
  return w;
}

void RestingSolver::apply(Bodies bodies, const Row& row, const Vec3& impulse) {
  const Direction* const d = row.direction;
  const Vec3 whole = impulse[0] * d[0].along + impulse[1] * d[1].along + impulse[2] * d[2].along;
  const auto turn = [&](std::size_t side) {
    return impulse[0] * d[0].turn[side] + impulse[1] * d[1].turn[side] +
           impulse[2] * d[2].turn[side];
  };
  if (row.inverse_mass[0] > 0) {
    SolverBody& a = bodies[static_cast<std::size_t>(row.first)];
    a.velocity += row.inverse_mass[0] * whole;
    a.angular_velocity += turn(0);
  }
  if (row.inverse_mass[1] > 0) {
    SolverBody& b = bodies[static_cast<std::size_t>(row.second)];
    b.velocity -= row.inverse_mass[1] * whole;
    b.angular_velocity -= turn(1);
  }
}

int RestingSolver::root_of(int body) {
  auto at = static_cast<std::size_t>(body);
  while (parent_[at] != static_cast<int>(at)) {
    parent_[at] = parent_[static_cast<std::size_t>(parent_[at])];
    at = static_cast<std::size_t>(parent_[at]);
  }
  return static_cast<int>(at);
}

void RestingSolver::add_row(Bodies bodies, const ContactPoint& contact, std::size_t index,
                            Row& row) const {
  row.first = contact.first, row.second = contact.second, row.contact = index;
  const Vec3 directions[3] = {contact.normal, contact.u, contact.v};
  for (std::size_t k = 0; k < 3; ++k) {
    Direction& d = row.direction[k] = {};
    d.along = directions[k];
    const auto turn = [&](std::size_t side, int body, const Vec3& arm) {
      const SolverBody& of = bodies[static_cast<std::size_t>(body)];
      row.inverse_mass[side] = of.inverse_mass;
      d.moment[side] = arm.cross(d.along);
      d.turn[side] = of.inverse_inertia * d.moment[side];
    };
    row.inverse_mass[1] = 0;
    turn(0, contact.first, contact.arm1);
    if (contact.second >= 0)
      turn(1, contact.second, contact.arm2);
    else
      d.ground = d.along.dot(contact.ground);
  }
  Mat3 response;
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t l = 0; l < 3; ++l) {
      const Direction &a = row.direction[k], &b = row.direction[l];
      response(static_cast<int>(k), static_cast<int>(l)) =
          (k == l ? row.inverse_mass[0] + row.inverse_mass[1] : 0) + a.moment[0].dot(b.turn[0]) +
          a.moment[1].dot(b.turn[1]);
    }
  row.point = PointResponse::of(response);
  for (int k = 0; k < 3; ++k) row.scale[static_cast<std::size_t>(k)] = std::sqrt(response(k, k));
  row.friction = contact.friction, row.offset = contact.offset;
  row.impulse = {contact.normal_impulse, contact.tangent_impulse[0], contact.tangent_impulse[1]};
}

// Islands in the order of their first contacts, and in each the contacts in their order.
void RestingSolver::find_islands(Bodies bodies, std::span<const ContactPoint> contacts) {
  const auto moves = [&](int body) {
    return body >= 0 && bodies[static_cast<std::size_t>(body)].inverse_mass > 0;
  };
  parent_.resize(bodies.size());
  for (std::size_t i = 0; i < bodies.size(); ++i) parent_[i] = joints_ ? 0 : static_cast<int>(i);
  if (!joints_)
    for (const ContactPoint& contact : contacts)
      if (contact.active && moves(contact.first) && moves(contact.second)) {
        const auto [low, high] = std::minmax({root_of(contact.first), root_of(contact.second)});
        parent_[static_cast<std::size_t>(high)] = low;
      }

  island_of_.assign(bodies.size(), -1);
  count_ = 0;
  const auto island_of = [&](const ContactPoint& contact) -> int& {
    const int body = moves(contact.first) ? contact.first : std::max(0, contact.second);
    return island_of_[static_cast<std::size_t>(root_of(body))];
  };
  for (const ContactPoint& contact : contacts) {
    if (!contact.active) continue;
    int& island = island_of(contact);
    if (island < 0) {
      island = static_cast<int>(count_++);
      if (islands_.size() < count_) islands_.emplace_back();
      islands_[count_ - 1].end = 0;
      islands_[count_ - 1].bodies.clear();
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
      add_row(bodies, contacts[i], i, rows_[island.end++]);
    }
  for (std::size_t i = 0; i < bodies.size(); ++i)
    if (moves(static_cast<int>(i)))
      if (const int k = island_of_[static_cast<std::size_t>(root_of(static_cast<int>(i)))]; k >= 0)
        islands_[static_cast<std::size_t>(k)].bodies.push_back(static_cast<int>(i));
}

RestingSolver::Sweep RestingSolver::sweep(Bodies bodies, const Island& island) {
  Sweep sum;
  for (std::size_t r = island.begin; r < island.end; ++r) {
    Row& row = rows_[r];
    const Vec3 w = velocity(bodies, row) + Vec3(row.offset, 0, 0);
    const Vec3 impulse = coulomb_impulse(row.point, row.friction, w, row.impulse);
    const Vec3 added = impulse - row.impulse;
    const double softness = row.scale[0] * row.scale[0];
    sum.rounding = std::max(sum.rounding, kRounding * softness * impulse[0]);
    if (added == Vec3()) continue;
    apply(bodies, row, added);
    row.impulse = impulse;
    for (std::size_t k = 0; k < 3; ++k)
      sum.residual = std::max(sum.residual, row.scale[k] * row.scale[k] * std::fabs(added[k]));
  }
  if (joints_ && sum.residual > 0) joints_->project(bodies, false);
  return sum;
}

void RestingSolver::change(Bodies bodies, Row& row, const Vec3& impulse) {
  if (impulse == row.impulse) return;
  apply(bodies, row, impulse - row.impulse);
  row.impulse = impulse;
}

// Points that press go on pressing and those that stick go on sticking: linear equations, singular
// where more points hold a body than are needed, but consistent. Conjugate gradients (Hestenes &
// Stiefel 1952), preconditioned with the response of each point; what leaves Coulomb's cone is put
// back to it.
void RestingSolver::solve_sticking(Bodies bodies, const Island& island, double tolerance) {
  const auto parts = [](const Search& s, const Vec3& w) {
    return Vec3(s.normal ? w[0] : 0, s.friction ? w[1] : 0, s.friction ? w[2] : 0);
  };
  const auto scaled = [](const Row& row, const Vec3& r) {
    return Vec3(r[0] / (row.scale[0] * row.scale[0]), r[1] / (row.scale[1] * row.scale[1]),
                r[2] / (row.scale[2] * row.scale[2]));
  };
  const auto still = [&] {
    for (const int i : island.bodies)
      scratch_[static_cast<std::size_t>(i)].velocity =
          scratch_[static_cast<std::size_t>(i)].angular_velocity = {};
  };
  for (const int i : island.bodies)
    saved_[static_cast<std::size_t>(i)] = bodies[static_cast<std::size_t>(i)];
  double energy = 0;
  for (std::size_t r = island.begin; r < island.end; ++r) {
    const Row& row = rows_[r];
    Search& s = search_[r] = {};
    s.before = row.impulse;
    s.normal = row.impulse[0] > 0;
    s.friction = s.normal && tangent(row.impulse) < (1 - 1e-9) * row.friction * row.impulse[0];
    if (!s.normal) continue;
    s.rest = -parts(s, velocity(bodies, row) + Vec3(row.offset, 0, 0));
    s.direction = scaled(row, s.rest);
    energy += s.rest.dot(s.direction);
  }
  const std::size_t most = 6 * island.bodies.size() + 20;
  for (std::size_t turn = 0; turn < most && energy > 0; ++turn) {
    still();
    for (std::size_t r = island.begin; r < island.end; ++r)
      if (search_[r].normal) apply(scratch_, rows_[r], search_[r].direction);
    if (joints_) joints_->project(scratch_, true);
    double bend = 0, largest = 0, next = 0;
    for (std::size_t r = island.begin; r < island.end; ++r) {
      Search& s = search_[r];
      if (!s.normal) continue;
      const Direction* const d = rows_[r].direction;
      s.image =
          parts(s, velocity(scratch_, rows_[r]) + Vec3(d[0].ground, d[1].ground, d[2].ground));
      bend += s.image.dot(s.direction);
    }
    if (!(bend > 0)) break;
    for (std::size_t r = island.begin; r < island.end; ++r) {
      Search& s = search_[r];
      if (!s.normal) continue;
      s.found += energy / bend * s.direction;
      s.rest -= energy / bend * s.image;
      largest = std::max(largest, s.rest.cwiseAbs().maxCoeff());
      next += s.rest.dot(scaled(rows_[r], s.rest));
    }
    if (largest <= 0.1 * tolerance) break;
    for (std::size_t r = island.begin; r < island.end; ++r)
      search_[r].direction =
          scaled(rows_[r], search_[r].rest) + next / energy * search_[r].direction;
    energy = next;
  }
  still();
  for (std::size_t r = island.begin; r < island.end; ++r) {
    const Search& s = search_[r];
    if (!s.normal) continue;
    Vec3 impulse = rows_[r].impulse + s.found;
    impulse[0] = std::max(0.0, impulse[0]);
    const double pull = tangent(impulse), held = rows_[r].friction * impulse[0];
    if (pull > held) impulse[1] *= held / pull, impulse[2] *= held / pull;
    change(bodies, rows_[r], impulse);
  }
  if (joints_) joints_->project(bodies, false);
}

// What was before solve_sticking(), which did no good; to the last bit, however large its impulses.
void RestingSolver::restore(Bodies bodies, const Island& island) {
  for (std::size_t r = island.begin; r < island.end; ++r) rows_[r].impulse = search_[r].before;
  for (const int i : island.bodies) {
    SolverBody& body = bodies[static_cast<std::size_t>(i)];
    const SolverBody& before = saved_[static_cast<std::size_t>(i)];
    body.velocity = before.velocity, body.angular_velocity = before.angular_velocity;
  }
}

double RestingSolver::solve_island(Bodies bodies, const Island& island, double tolerance) {
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
  const auto most = static_cast<int>(std::min<std::size_t>(kMostSweeps, kMostWork / rows + 1));
  double least = HUGE_VAL, largest = 0;
  int few = kFewSweeps, sticking = few;
  for (int turn = 1, last = most;; ++turn) {
    read(x);
    Sweep swept = sweep(bodies, island);
    if (swept.residual <= std::max(tolerance, swept.rounding)) return 0;
    // Impulses are at most what turns all approaches into one: more is a stress of the island in
    // itself, whose rounding would hide what is left.
    if (turn == 1)
      largest =
          10 * static_cast<double>(rows) * std::max(kRounding * swept.residual, swept.rounding);
    if (turn == sticking) {
      solve_sticking(bodies, island, std::max(tolerance, swept.rounding));
      const Sweep after = sweep(bodies, island);
      const bool proper = after.rounding <= largest;
      if (proper && after.residual <= std::max(tolerance, after.rounding)) return 0;
      if (proper && after.residual < swept.residual) {
        mixing = Anderson{std::span(history_).subspan(each * island.begin, each * rows), n};
        read(x);
        swept = sweep(bodies, island);
      } else {
        restore(bodies, island);
        few *= 2;
      }
      sticking = turn + few;
    }
    if (turn >= last) return swept.residual;
    if (swept.residual < 0.5 * least) {
      least = swept.residual;
      last = std::min(most, turn + kPatience);
    }
    read(g);
    mixing.mix(x, g);
    for (std::size_t r = 0; r < rows; ++r) {
      Row& row = rows_[island.begin + r];
      Vec3 impulse;
      for (std::size_t k = 0; k < 3; ++k) impulse[k] = g[3 * r + k] / row.scale[k];
      apply(bodies, row, impulse - row.impulse);
      row.impulse = impulse;
    }
    if (joints_) joints_->project(bodies, false);
  }
}

double RestingSolver::solve(Bodies bodies, std::span<ContactPoint> contacts, double tolerance,
                            ThreadPool& pool) {
  find_islands(bodies, contacts);
  unknowns_.resize(3 * rows_.size());
  images_.resize(3 * rows_.size());
  history_.resize(Anderson::memory(3) * rows_.size());
  search_.resize(rows_.size());
  scratch_.assign(bodies.begin(), bodies.end());
  saved_.resize(bodies.size());
  for (SolverBody& body : scratch_) body.velocity = body.angular_velocity = {};
  residuals_.assign(count_, 0);
  const auto solve_some = [&](int begin, int end) {
    for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k)
      residuals_[k] = solve_island(bodies, islands_[k], tolerance);
  };
  if (count_ > 1 && rows_.size() >= kWorthThreads)
    pool.run_parts(static_cast<int>(count_), 1, solve_some);
  else
    solve_some(0, static_cast<int>(count_));
  store(bodies, contacts);
  return count_ > 0 ? *std::ranges::max_element(residuals_) : 0;
}

void RestingSolver::store(Bodies bodies, std::span<ContactPoint> contacts) const {
  for (const Row& row : rows_) {
    ContactPoint& m = contacts[row.contact];
    const Vec3 added =
        row.impulse - Vec3(m.normal_impulse, m.tangent_impulse[0], m.tangent_impulse[1]);
    for (std::size_t k = 0; k < 3; ++k) {
      const double moved = m.duration * added[k];
      const auto move = [&](int body, std::size_t side, double sign) {
        SolverBody& of = bodies[static_cast<std::size_t>(body)];
        of.translation += sign * moved * row.inverse_mass[side] * row.direction[k].along;
        of.rotation += sign * moved * row.direction[k].turn[side];
      };
      if (moved == 0) continue;
      move(row.first, 0, 1);
      if (row.second >= 0) move(row.second, 1, -1);
    }
    m.normal_impulse = row.impulse[0];
    m.tangent_impulse[0] = row.impulse[1], m.tangent_impulse[1] = row.impulse[2];
  }
}

}  // namespace sim
