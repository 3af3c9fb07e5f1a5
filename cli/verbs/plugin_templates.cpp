#include "cli/verbs/plugin_templates.h"

namespace sim::cli {
namespace {

constexpr PluginTemplate kTemplates[] = {
    {"force", R"--(// A force towards a point, as of a spring of rest length 0: f = -k (x - center).
#include "core/plugin/plugin.h"

namespace {

class CLASS final : public sim::Force {
 public:
  explicit CLASS(const sim::Params& params)
      : k_(params.number("k")), center_(params.vector("center")) {}

  void accumulate(const sim::ParticleView& p, sim::Tile tile, sim::ForceSink f) const override {
    for (int i = tile.begin; i < tile.end; ++i) f.add(i, k_ * (center_ - p.position(i)));
  }

  bool depends_on_velocity() const override { return false; }

  double potential(const sim::ParticleView& p, sim::Tile tile) const override {
    double sum = 0;
    for (int i = tile.begin; i < tile.end; ++i)
      sum += 0.5 * k_ * (p.position(i) - center_).squaredNorm();
    return sum;
  }
  bool conservative() const override { return true; }

 private:
  double k_;
  sim::Vec3 center_;
};

}  // namespace

SIM_PLUGIN(Force, "NAME") {
  registrar.add(sim::ForcePlugin{
      {.name = "NAME",
       .summary = "a pull towards a point",
       .formula = "f = -k (x - center)",
       .params = {{.name = "k", .default_value = 1.0, .unit = "N/m", .doc = "stiffness", .min = 0},
                  {.name = "center",
                   .type = sim::ParamType::kVector,
                   .default_value = sim::Vec3(0, 0, 0),
                   .unit = "m",
                   .doc = "the point"}}},
      [](const sim::Params& params, const auto&) { return std::make_unique<CLASS>(params); }});
}
)--",
     R"--(-- A particle under the force NAME; build the plugin first.
local sim = require "sim"
sim.plugin "NAME.so"
local particles = sim.particles { mass = 1 }  -- kg
particles:add({1, 0, 0}, { velocity = {0, 1, 0} })
return sim.scene {
  name = "NAME",
  particles = particles,
  forces = { sim.force.NAME { k = 4 } },
  integrator = "verlet", dt = 0.01, duration = 10,
}
)--"},
    {"field", R"--(// Exponential decay of every number of the state: x' = -rate x.
#include "core/plugin/plugin.h"

namespace {

class CLASS final : public sim::Field {
 public:
  explicit CLASS(double rate) : rate_(rate) {}

  void eval(double, std::span<const double> x, std::span<double> dxdt) const override {
    for (std::size_t i = 0; i < x.size(); ++i) dxdt[i] = -rate_ * x[i];
  }

 private:
  double rate_;
};

}  // namespace

SIM_PLUGIN(Field, "NAME") {
  registrar.add(sim::FieldPlugin{
      {.name = "NAME",
       .summary = "exponential decay",
       .formula = "x' = -rate x",
       .params = {{.name = "rate", .default_value = 1.0, .unit = "1/s", .doc = "of decay"}}},
      [](const sim::Params& params) { return std::make_unique<CLASS>(params.number("rate")); }});
}
)--",
     R"--(-- Numbers that the field NAME moves; build the plugin first.
local sim = require "sim"
sim.plugin "NAME.so"
return sim.scene {
  name = "NAME",
  state = { 1, 2, 3 },
  field = sim.field.NAME { rate = 0.5 },
  integrator = "rk4", dt = 0.01, duration = 5,
  exact = function(t)
    local e = math.exp(-0.5 * t)
    return { e, 2 * e, 3 * e }
  end,
}
)--"},
    {"integrator", R"--(// Ralston's method. Ralston (1962), Math. Comput. 16, 431-437.
#include "core/plugin/explicit_plugin.h"
#include "core/plugin/plugin.h"

namespace {

constexpr sim::Tableau<2> kCLASS{
    .a = {{{0, 0}, {2.0 / 3, 0}}}, .b = {1.0 / 4, 3.0 / 4}, .c = {0, 2.0 / 3}};
static_assert(sim::order_conditions(kCLASS) == 2);  // the compiler checks the order

}  // namespace

SIM_PLUGIN(Integrator, "NAME") {
  registrar.add(sim::IntegratorPlugin{
      {.name = "NAME",
       .summary = "two evaluations, second order",
       .formula = "x_next = x + h/4 (k1 + 3 f(t + 2h/3, x + 2h/3 k1))"},
      [](const sim::Params&) { return std::make_unique<sim::ExplicitRungeKutta>(kCLASS, 2); }});
}
)--",
     R"--(-- A particle on a spring, stepped by NAME; build the plugin first.
local sim = require "sim"
sim.plugin "NAME.so"
local particles = sim.particles { mass = 1 }  -- kg
particles:add {0, 0, 0}
particles:add {1.5, 0, 0}
particles:pin(0)
return sim.scene {
  name = "NAME",
  particles = particles,
  forces = { sim.force.spring { stiffness = 4, rest = 1 }:tie(0, 1) },
  integrator = "NAME", dt = 0.01, duration = 10,
}
)--"},
    {"constraint", R"--(// Pairs of particles at one height: y_a - y_b = 0.
#include "core/plugin/constraint_params.h"
#include "core/plugin/plugin.h"

namespace {

class CLASS final : public sim::Constraint {
 public:
  explicit CLASS(const sim::Elements& pairs) : ids_(pairs.ids) {}

  // Which particles each equation joins.
  sim::RowPattern pattern() const override {
    sim::RowPattern pattern;
    for (std::size_t k = 0; k < ids_.size(); k += 2) pattern.add({ids_[k], ids_[k + 1]});
    return pattern;
  }

  // phi, its gradient for each of them, d phi / dt at rest, and J'v.
  void evaluate(const sim::ParticleView& p, const sim::Rows& rows) const override {
    for (std::size_t r = 0; r < ids_.size() / 2; ++r) {
      rows.phi[r] = p.y[ids_[2 * r]] - p.y[ids_[2 * r + 1]];
      rows.gradient[2 * r] = {0, 1, 0};
      rows.gradient[2 * r + 1] = {0, -1, 0};
      rows.drive[r] = rows.bias[r] = 0;
    }
  }

 private:
  std::vector<int> ids_;
};

}  // namespace

SIM_PLUGIN(Constraint, "NAME") {
  registrar.add(sim::Plugin<sim::Constraint>{
      {.name = "NAME",
       .summary = "pairs of particles at one height",
       .formula = "y_a - y_b = 0",
       .params = sim::constraint_params({}),
       .elements = {.arity = 2, .name = "pair"}},
      [](const auto&, const sim::Elements& pairs) { return std::make_unique<CLASS>(pairs); }});
}
)--",
     R"--(-- Two weights at one height, on springs of different stiffness; build the plugin first.
local sim = require "sim"
sim.plugin "NAME.so"
local particles = sim.particles { mass = 1 }  -- kg
for x = 0, 1 do
  particles:pin(particles:add { x, 0, 0 })
  particles:add { x, -1, 0 }
end
return sim.scene {
  name = "NAME",
  particles = particles,
  forces = { sim.force.gravity { g = {0, -9.81, 0} },
    sim.force.spring { stiffness = 40 }:tie(0, 1), sim.force.spring { stiffness = 60 }:tie(2, 3) },
  constraints = { sim.constraint.NAME { ties = { {1, 3} } } },
  integrator = "rk4", dt = 0.01, duration = 5,
}
)--"},
    {"collider",
     R"--(// A pole without ends: everything within a radius of an upright line is solid.
#include "core/plugin/plugin.h"
#include "core/plugin/sdf_collider.h"

namespace {

// About the origin and at rest: the base class moves it, gives it friction and a thickness.
class CLASS final : public sim::SdfCollider {
 public:
  explicit CLASS(const sim::Params& params)
      : SdfCollider(params, params.vector("center")), radius_(params.number("radius")) {}

 private:
  // m to the surface, < 0 inside, and its gradient, which is defined everywhere.
  Distance distance(const sim::Vec3& x) const override {
    const double across = std::sqrt(x[0] * x[0] + x[2] * x[2]);
    if (across == 0) return {-radius_, {1, 0, 0}};
    return {across - radius_, {x[0] / across, 0, x[2] / across}};
  }

  sim::RenderShape form() const override {
    return {.form = sim::RenderShape::Form::kCapsule,
            .axes = {sim::Vec3(0, 10, 0), sim::Vec3(0, 0, 1), sim::Vec3(1, 0, 0)},
            .radius = radius_};
  }

  double radius_;
};

}  // namespace

SIM_PLUGIN(Collider, "NAME") {
  registrar.add(sim::Plugin<sim::Collider>{
      {.name = "NAME",
       .summary = "a pole without ends",
       .formula = "|x - center| across >= radius + thickness",
       .params = sim::solid_params(
           {{.name = "radius", .default_value = 0.25, .unit = "m", .doc = "of the pole", .min = 0},
            {.name = "center",
             .type = sim::ParamType::kVector,
             .default_value = sim::Vec3(0, 0, 0),
             .unit = "m",
             .doc = "a point of its axis"}})},
      [](const sim::Params& params) { return std::make_unique<CLASS>(params); }});
}
)--",
     R"--(-- Balls thrown at NAME; build the plugin first.
local sim = require "sim"
sim.plugin "NAME.so"
local particles = sim.particles { mass = 1 }  -- kg
for i = 0, 4 do
  particles:add({ -1, 0, 0.1 * i - 0.2 }, { velocity = {2, 0, 0} })
end
return sim.scene {
  name = "NAME",
  particles = particles,
  forces = { sim.force.gravity { g = {0, -9.81, 0} } },
  colliders = { sim.collider.NAME { radius = 0.25, restitution = 0.5 } },
  integrator = "verlet", dt = 0.01, duration = 1,
}
)--"},
    {"motion", R"--(// An eight on its side: twice up and down while once to and fro.
#include "core/math/elementary.h"
#include "core/geometry/rigid_motion.h"
#include "core/plugin/periodic.h"
#include "core/plugin/plugin.h"

namespace {

class CLASS final : public sim::RigidMotion {
 public:
  explicit CLASS(const sim::Params& params)
      : period_(params, "motion 'NAME'"), size_(params.number("size")) {}

  // A function of t alone; the sine is the same on every machine.
  sim::Pose at(double t, const sim::Vec3& center) const override {
    const auto [s, c] = sim::sine_cosine(period_.turns(t));
    return {.center = center + size_ * sim::Vec3(s, s * c, 0),
            .velocity = size_ * period_.rate() * sim::Vec3(c, c * c - s * s, 0)};
  }
  double max_speed() const override { return 1.5 * std::fabs(period_.rate() * size_); }

 private:
  sim::Period period_;
  double size_;
};

}  // namespace

SIM_PLUGIN(RigidMotion, "NAME") {
  registrar.add(sim::Plugin<sim::RigidMotion>{
      {.name = "NAME",
       .summary = "an eight on its side",
       .formula = "center(t) = center + size {sin a, sin a cos a, 0}, a = 2 pi t / period + phase",
       .params = sim::periodic_params({{.name = "size",
                                        .default_value = 0.5,
                                        .unit = "m",
                                        .doc = "how far to either side",
                                        .min = 0}})},
      [](const sim::Params& params) { return std::make_unique<CLASS>(params); }});
}
)--",
     R"--(-- A weight on a spring whose other end goes as NAME says; build the plugin first.
local sim = require "sim"
sim.plugin "NAME.so"
local particles = sim.particles { mass = 1 }  -- kg
particles:add {0, 0, 0}
particles:add {0, -1, 0}
particles:prescribe(0, sim.motion.NAME { size = 0.3, period = 2 })
return sim.scene {
  name = "NAME",
  particles = particles,
  forces = { sim.force.gravity { g = {0, -9.81, 0} },
    sim.force.spring { stiffness = 100 }:tie(0, 1) },
  integrator = "rk4", dt = 0.01, duration = 5,
}
)--"},
    {"law", R"--(// Restitution of balls that yield: fast blows leave dents and give back less.
#include <algorithm>
#include <cmath>

#include "core/particles/contact_law.h"
#include "core/plugin/plugin.h"

namespace {

class CLASS final : public sim::ContactLaw {
 public:
  explicit CLASS(const sim::Params& params)
      : yields_(params.number("yields")), friction_(params.number("friction")) {}

  // A function of the speed alone; the square root is the same on every machine.
  double restitution(double approach) const override {
    return approach > yields_ ? std::sqrt(std::sqrt(yields_ / approach)) : 1;
  }
  double friction(double /*speed*/) const override { return friction_; }

 private:
  double yields_, friction_;
};

}  // namespace

SIM_PLUGIN(ContactLaw, "NAME") {
  registrar.add(sim::Plugin<sim::ContactLaw>{
      {.name = "NAME",
       .summary = "restitution of balls that yield",
       .formula = "v_n' = -min(1, (yields / v_n)^(1/4)) v_n,  |p_t| <= friction p_n",
       .params = {{.name = "yields",
                   .default_value = 0.1,
                   .unit = "m/s",
                   .doc = "speed above which a blow leaves a dent",
                   .min = 1e-6},
                  {.name = "friction",
                   .default_value = 0.0,
                   .doc = "Coulomb's coefficient",
                   .min = 0}}},
      [](const sim::Params& params) { return std::make_unique<CLASS>(params); }});
}
)--",
     R"--(-- A ball that bounces by the law NAME; build the plugin first.
local sim = require "sim"
sim.plugin "NAME.so"
local particles = sim.particles { mass = 1 }  -- kg
particles:add {0, 1, 0}
return sim.scene {
  name = "NAME",
  particles = particles,
  forces = { sim.force.gravity { g = {0, -9.81, 0} } },
  colliders = { sim.collider.plane { law = sim.law.NAME { yields = 0.2 } } },
  integrator = "verlet", dt = 0.01, duration = 2,
}
)--"},
    {"study", R"--(// How far the end of a scene moves when its step is halved, again and again.
#include <cmath>

#include "core/output/format.h"
#include "core/plugin/plugin.h"
#include "core/study/study.h"

namespace {

class CLASS final : public sim::Study {
 public:
  explicit CLASS(std::int64_t halvings) : halvings_(halvings) {}

  std::string run(const sim::StudyTask& task) override {
    const sim::StudiedScene scene = task.scene->load(task.variant);
    const sim::SystemSpec& spec = scene.spec.systems.front();
    const sim::study::Problem problem{&spec, task.registry,
                                      task.scene->options(task.variant, spec)};
    std::vector<std::vector<std::string>> table{{"dt [s]", "moved"}};
    std::vector<std::string> points;
    std::vector<double> last;
    double dt = scene.systems.front().h();
    for (std::int64_t i = 0; i <= halvings_; ++i, dt /= 2) {
      const double done = static_cast<double>(i) / static_cast<double>(halvings_ + 1);
      if (!task.watch("dt = " + sim::brief(dt), done)) break;
      sim::Simulation system = problem.simulation(dt);
      const std::int64_t steps = system.steps_for(task.time.value_or(spec.duration));
      while (system.step_count() < steps && system.step()) continue;

      // The largest change of a number of the state, which is not known of the first step.
      double moved = last.empty() ? std::nan("") : 0;
      for (std::size_t k = 0; k < last.size(); ++k)
        moved = std::fmax(moved, std::fabs(system.state()[k] - last[k]));
      last.assign(system.state().begin(), system.state().end());
      table.push_back({sim::brief(dt), std::isnan(moved) ? "-" : sim::brief(moved, 3)});
      points.push_back(sim::JsonObject().number("dt", dt).number("moved", moved).str());
    }
    return task.json ? sim::JsonObject().json("points", sim::json_array(points)).str()
                     : sim::aligned(table, "");
  }

 private:
  std::int64_t halvings_;
};

}  // namespace

SIM_PLUGIN(Study, "NAME") {
  registrar.add(sim::Plugin<sim::Study>{
      {.name = "NAME",
       .summary = "how far does a smaller step move the end?",
       .formula = "sim NAME SCENE [--halvings 3]",
       .params = {{.name = "halvings",
                   .type = sim::ParamType::kInteger,
                   .default_value = std::int64_t{3},
                   .doc = "of the step",
                   .min = 1,
                   .max = 20}}},
      [](const sim::Params& params) {
        return std::make_unique<CLASS>(params.integer("halvings"));
      },
      true,
      {"--integrator", "--dt", "--time"},
      "Keys of --json: points: [dt (s), moved (m, m/s, or numbers of a flat state)]\n"});
}
)--",
     nullptr, "sim NAME scenes/circle.lua --load ./NAME.so"},
};

}  // namespace

std::span<const PluginTemplate> plugin_templates() { return kTemplates; }

}  // namespace sim::cli
