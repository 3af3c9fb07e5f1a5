#include "tests/hunt/kinds.h"

#include <cmath>
#include <sstream>

#include "tests/hunt/random_numbers.h"

namespace sim_test {
namespace {

constexpr const char* kStart = "local sim = require 'sim'\nlocal p, forces, all = nil, {}, {}\n";

// The text of a scene: what its kind adds, then particles, forces and all else that `all` has.
class Text {
 public:
  explicit Text(std::uint64_t seed) : random(seed) { out_ << kStart; }

  Random random;

  template <class... Parts>
  Text& line(const Parts&... parts) {
    (out_ << ... << parts) << '\n';
    return *this;
  }
  double between(double low, double high) { return random.uniform(low, high); }

  std::string end(double dt, double duration) {
    line("all.name, all.particles, all.integrator = 'hunted', p, 'verlet'");
    line("if #forces > 0 then all.forces = forces end");
    line("all.dt, all.duration = ", dt, ", ", duration);
    line("return sim.scene(all)");
    return out_.str();
  }

 private:
  std::ostringstream out_;
};

std::string triple(double x, double y, double z) {
  std::ostringstream out;
  out << "{" << x << ", " << y << ", " << z << "}";
  return out.str();
}
std::string triple(const sim::Vec3& v) { return triple(v[0], v[1], v[2]); }

void add_gravity(Text& text) { text.line("forces[#forces + 1] = sim.force.gravity {}"); }

// Some particles above the ground, in a chain where `k` is above 0; a step that sees its springs.
double add_chain(Text& text, int n, double k, double mass) {
  text.line("p = sim.particles { mass = ", mass, " }");
  for (int i = 0; i < n; ++i)
    text.line("p:add(", triple(0.3 * i - 0.4, text.between(0.7, 1.2), text.between(-0.2, 0.2)),
              ", { velocity = ", triple(text.random.vector(1)), " })");
  if (!(k > 0)) return 0.004;
  text.line("local ties = {} for i = 1, ", n - 1, " do ties[i] = {i - 1, i} end");
  text.line("forces[#forces + 1] = sim.force.spring { stiffness = ", k, ", ties = ties }");
  return std::min(0.004, 0.3 / std::sqrt(4 * k / mass));
}

// A sheet of n x n particles of 1 m, 0.2 kg; a step that sees its springs.
double add_sheet(Text& text, int n, double k, const std::string& du, const std::string& dv) {
  const double mass = 0.2 / (n * n);
  text.line("p = sim.grid { ", n, ", ", n, ", origin = {-0.5, 0.4, -0.5}, du = ", du, ", dv = ", dv,
            ", mass = ", mass, " }");
  for (const auto& [share, offsets] :
       {std::pair{1.0, "{ {0,1}, {1,0} }"}, {0.5, "{ {1,1}, {1,-1} }"}, {0.05, "{ {0,2}, {2,0} }"}})
    text.line("forces[#forces + 1] = sim.force.spring { grid = p, stiffness = ", share * k,
              ", damping = ", 0.02 * std::sqrt(k * mass), ", offsets = ", offsets, " }");
  text.line("forces[#forces + 1] = sim.force.drag { k = ", mass, " }");
  return std::min(0.004, 0.3 / std::sqrt(12 * k / mass));
}

// Thin, fast, spinning, and rooms.
void add_colliders(Text& text, double friction) {
  const double restitution = text.random.chance(0.3) ? 0 : text.between(0, 1);
  const auto laws = [&] {
    std::ostringstream out;
    out << ", restitution = " << restitution << ", friction = " << friction << " }";
    return out.str();
  };
  text.line("all.colliders = { sim.collider.plane { normal = ",
            triple(text.between(-0.3, 0.3), 1, text.between(-0.1, 0.1)), laws());
  switch (text.random.integer(0, 4)) {
    case 0:
      text.line(", sim.collider.box { center = {0, 0.4, 0}, half = {0.6, ",
                text.random.decade(-3, -1), ", 0.6}", laws());
      break;
    case 1:
      text.line(", sim.collider.sphere { center = {0, 0.3, 0}, radius = 0.25, motion = ",
                "sim.motion.swing { amplitude = ", triple(0, text.between(0, 0.2), 0.1),
                ", period = ", text.random.decade(-1, 0.5), " }", laws());
      break;
    case 2:
      text.line(", sim.collider.capsule { a = {-0.5, 0.35, 0}, b = {0.5, 0.35, 0}, radius = 0.1, ",
                "motion = sim.motion.spin { axis = {0, 1, 0}, period = ",
                text.random.decade(-0.3, 0.7), " }", laws());
      break;
    case 3:
      text.line(", sim.collider.box { center = {0, 1, 0}, half = {1.5, 1.2, 1}, inside = true",
                laws());
      break;
    default:
      break;
  }
  text.line("}");
}

void add_ground(Text& text, double height, double friction) {
  text.line("all.colliders = { sim.collider.plane { point = ", triple(0, height, 0),
            ", normal = {0, 1, 0}, friction = ", friction, " } }");
}

std::string colliders(std::uint64_t seed) {
  Text text(seed);
  const int n = text.random.integer(1, 5);
  add_gravity(text);
  const double k = text.random.chance(0.5) ? text.random.decade(1, 4) : 0;
  const double dt = add_chain(text, n, n > 1 ? k : 0, text.between(0.1, 2));
  add_colliders(text, 0);
  return text.end(dt, text.between(0.4, 1.2));
}

std::string friction(std::uint64_t seed) {
  Text text(seed);
  const int n = text.random.integer(1, 5);
  add_gravity(text);
  const double dt = add_chain(text, n, n > 1 ? text.random.decade(1, 4) : 0, text.between(0.1, 2));
  add_colliders(text, text.between(0.05, 1));
  return text.end(dt, text.between(0.6, 1.2));
}

std::string self_contact(std::uint64_t seed) {
  Text text(seed);
  add_gravity(text);
  const int n = text.random.integer(4, 5);
  const double s = 1.0 / n, fold = text.between(0.3, 1.2);
  const double dt = add_sheet(text, n, text.random.decade(1.3, 2.6), triple(0, 0, s),
                              triple(s * std::cos(fold), s * std::sin(fold), 0));
  text.line("p:pin(p:id(0, 0))");
  text.line("all.contact = sim.contact { surfaces = { sim.surface { grid = p } }, thickness = ",
            text.between(0.02, 0.15) * s, ", friction = ", text.between(0, 0.6), " }");
  if (text.random.chance(0.6)) add_ground(text, 0.3, text.between(0, 0.6));
  return text.end(dt, text.between(0.15, 0.35));
}

std::string constraints(std::uint64_t seed) {
  Text text(seed);
  add_gravity(text);
  const int n = text.random.integer(3, 7);
  add_chain(text, n, 0, text.between(0.1, 2));
  text.line("local rods = {} for i = 1, ", n - 1, " do rods[i] = {i - 1, i} end");
  const int which = text.random.integer(0, 4);
  if (which == 1) text.line("rods[#rods + 1] = {0, ", n - 1, "}");          // a loop
  if (which == 2) text.line("rods[#rods + 1] = {0, 2} p:pin(0) p:pin(1)");  // more than it needs
  text.line("all.constraints = { sim.constraint.distance { ties = rods }");
  if (which == 3)
    text.line(
        ", sim.constraint.on_plane { particles = {0}, point = {0, 1, 0}, "
        "normal = {0, 1, 0} }");
  text.line("}");
  if (which == 0 || which == 4) text.line("p:pin(0)");
  return text.end(0.004, text.between(0.5, 1.5));
}

std::string bodies(std::uint64_t seed) {
  Text text(seed);
  add_gravity(text);
  const int n = text.random.integer(1, 3);
  const double friction = text.between(0, 0.8);
  text.line("all.bodies = {}");
  for (int i = 0; i < n; ++i) {
    const bool ball = text.random.chance(0.4);
    std::ostringstream shape;
    if (ball)
      shape << "sim.sphere { radius = " << text.between(0.15, 0.4) << " }";
    else
      shape << "sim.box { half = "
            << triple(text.between(0.2, 0.5), text.random.decade(-1.3, -0.4), 0.3) << " }";
    text.line("all.bodies[#all.bodies + 1] = sim.rigid { shape = ", shape.str(),
              ", mass = ", text.random.decade(-1, 1),
              ", position = ", triple(text.between(-0.2, 0.2), 0.75 + 0.85 * i, 0),
              ", velocity = ", triple(text.random.vector(1)), ", friction = ", friction,
              ", restitution = ", text.random.chance(0.5) ? 0 : text.between(0, 0.9), " }");
  }
  text.line("all.colliders = { sim.collider.plane { normal = ",
            triple(text.between(-0.3, 0.3), 1, 0), ", friction = ", friction, " } }");
  return text.end(0.002, text.between(0.25, 0.6));
}

// Rows of limbs that balls or hinges join, which fall across each other.
std::string joints(std::uint64_t seed) {
  Text text(seed);
  add_gravity(text);
  const int rows = text.random.integer(1, 4), limbs = text.random.integer(2, 4);
  const double half = text.between(0.1, 0.2), end = half + 0.03;
  const std::string surface =
      ", friction = " + std::to_string(text.between(0, 0.8)) +
      ", restitution = " + std::to_string(text.random.chance(0.6) ? 0 : text.between(0, 0.6));
  text.line("all.bodies = {} local joints = sim.constraint.joint {}");
  for (int row = 0; row < rows; ++row) {
    const double angle = text.between(-1.5, 1.5), y = 0.2 + 0.25 * row;
    const bool hinge = text.random.chance(0.5);
    for (int i = 0; i < limbs; ++i) {
      const double along = end * (2 * i + 1 - limbs);
      text.line("all.bodies[#all.bodies + 1] = sim.rigid { shape = sim.box { half = ",
                triple(half, text.between(0.02, 0.05), 0.04),
                " }, mass = ", text.random.decade(-1, 1),
                ", position = ", triple(along * std::cos(angle), y, -along * std::sin(angle)),
                ", rotation = ", triple(0, angle, 0), surface, " }");
      if (i > 0)
        text.line("for _, z in ipairs ", hinge ? "{ -0.03, 0.03 }" : "{ 0 }",
                  " do joints:tie(all.bodies[#all.bodies - 1]:at {", end,
                  ", 0, z}, all.bodies[#all.bodies]:at {", -end, ", 0, z}) end");
    }
  }
  text.line("all.constraints = { joints }");
  text.line("all.colliders = { sim.collider.plane { normal = ",
            triple(text.between(-0.2, 0.2), 1, 0), surface, " } }");
  return text.end(0.002, text.between(0.25, 0.6));
}

// Bodies of several shapes fall on a sheet that its corners hold.
std::string caught(std::uint64_t seed) {
  Text text(seed);
  add_gravity(text);
  const int n = text.random.integer(4, 7), bodies = text.random.integer(1, 3);
  const double s = 1.0 / (n - 1), friction = text.between(0, 0.6);
  const double dt =
      add_sheet(text, n, text.random.decade(1.3, 2.6), triple(0, 0, s), triple(s, 0, 0));
  text.line("p:pin(p:id(0, 0), p:id(0, ", n - 1, "), p:id(", n - 1, ", 0), p:id(", n - 1, ", ",
            n - 1, "))");
  text.line("all.contact = sim.contact { surfaces = { sim.surface { grid = p } }, thickness = ",
            text.between(0.02, 0.15) * s, ", friction = ", friction, " }");
  text.line("all.bodies = {}");
  for (int i = 0; i < bodies; ++i) {
    const char* const shapes[] = {
        "sim.sphere { radius = 0.08 }", "sim.box { half = {0.09, 0.02, 0.05} }",
        "sim.capsule { radius = 0.02, length = 0.2 }",
        "sim.compound { { sim.box { half = {0.06, 0.02, 0.02} } }, { sim.sphere { radius = 0.03 }, "
        "at = {0.06, 0, 0} } }"};
    text.line("all.bodies[#all.bodies + 1] = sim.rigid { shape = ",
              shapes[text.random.integer(0, 3)], ", mass = ", text.random.decade(-2, 0.3),
              ", position = ", triple(text.between(-0.1, 0.1), 0.6 + 0.25 * i, 0),
              ", velocity = ", triple(text.random.vector(2)),
              ", rotation = ", triple(text.random.vector(1)), ", friction = ", friction, " }");
  }
  if (text.random.chance(0.5)) add_ground(text, 0.3, friction);
  return text.end(dt, text.between(0.2, 0.4));
}

std::string solids(std::uint64_t seed) {
  Text text(seed);
  add_gravity(text);
  const int n = text.random.integer(2, 4);
  const double young = text.random.decade(3.3, 5.5), density = 500, a = 0.15;
  const double poisson = text.random.chance(0.4) ? text.between(0.45, 0.499) : text.between(0, 0.4);
  text.line("p = sim.grid { ", n, ", ", n, ", ", text.random.integer(2, 4),
            ", origin = {0, 0.05, 0}, du = ", triple(a, 0, 0), ", dv = ", triple(0, a, 0),
            ", dw = ", triple(0, 0, a), " }");
  text.line("forces[#forces + 1] = sim.force.fem { cells = sim.cells { grid = p }, young = ", young,
            ", poisson = ", poisson, ", density = ", density, ", model = '",
            text.random.chance(0.5) ? "neo_hookean" : "corotated", "' }");
  text.line("forces[#forces + 1] = sim.force.drag { k = ", text.random.decade(-3, -1), " }");
  if (text.random.chance(0.5))
    text.line("for i = 0, ", n - 1, " do p:pin(p:id(i, 0, 0)) p:pin(p:id(i, 1, 0)) end");
  else
    add_ground(text, 0.04, text.between(0, 0.5));
  const double bulk = young * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson));
  const double dt = 0.15 * a / std::sqrt(bulk / density);
  return text.end(dt, std::min(0.5, 150 * dt));
}

std::string fluids(std::uint64_t seed) {
  Text text(seed);
  add_gravity(text);
  const double a = 0.05, sound = text.between(15, 30);
  const int wide = text.random.integer(3, 6), high = text.random.integer(3, 6);
  text.line("p = sim.particles { mass = ", 1000 * a * a * a, " }");
  for (int i = 0; i < wide; ++i)
    for (int j = 0; j < high; ++j)
      for (int k = 0; k < 3; ++k)
        text.line("p:add ", triple((i + 0.5) * a - 0.5, (j + 0.5) * a, (k + 0.5) * a));
  text.line("local room = sim.collider.box { center = {0, 1, ", 1.5 * a, "}, half = {0.5, 1, ",
            1.5 * a, "}, inside = true, thickness = ", a / 4, " }");
  text.line("all.colliders = { room }");
  text.line("forces[#forces + 1] = sim.force.fluid { particles = p, density = 1000, boundary = ",
            "{ room }, speed_of_sound = ", sound, ", alpha = ", text.between(0.02, 0.2), " }");
  return text.end(0.3 * 1.5 * a / sound, text.between(0.05, 0.25));
}

std::string wind(std::uint64_t seed) {
  Text text(seed);
  add_gravity(text);
  const int n = text.random.integer(4, 7);
  const double dt =
      add_sheet(text, n, text.random.decade(1, 2.6), triple(0, 0, 1.0 / n), triple(1.0 / n, 0, 0));
  text.line("p:pin(p:id(0, 0)) p:pin(p:id(0, ", n - 1, "))");
  text.line(
      "forces[#forces + 1] = sim.force.wind { surface = sim.surface { grid = p }, velocity = ",
      triple(text.random.vector(4)), ", breeze = ", text.between(0, 2),
      ", tau = ", text.random.decade(-1, 0.3), ", length = 0.5 }");
  return text.end(dt, text.between(0.5, 1.5));
}

std::string formulas(std::uint64_t seed) {
  Text text(seed);
  const int n = text.random.integer(1, 5);
  add_chain(text, n, 0, text.between(0.3, 2));
  text.line(
      "forces[#forces + 1] = sim.force.expression { 'depth*((x/a)^2 - 1)^2 + 0.5*k*((y - 1)^2 ",
      "+ z^2)', depth = ", text.between(0.5, 4), ", a = ", text.between(0.4, 1),
      ", k = ", text.random.decade(0, 2), " }");
  if (text.random.chance(0.5))
    text.line("forces[#forces + 1] = sim.force.expression { fx = '-c*vx*abs(vx)', fy = ",
              "'w*sin(f*t)', c = ", text.between(0, 0.5), ", w = ", text.between(0, 3),
              ", f = ", text.random.decade(0, 1.5), " }");
  return text.end(0.01, text.between(2, 8));
}

std::string lua(std::uint64_t seed) {
  Text text(seed);
  const int n = text.random.integer(2, 6);
  std::ostringstream start;
  for (int i = 0; i < 2 * n; ++i) start << (i ? ", " : "") << text.between(-1, 1);
  text.line("all.state = { ", start.str(), " }");
  text.line("local k, c, w = ", text.random.decade(0, 2), ", ", text.between(0, 0.5), ", ",
            text.between(0.5, 5));
  // Pendulums in a row: x' = v, v' = -sin x + k (x_left + x_right - 2 x) - c v + sin(w t).
  text.line(
      "all.field = sim.field.lua { function(t, x)\n"
      "  local d, n = {}, #x // 2\n"
      "  for i = 1, n do\n"
      "    local l, r = x[math.max(1, i - 1)], x[math.min(n, i + 1)]\n"
      "    d[i] = x[n + i]\n"
      "    d[n + i] = -math.sin(x[i]) + k*(l + r - 2*x[i]) - c*x[n + i] + 0.3*math.sin(w*t)\n"
      "  end\n"
      "  return d\n"
      "end }");
  return text.end(0.02, text.between(2, 8));
}

std::string lattices(std::uint64_t seed) {
  Text text(seed);
  const int n = text.random.integer(6, 24);
  text.line("all.state = {}");
  text.line("for i = 1, ", n, " do all.state[2*i - 1] = 1 + 0.5*math.sin(", text.between(0, 6),
            "*i) all.state[2*i] = 0.5 + 0.4*math.cos(", text.between(0, 6), "*i) end");
  const char* fields[] = {
      "'1 + u^2*v - 4*u + p*(u[-1] + u[1] - 2*u)', '3*u - u^2*v + q*(v[-1] + v[1] - 2*v)'",
      "'u*(1 - v) + p*(u[-1] + u[1] - 2*u)', 'v*(u - 1) + q*(v[-1] + v[1] - 2*v)'",
      "'v', '-sin(u) + p*(u[-1] + u[1] - 2*u) - q*v'"};
  const char* boundaries[] = {"'periodic'", "'mirror'", "{1, 0.5}"};
  text.line("all.field = sim.field.formula { ", fields[text.random.integer(0, 2)],
            ", names = {'u', 'v'}, cells = ", n,
            ", boundary = ", boundaries[text.random.integer(0, 2)],
            ", p = ", text.random.decade(-2, 1), ", q = ", text.random.decade(-2, 0.5), " }");
  return text.end(0.02, text.between(1, 6));
}

// Many that know nothing of each other, with starts of their own.
std::string ensembles(std::uint64_t seed) {
  Text text(seed);
  const int n = text.random.integer(10, 60);
  text.line("all.state = {}");
  text.line("for i = 1, ", n, " do all.state[2*i - 1] = ", text.between(0.5, 3.1), "*math.sin(i) ",
            "all.state[2*i] = ", text.between(0, 1), "*math.cos(3*i) end");
  text.line(
      "all.field = sim.field.formula { 'v', '-sin(u) - c*v + w*cos(t)', names = {'u', 'v'}, "
      "cells = ",
      n, ", c = ", text.between(0, 0.3), ", w = ", text.between(0, 1.2), " }");
  return text.end(0.05, text.between(5, 20));
}

// A stiff tie among soft ones, for methods that treat it apart.
std::string imex(std::uint64_t seed) {
  Text text(seed);
  add_gravity(text);
  const int n = text.random.integer(3, 8);
  const double soft = text.random.decade(0.5, 2), stiff = soft * text.random.decade(1, 4);
  const double dt = add_chain(text, n, soft, 0.5);
  text.line("p:pin(0)");
  text.line("forces[#forces + 1] = sim.force.spring { family = 'stiff', stiffness = ", stiff,
            ", ties = { {0, 1} } }");
  text.line("forces[#forces + 1] = sim.force.drag { k = ", text.between(0, 0.5), " }");
  return text.end(std::min(dt, 0.3 / std::sqrt(2 * stiff)), text.between(0.5, 2));
}

constexpr HuntKind kKinds[] = {
    {"colliders", colliders},     {"friction", friction}, {"self_contact", self_contact},
    {"constraints", constraints}, {"bodies", bodies},     {"caught", caught},
    {"solids", solids},           {"fluids", fluids},     {"wind", wind},
    {"formulas", formulas},       {"lua", lua},           {"lattices", lattices},
    {"ensembles", ensembles},     {"imex", imex},         {"joints", joints}};

}  // namespace

std::span<const HuntKind> hunt_kinds() { return kKinds; }

}  // namespace sim_test
