#include "resting_solver.h"

#include <algorithm>
#include <cmath>

namespace sim {
namespace {

constexpr int kFewSweeps = 3, kMostTurns = 12, kMostSweeps = 200;
constexpr std::size_t kMostWork = 4'000'000;  // rows visited, of one island
constexpr std::size_t kWorthThreads = 256;    // rows

Vec3 within(const Vec3& impulse, double friction) {
  const double most = friction * impulse[0];
  const double size = std::sqrt(impulse[1] * impulse[1] + impulse[2] * impulse[2]);
  if (!(size > most)) return impulse;
  return {impulse[0], impulse[1] * (most / size), impulse[2] * (most / size)};
}

}  // namespace

// d.(v1 - v2) + (arm1 x d).w1 - (arm2 x d).w2
double RestingSolver::rate(std::span<const SolverBody> bodies, const Row& row, std::size_t k) {
  const Direction& d = row.direction[k];
  const SolverBody& a = bodies[static_cast<std::size_t>(row.first)];
  double sum = d.along.dot(a.velocity) + d.moment[0].dot(a.angular_velocity);
  if (row.second < 0) return sum - d.ground;
  const SolverBody& b = bodies[static_cast<std::size_t>(row.second)];
  return sum - d.along.dot(b.velocity) - d.moment[1].dot(b.angular_velocity);
}

void RestingSolver::apply(Bodies bodies, const Row& row, std::size_t k, double impulse) {
  const Direction& d = row.direction[k];
  if (row.inverse_mass[0] > 0) {
    SolverBody& a = bodies[static_cast<std::size_t>(row.first)];
    a.velocity += row.inverse_mass[0] * impulse * d.along;
    a.angular_velocity += impulse * d.turn[0];
  }
  if (row.inverse_mass[1] > 0) {
    SolverBody& b = bodies[static_cast<std::size_t>(row.second)];
    b.velocity -= row.inverse_mass[1] * impulse * d.along;
    b.angular_velocity -= impulse * d.turn[1];
  }
}

void RestingSolver::change(Bodies bodies, Row& row, const Vec3& impulse) {
  for (std::size_t k = 0; k < 3; ++k)
    if (const double added = impulse[k] - row.impulse[k]; added != 0) apply(bodies, row, k, added);
  row.impulse = impulse;
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
  row.inverse_n = contact.inverse_mass_n, row.inverse_t = contact.inverse_mass_t;
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
      islands_[count_ - 1].end = islands_[count_ - 1].work = 0;
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

// There and back.
double RestingSolver::sweep(Bodies bodies, Island& island) {
  double largest = 0;
  const auto solve = [&](Row& row) {
    const double push =
        std::max(0.0, row.impulse[0] - (rate(bodies, row, 0) + row.offset) / row.inverse_n);
    const double added = push - row.impulse[0];
    row.impulse[0] = push;
    if (added != 0) apply(bodies, row, 0, added);
    largest = std::max(largest, std::fabs(added) * row.inverse_n);
    if (!(row.friction > 0)) return;
    const Vec3 before = row.impulse;
    const Vec3 wanted(push, before[1] - rate(bodies, row, 1) / row.inverse_t,
                      before[2] - rate(bodies, row, 2) / row.inverse_t);
    const Vec3 after = within(wanted, row.friction);
    change(bodies, row, after);
    largest =
        std::max(largest, (std::fabs(after[1] - before[1]) + std::fabs(after[2] - before[2])) *
                              row.inverse_t);
  };
  for (std::size_t r = island.begin; r < island.end; ++r) solve(rows_[r]);
  for (std::size_t r = island.end; r-- > island.begin;) solve(rows_[r]);
  island.work += 2 * (island.end - island.begin);
  if (joints_ && largest > 0) joints_->project(bodies, false);
  return largest;
}

// Active contacts stay active and sticking ones stick: linear equations, singular where more points
// hold a body than are needed, but consistent.
void RestingSolver::solve_sticking(Bodies bodies, Island& island, double tolerance) {
  const auto scaled = [](const Row& row, const Vec3& r) {
    return Vec3(r[0] / row.inverse_n, r[1] / row.inverse_t, r[2] / row.inverse_t);
  };
  const auto each = [&](const auto& visit) {
    for (std::size_t r = island.begin; r < island.end; ++r)
      if (search_[r].pushes) visit(rows_[r], search_[r]);
  };
  double energy = 0;
  for (std::size_t r = island.begin; r < island.end; ++r) {
    const Row& row = rows_[r];
    Search& s = search_[r] = {};
    s.before = row.impulse;
    s.pushes = row.impulse[0] > 0;
    const double pull =
        std::sqrt(row.impulse[1] * row.impulse[1] + row.impulse[2] * row.impulse[2]);
    s.sticks = s.pushes && pull < (1 - 1e-9) * row.friction * row.impulse[0];
    if (!s.pushes) continue;
    s.rest[0] = -rate(bodies, row, 0) - row.offset;
    for (std::size_t k = 1; k < 3 && s.sticks; ++k) s.rest[k] = -rate(bodies, row, k);
    s.direction = scaled(row, s.rest);
    energy += s.rest.dot(s.direction);
  }
  const std::size_t most = 6 * island.bodies.size() + 20;
  for (std::size_t turn = 0; turn < most && energy > 0 && island.work < kMostWork; ++turn) {
    for (const int i : island.bodies) {
      SolverBody& body = trial_[static_cast<std::size_t>(i)];
      body.velocity = body.angular_velocity = {};
    }
    each([&](const Row& row, const Search& s) {
      for (std::size_t k = 0; k < (s.sticks ? 3 : 1); ++k) apply(trial_, row, k, s.direction[k]);
    });
    if (joints_) joints_->project(trial_, true);
    double bend = 0, largest = 0, next = 0;
    each([&](const Row& row, Search& s) {
      for (std::size_t k = 0; k < (s.sticks ? 3 : 1); ++k)
        s.image[k] = rate(trial_, row, k) + row.direction[k].ground;
      bend += s.image.dot(s.direction);
    });
    island.work += island.end - island.begin;
    if (!(bend > 0)) break;
    each([&](const Row& row, Search& s) {
      s.found += energy / bend * s.direction;
      s.rest -= energy / bend * s.image;
      largest = std::max(largest, s.rest.cwiseAbs().maxCoeff());
      next += s.rest.dot(scaled(row, s.rest));
    });
    if (largest <= 0.1 * tolerance) break;
    each([&](const Row& row, Search& s) {
      s.direction = scaled(row, s.rest) + next / energy * s.direction;
    });
    energy = next;
  }
  for (std::size_t r = island.begin; r < island.end; ++r) {
    if (!search_[r].pushes) continue;
    Vec3 impulse = rows_[r].impulse + search_[r].found;
    impulse[0] = std::max(0.0, impulse[0]);
    change(bodies, rows_[r], within(impulse, rows_[r].friction));
  }
  if (joints_) joints_->project(bodies, false);
}

// The impulses before solve_sticking(), which did no good.
void RestingSolver::restore(Bodies bodies, Island& island) {
  for (std::size_t r = island.begin; r < island.end; ++r)
    change(bodies, rows_[r], search_[r].before);
  if (joints_) joints_->project(bodies, false);
}

double RestingSolver::solve_island(Bodies bodies, Island& island, double tolerance) {
  double last = 0;
  for (int turn = 0; turn < kMostTurns && island.work < kMostWork; ++turn) {
    for (int k = 0; k < kFewSweeps * (1 + turn); ++k)
      if (last = sweep(bodies, island); last <= tolerance) return last;
    solve_sticking(bodies, island, tolerance);
    const double found = sweep(bodies, island);
    if (found <= tolerance) return found;
    if (found > last) restore(bodies, island);
  }
  for (int k = 0; k < kMostSweeps && last > tolerance && island.work < kMostWork; ++k)
    last = sweep(bodies, island);
  return last;
}

double RestingSolver::solve(Bodies bodies, std::span<ContactPoint> contacts, double tolerance,
                            ThreadPool& pool) {
  find_islands(bodies, contacts);
  search_.resize(rows_.size());
  trial_.assign(bodies.begin(), bodies.end());
  for (SolverBody& each : trial_) each.velocity = each.angular_velocity = {};
  changes_.assign(count_, 0);
  const auto solve_some = [&](int begin, int end) {
    for (auto k = static_cast<std::size_t>(begin); k < static_cast<std::size_t>(end); ++k)
      changes_[k] = solve_island(bodies, islands_[k], tolerance);
  };
  if (count_ > 1 && rows_.size() >= kWorthThreads)
    pool.run_parts(static_cast<int>(count_), 1, solve_some);
  else
    solve_some(0, static_cast<int>(count_));
  store(bodies, contacts);
  return count_ > 0 ? *std::ranges::max_element(changes_) : 0;
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
