#include "core/particles/rk_stepper.h"

#include <algorithm>
#include <thread>

namespace sim {
namespace {

constexpr int kTile = 512;          // particles whose gathered forces stay in the first-level cache
constexpr int kChunk = 1024;        // particles that one stage of a wavefront goes ahead
constexpr int kOnePassFrom = 8192;  // particles; fewer stay in the second-level cache anyway
constexpr int kLeastPart = 512;     // particles a rank, or the hand-over costs more than it saves

}  // namespace

RkStepper::RkStepper(ParticleSystem& system, const ExplicitPlan& plan)
    : system_(&system), kernels_(sweep_kernels()), plan_(plan), stages_(plan.stages) {
  if (plan.stages > Row::kMost) throw std::logic_error("a tableau has more stages than a row");
  const int n = system.layout().n();
  const Layout half(n, 3);
  const bool other = system.has_other_forces();
  one_pass_ = !other && n >= kOnePassFrom;
  const int least = std::max(kLeastPart, (stages_ + 2) * system.reach());
  ranks_ = std::clamp(n / least, 1, system.team().size());

  for (int s = 1; s + 1 < stages_; ++s) kept_.emplace_back(half.size());
  if (stages_ > 1) positions_ = Array(half.size());
  if (other) forces_ = Array(half.size());
  if (system.needs_velocities() && stages_ > 1)
    for (Array& velocity : velocities_) velocity = Array(half.size());
  for (int i = 0; i < ranks_ * (one_pass_ ? stages_ : 1); ++i)
    rings_.push_back(system.make_rings());
  progress_ = std::make_unique<Progress[]>(static_cast<std::size_t>(ranks_ * stages_));
  finite_.resize(static_cast<std::size_t>(ranks_));
  for (Script& script : scripts_) script.stages.resize(static_cast<std::size_t>(stages_));
}

void RkStepper::write(Script& script, double h, const double* x, double* x_next) {
  script.h = h;
  script.x = x;
  script.x_next = x_next;
  const Layout& layout = system_->layout();
  const Layout half(layout.n(), 3);
  const int last = stages_ - 1;

  // Where stage s finds its positions and keeps its acceleration. The positions alternate between
  // two places, such that those of the next state come to lie in x_next.
  const auto positions = [&](int s, int axis) {
    return (stages_ - s) % 2 == 0 ? layout.block(x_next, axis)
                                  : half.block(positions_.data(), axis);
  };
  const auto acceleration = [&](int s, int axis) {
    return s == 0 ? layout.block(x_next, 3 + axis)
                  : half.block(kept_[static_cast<std::size_t>(s - 1)].data(), axis);
  };
  const auto velocities = [&](int s, int axis) {
    return half.block(velocities_[s % 2].data(), axis);
  };
  const auto add = [&](Row& row, double coef, int s) {
    if (coef == 0) return;
    const double* const from[3] = {acceleration(s, 0), acceleration(s, 1), acceleration(s, 2)};
    row.add(coef, from);
  };

  for (int s = 0; s < stages_; ++s) {
    RkStage& stage = script.stages[static_cast<std::size_t>(s)];
    stage = {};
    for (int axis = 0; axis < 3; ++axis) {
      stage.q0[axis] = layout.block(x, axis);
      stage.v0[axis] = layout.block(x, 3 + axis);
      stage.q[axis] = s == 0 ? stage.q0[axis] : positions(s, axis);
      stage.q_next[axis] = positions(s + 1, axis);
      if (system_->has_other_forces()) stage.force[axis] = half.block(forces_.data(), axis);
      if (s < last) stage.a[axis] = acceleration(s, axis);
      if (s == last)
        stage.v_next[axis] = layout.block(x_next, 3 + axis);
      else if (system_->needs_velocities())
        stage.v_next[axis] = velocities(s + 1, axis);
    }
    // The weights of what follows: the next row of A, or b.
    const auto weight = [&](int j) {
      return s == last ? plan_.b[static_cast<std::size_t>(j)] : plan_.a_at(s + 1, j);
    };
    for (int j = 0; j < s; ++j) add(stage.v_now, h * plan_.a_at(s, j), j);
    for (int j = 0; j <= s; ++j) stage.drift += h * weight(j);
    for (int l = 0; l < s; ++l) {
      double squared = 0;
      for (int j = l + 1; j <= s; ++j) squared += weight(j) * plan_.a_at(j, l);
      add(stage.q_row, h * h * squared, l);
      add(stage.v_row, h * weight(l), l);
    }
    stage.kick = h * weight(s);
    stage.check = s == last;
  }
}

bool RkStepper::step(double t, double h, const double* x, double* x_next) {
  Script& script = scripts_[scripts_[0].x == x && scripts_[0].x_next == x_next ? 0 : 1];
  if (script.h != h || script.x != x || script.x_next != x_next) {
    Script& oldest = scripts_[0].x == nullptr ? scripts_[0] : script;
    write(oldest, h, x, x_next);
    script_ = &oldest;
  } else {
    script_ = &script;
  }
  std::fill(finite_.begin(), finite_.end(), char{1});

  if (system_->has_other_forces()) {
    run_plain(t);
  } else {
    for (int i = 0; i < ranks_ * stages_; ++i)
      progress_[i].done.store(0, std::memory_order_relaxed);
    if (ranks_ == 1)
      run_wavefront(0);
    else
      system_->team().run([this](int rank) {
        if (rank < ranks_) run_wavefront(rank);
      });
  }
  return std::count(finite_.begin(), finite_.end(), char{1}) == ranks_;
}

// One stage after the other, each complete before the next: other forces may read any particle.
void RkStepper::run_plain(double t) {
  const Layout& layout = system_->layout();
  for (int s = 0; s < stages_; ++s) {
    const RkStage& stage = script_->stages[static_cast<std::size_t>(s)];
    ParticleView view =
        system_->view(t + plan_.c[static_cast<std::size_t>(s)] * script_->h, script_->x);
    view.x = stage.q[0];
    view.y = stage.q[1];
    view.z = stage.q[2];
    if (s > 0 && system_->needs_velocities()) {
      const Layout half(layout.n(), 3);
      const double* const from = velocities_[s % 2].data();
      view.vx = half.block(from, 0);
      view.vy = half.block(from, 1);
      view.vz = half.block(from, 2);
    }
    const Layout half(layout.n(), 3);
    const ForceSink sink{half.block(forces_.data(), 0), half.block(forces_.data(), 1),
                         half.block(forces_.data(), 2)};
    system_->team().run([&](int rank) {
      if (rank >= ranks_) return;
      const Part part = part_of(layout.n(), 8, rank, ranks_);
      start(rank, s, part.begin);
      for (int begin = part.begin; begin < part.end; begin += kTile) {
        const int end = std::min(begin + kTile, part.end);
        system_->gather(view, {begin, end}, sink);
        sweep(rank, s, begin, end);
      }
    });
  }
}

void RkStepper::run_wavefront(int rank) {
  const int n = system_->layout().n(), reach = system_->reach();
  int at[Row::kMost], end[Row::kMost];
  for (int s = 0; s < stages_; ++s) {
    at[s] = first(rank, s);
    end[s] = first(rank + 1, s);
  }
  const int ahead = one_pass_ ? kChunk : n;
  while (at[stages_ - 1] < end[stages_ - 1]) {
    for (int s = 0; s < stages_; ++s) {
      // As far as the positions of the stage are known: `reach` behind the stage before, or, when
      // that one is done, into the particles that the next rank has done first of all.
      int limit = end[s];
      if (s == 0) {
        limit = std::min(limit, at[0] + ahead);
      } else if (at[s - 1] < end[s - 1]) {
        limit = std::min(limit, at[s - 1] - reach);
      } else if (rank + 1 < ranks_) {
        const std::atomic<int>& needed = progress(rank + 1, s - 1).done;
        while (needed.load(std::memory_order_acquire) < std::min(n, end[s] + reach))
          std::this_thread::yield();
      }
      if (limit <= at[s]) continue;
      if (at[s] == first(rank, s)) start(rank, s, at[s]);
      sweep(rank, s, at[s], limit);
      at[s] = limit;
      progress(rank, s).done.store(limit, std::memory_order_release);
    }
  }
}

// The first particle of a rank at a stage.
int RkStepper::first(int rank, int stage) const {
  const int n = system_->layout().n();
  if (rank == 0) return 0;
  if (rank == ranks_) return n;
  return part_of(n, 8, rank, ranks_).begin + stage * system_->reach();
}

Rings& RkStepper::rings(int rank, int stage) {
  return rings_[static_cast<std::size_t>(one_pass_ ? rank * stages_ + stage : rank)];
}

// A single rank finds its rings as the last sweep left them, empty.
void RkStepper::start(int rank, int stage, int begin) {
  if (ranks_ == 1) return;
  rings(rank, stage).clear();
  const RkStage& script = script_->stages[static_cast<std::size_t>(stage)];
  kernels_.warm_up(rings(rank, stage).runs(), script.q, std::max(0, begin - system_->reach()),
                   begin);
}

void RkStepper::sweep(int rank, int stage, int begin, int end) {
  if (!kernels_.rk(rings(rank, stage).runs(), system_->motion(),
                   script_->stages[static_cast<std::size_t>(stage)], begin, end))
    finite_[static_cast<std::size_t>(rank)] = 0;
}

}  // namespace sim
