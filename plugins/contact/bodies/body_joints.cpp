#include "body_joints.h"

#include <algorithm>
#include <utility>

#include "core/base/disjoint_sets.h"
#include "core/math/axes.h"
#include "core/particles/rigid/rigid_rows.h"

namespace sim {

BodyJoints::BodyJoints(Particles& particles, ConstraintSystem& constraint_system)
    : particles_(&particles),
      constraint_system_(&constraint_system),
      end_(constraint_system.internal_begin() + constraint_system.internal_size()),
      values_(constraint_system.constraints().rows()),
      group_of_particle_(static_cast<std::size_t>(particles.layout().n())),
      member_of_particle_(group_of_particle_.size()),
      body_of_(group_of_particle_.size()),
      fixed_(group_of_particle_.size()) {}

// Groups are in the order of their first equations, and in each the equations in their order.
void BodyJoints::find_groups() {
  const RowList& list = constraint_system_->constraints().rows();
  // A body counts as its first particle.
  const auto item = [&](int particle) {
    const int body = body_of_[static_cast<std::size_t>(particle)];
    return body < 0 ? particle : body_collision_->body(body).first();
  };
  DisjointSets joined(body_of_.size());
  const auto each_row = [&](const auto& visit) {
    for (std::size_t p = 0; p < list.parts.size(); ++p) {
      if (dynamic_cast<const RigidRows*>(list.parts[p].constraint)) continue;
      for (int r = list.parts[p].row; r < list.end_of(p); ++r) {
        int first = -1;
        for (const int i : list.pattern.of(r)) {
          if (fixed_[static_cast<std::size_t>(i)]) continue;
          if (first < 0) first = item(i);
          visit(r, first, item(i));
        }
      }
    }
  };
  each_row([&](int, int first, int other) { joined.join(first, other); });

  struct Draft {
    std::vector<JointGroup::Member> members = {};
    RowPattern pattern = {};
    std::vector<int> rows = {};
  };
  std::vector<Draft> drafts;
  std::vector<int> draft_of(joined.size(), -1), member_of(joined.size(), -1);
  term_of_entry_.assign(list.pattern.ids.size(), -1);
  int last = -1;
  each_row([&](int r, int first, int) {
    if (r == last) return;
    last = r;
    int& number = draft_of[slot(joined.root(first))];
    if (number < 0) {
      number = static_cast<int>(drafts.size());
      drafts.emplace_back();
    }
    Draft& draft = drafts[static_cast<std::size_t>(number)];
    const auto begin = static_cast<std::size_t>(list.pattern.begin[static_cast<std::size_t>(r)]);
    const std::span<const int> particles = list.pattern.of(r);
    const std::size_t before = draft.pattern.ids.size();
    for (std::size_t k = 0; k < particles.size(); ++k) {
      if (fixed_[static_cast<std::size_t>(particles[k])]) continue;
      const int of = item(particles[k]);
      int& member = member_of[static_cast<std::size_t>(of)];
      if (member < 0) {
        member = static_cast<int>(draft.members.size());
        const int body = body_of_[static_cast<std::size_t>(of)];
        draft.members.push_back({.body = body, .particle = body < 0 ? of : -1});
      }
      auto& ids = draft.pattern.ids;
      auto term = std::find(ids.begin() + static_cast<std::ptrdiff_t>(before), ids.end(), member);
      if (term == ids.end()) term = ids.insert(term, member);
      term_of_entry_[begin + k] = static_cast<int>(term - ids.begin());
    }
    draft.pattern.begin.push_back(static_cast<int>(draft.pattern.ids.size()));
    draft.rows.push_back(r);
  });

  groups_.clear();
  std::ranges::fill(group_of_particle_, -1);
  for (Draft& draft : drafts) {
    for (std::size_t m = 0; m < draft.members.size(); ++m)
      if (const int particle = draft.members[m].particle; particle >= 0) {
        group_of_particle_[static_cast<std::size_t>(particle)] = static_cast<int>(groups_.size());
        member_of_particle_[static_cast<std::size_t>(particle)] = static_cast<int>(m);
      }
    groups_.emplace_back(std::move(draft.members), std::move(draft.pattern), std::move(draft.rows));
  }
  places_.resize(groups_.size());
  prepared_.resize(groups_.size());
}

void BodyJoints::begin(const BodyCollision& body_collision,
                       std::span<const SolverBody> solver_bodies, std::span<const int> entered,
                       double t_end, const double* x_next) {
  body_collision_ = &body_collision, t_end_ = t_end;
  moves_ = false;
  std::copy_n(x_next, end_.size(), end_.data());
  const ParticleView view = particles_->view(t_end, end_.data());
  // Fixed particles and bodies, and then the groups if that or the equations have changed.
  bool changed = false;
  const auto fix = [&](int particle, bool fixed) {
    std::uint8_t& own = fixed_[static_cast<std::size_t>(particle)];
    changed = changed || own != static_cast<std::uint8_t>(fixed);
    own = fixed;
  };
  for (int i = 0; i < body_collision.singles(); ++i) fix(i, !view.free(i));
  std::ranges::fill(body_of_, -1);
  arms_.assign(body_of_.size(), {});
  for (int b = 0; b < body_collision.bodies(); ++b) {
    const RigidBody& body = body_collision.body(b);
    const Vec3 center = body.state(view).center;
    for (int i = body.first(); i < body.first() + RigidBody::kParticles; ++i) {
      fix(i, solver_bodies[static_cast<std::size_t>(b)].inverse_mass == 0);
      body_of_[static_cast<std::size_t>(i)] = b;
      arms_[static_cast<std::size_t>(i)] = view.position(i) - center;
    }
  }
  const RowPattern& pattern = constraint_system_->constraints().rows().pattern;
  if (changed || pattern.begin != pattern_.begin || pattern.ids != pattern_.ids) {
    pattern_ = pattern;
    find_groups();
  }
  finite_ = values_.evaluate(view, end_.data() + constraint_system_->internal_begin());

  group_of_.assign(solver_bodies.size(), -1);
  std::ranges::fill(prepared_, std::uint8_t{0});
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    places_[g].clear();
    for (JointGroup::Member& member : groups_[g].members()) {
      member.place = member.body;
      if (member.body >= 0) {
        member.inverse_mass = solver_bodies[static_cast<std::size_t>(member.body)].inverse_mass;
        group_of_[static_cast<std::size_t>(member.body)] = static_cast<int>(g);
        places_[g].push_back(member.body);
      } else {
        member.inverse_mass = 1 / view.mass[member.particle];
        member.velocity = view.velocity(member.particle);
        member.moved = member.shift = {};
      }
    }
  }
  for (std::size_t k = 0; k < entered.size(); ++k) {
    const auto particle = static_cast<std::size_t>(entered[k]);
    const int group = group_of_particle_[particle];
    if (group < 0 || fixed_[particle]) continue;
    const auto g = static_cast<std::size_t>(group);
    const int place = body_collision.bodies() + static_cast<int>(k);
    groups_[g].members()[static_cast<std::size_t>(member_of_particle_[particle])].place = place;
    group_of_[static_cast<std::size_t>(place)] = group;
    places_[g].push_back(place);
  }
}

// Fixed particles and bodies move as they do in the state.
void BodyJoints::prepare(std::span<const SolverBody> solver_bodies, std::size_t g) {
  prepared_[g] = 1;
  JointGroup& group = groups_[g];
  const ParticleView view = particles_->view(t_end_, end_.data());
  std::ranges::fill(group.terms(), JointGroup::Term{});
  for (std::size_t r = 0; r < group.rows().size(); ++r) {
    const auto row = static_cast<std::size_t>(group.rows()[r]);
    double& drive = group.drive()[r] = values_.drive()[row];
    for (int e = pattern_.begin[row]; e < pattern_.begin[row + 1]; ++e) {
      const auto at = static_cast<std::size_t>(e);
      const int particle = pattern_.ids[at];
      const Vec3& gradient = values_.gradient()[at];
      if (term_of_entry_[at] < 0) {
        drive += gradient.dot(view.velocity(particle));
        continue;
      }
      JointGroup::Term& term = group.terms()[static_cast<std::size_t>(term_of_entry_[at])];
      term.along += gradient;
      term.moment += arms_[static_cast<std::size_t>(particle)].cross(gradient);
    }
  }
  group.factorise(solver_bodies);
}

void BodyJoints::begin_moves(bool further) {
  moves_ = true;
  for (JointGroup& group : groups_)
    for (JointGroup::Member& member : group.members())
      member.moved = further ? Vec3() : std::exchange(member.shift, {});
}

void BodyJoints::project(std::span<SolverBody> solver_bodies, std::size_t group,
                         JointGroup::What what) {
  using What = JointGroup::What;
  if (!finite_) return;                                // store() refuses that
  if (moves_ && what == What::kDisplacements) return;  // moves cause no others
  if (!prepared_[group]) prepare(solver_bodies, group);
  groups_[group].project(solver_bodies, moves_ && what == What::kVelocities ? What::kMoves : what);
}

void BodyJoints::end_moves() {
  for (JointGroup& group : groups_)
    for (JointGroup::Member& member : group.members()) member.shift += member.moved;
  moves_ = false;
}

bool BodyJoints::store(double* x_next) {
  const Layout& layout = particles_->layout();
  const auto q = layout.axes(x_next), v = layout.axes(x_next, 3);
  for (std::size_t g = 0; g < groups_.size(); ++g) {
    if (!prepared_[g]) continue;
    for (const JointGroup::Member& member : groups_[g].members()) {
      if (member.place >= 0) continue;
      put_vector(q, member.particle, vector_at(q, member.particle) + member.shift);
      put_vector(v, member.particle, member.velocity);
    }
  }
  return constraint_system_->project_state(t_end_, x_next, true);
}

}  // namespace sim
