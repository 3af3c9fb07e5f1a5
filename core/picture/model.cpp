#include "core/picture/model.h"

#include <algorithm>
#include <map>
#include <set>

#include "core/fields/field_system.h"
#include "core/geometry/cells.h"
#include "core/geometry/triangle_mesh.h"
#include "core/particles/constraints/constraint_system.h"
#include "core/particles/elements/torn_faces.h"
#include "core/particles/particles.h"
#include "core/scene/simulation.h"

namespace sim {
namespace {

// Against gravity, where the scene has one.
Vec3 up_of(const SystemSpec& spec) {
  for (const PartSpec& part : spec.forces) {
    const auto g = part.given.find("g");
    if (part.plugin != "gravity" || g == part.given.end()) continue;
    if (const Vec3* down = std::get_if<Vec3>(&g->second); down && down->norm() > 0)
      return -*down / down->norm();
  }
  return {0, 1, 0};
}

std::vector<ModelFamily> families_of(const Simulation& system) {
  std::vector<ModelFamily> families;
  std::map<std::string, std::size_t> places;
  for (int i = 0; i < system.particles(); ++i)
    for (const Link& link : system.links(i)) {
      if (link.to <= i) continue;
      const auto [place, is_new] = places.emplace(link.family, families.size());
      if (is_new) families.push_back({.name = link.family});
      ModelFamily& family = families[place->second];
      family.ends.push_back({i, link.to});
      family.rest.push_back(link.rest);
      family.stiffness.push_back(link.stiffness);
      family.sense.push_back(link.sense);
    }
  // In the order of the scene, which particle 0 alone may not show.
  std::vector<ModelFamily> ordered;
  for (const auto& [name, count] : system.families()) {
    const auto place = places.find(name);
    if (place == places.end()) continue;
    ordered.push_back(std::move(families[place->second]));
    places.erase(place);
  }
  return ordered;
}

// Pairs of particles that an equation joins, but for those of rigid bodies.
void add_rods(const Simulation& system, const std::vector<int>& in_bodies,
              std::vector<ModelFamily>& families) {
  if (system.constraint_system() == nullptr) return;
  const Constraints& constraints = system.constraint_system()->constraints();
  const RowList& rows = constraints.rows();
  const auto bound = [&](int i) { return std::ranges::count(in_bodies, i) > 0; };
  std::map<std::string, std::set<std::pair<int, int>>> pairs;
  for (int row = 0; row < rows.rows(); ++row) {
    const std::span<const int> ids = rows.pattern.of(row);
    if (ids.size() != 2 || bound(ids[0]) || bound(ids[1])) continue;
    pairs[constraints.title(rows.part_of(row))].insert(std::minmax(ids[0], ids[1]));
  }
  for (const auto& [name, joined] : pairs) {
    ModelFamily& family = families.emplace_back(ModelFamily{.name = name, .rods = true});
    for (const auto& ends : joined) {
      const auto [a, b] = ends;
      family.ends.push_back({a, b});
      family.rest.push_back((system.position(a) - system.position(b)).norm());
      family.stiffness.push_back(0);
      family.sense.push_back(SpringSense::kBoth);
    }
  }
}

// Ties that are no springs between particles and no rods: those of formulas, and strings and
// springs to points of bodies.
std::vector<ModelTie> ties_of(const SystemSpec& spec, const Simulation& system) {
  std::vector<ModelTie> ties;
  const int n = system.particles();
  const auto point = [&](int id) {
    if (id < n) return ModelPoint{1, {id}, {1}};
    const BodyPoint& at = spec.points[static_cast<std::size_t>(id - n)];
    const RigidBody& body = system.body(at.body);
    const int a = body.first();
    return ModelPoint{4, {a, a + 1, a + 2, a + 3}, body.weights(at.at)};
  };
  const auto add = [&](const PartSpec& part, bool between_particles) {
    if (part.elements.arity != 2) return;
    part.elements.for_each([&](const Element& tie) {
      const bool body = tie.ids[0] >= n || tie.ids[1] >= n;
      if (body || between_particles) ties.push_back({point(tie.ids[0]), point(tie.ids[1])});
    });
  };
  for (const PartSpec& part : spec.forces) add(part, part.plugin != "spring");
  for (const PartSpec& part : spec.constraints) add(part, false);
  return ties;
}

// The skin of all cells that bodies consist of.
std::vector<std::array<int, 3>> skin_of_bodies(const SystemSpec& spec) {
  std::vector<std::array<int, 3>> triangles;
  const auto at = [&](int id) { return spec.particles->at(id).position; };
  for (const PartSpec& part : spec.forces) {
    if (!part.elements.cells) continue;
    const auto skin = skin_of(part.elements.ids, part.elements.arity, at);
    triangles.insert(triangles.end(), skin.begin(), skin.end());
  }
  return triangles;
}

// The grids whose particles have cells.
std::set<const GridSpec*> grids_of_bodies(const SystemSpec& spec) {
  std::set<const GridSpec*> grids;
  for (const PartSpec& part : spec.forces)
    if (part.elements.cells)
      for (const int id : part.elements.ids) grids.insert(spec.particles->grid_of(id));
  return grids;
}

// Surfaces that the scene names; else the skin of its bodies, and the sheets and blocks of grids
// without cells, if something ties their particles: loose ones are no surface.
std::vector<std::array<int, 3>> triangles_of(const SystemSpec& spec, bool tied) {
  std::vector<std::array<int, 3>> triangles;
  for (const auto& surface : spec.surfaces)
    triangles.insert(triangles.end(), surface->triangles().begin(), surface->triangles().end());
  if (!triangles.empty() || !spec.particles) return triangles;
  triangles = skin_of_bodies(spec);
  if (!tied) return triangles;
  const std::set<const GridSpec*> filled = grids_of_bodies(spec);
  const auto add = [&](const GridSpec& grid) {
    const auto wide = std::ranges::count_if(grid.size, [](int size) { return size > 1; });
    if (wide < 2 || filled.contains(&grid)) return;
    const auto more = grid.triangles();
    triangles.insert(triangles.end(), more.begin(), more.end());
  };
  if (spec.particles->grid) add(*spec.particles->grid);
  std::ranges::for_each(spec.particles->added_grids, add);
  return triangles;
}

// The forces beyond springs, one gravity and one drag.
std::vector<std::string> others_of(const SystemSpec& spec, const Particles& particles,
                                   const std::vector<std::string>& off) {
  std::set<std::string> others;
  for (const Force* force : particles.forces())
    if (std::ranges::count(particles.other_forces(), force) > 0 || force->internal_size() > 0)
      others.insert(force->springs() ? "damping of springs"
                                     : "force '" + particles.name_of(*force) + "'");
  const auto add = [&](const char* kind, const std::vector<PartSpec>& parts) {
    for (const PartSpec& part : parts)
      if (part.switch_name.empty() || !std::ranges::binary_search(off, part.switch_name))
        others.insert(std::string(kind) + " '" + part.plugin + "'");
  };
  add("collider", spec.colliders);
  add("constraint", spec.constraints);
  if (!spec.bodies.empty()) others.insert("rigid bodies");
  if (spec.contact) others.insert("contact of surfaces");
  if (!spec.particles->prescribed.empty()) others.insert("leads");
  return {others.begin(), others.end()};
}

// The names and cells of a flat state with more than one cell; none of other systems.
FieldLayout layout_of(const Simulation& system) {
  if (!system.flat()) return {};
  const auto* field = dynamic_cast<const FieldSystem*>(&system.ode());
  FieldLayout layout = field ? field->field().layout() : FieldLayout{};
  if (layout.cells == std::array<int, 3>{1, 1, 1}) layout.names.clear();
  return layout;
}

int directions_of(const FieldLayout& layout) {
  return static_cast<int>(std::ranges::count_if(layout.cells, [](int n) { return n > 1; }));
}

// Curves of a lattice in one direction stand beside its axis, half as high as it is long at the
// start.
double height_of(const Simulation& system) {
  const auto start = dynamic_cast<const FieldSystem&>(system.ode()).start();
  const auto [low, high] = std::ranges::minmax(start);
  const double range = high > low ? high - low : std::max(std::abs(high), std::abs(low));
  return range > 0 ? 0.5 / range : 1;
}

void add_lattice(const FieldLayout& layout, Model& model) {
  const int cells = layout.cells[0] * layout.cells[1] * layout.cells[2];
  model.names = layout.names;
  model.grid = layout.cells;
  if (directions_of(layout) > 1) {
    model.particles = cells;
    model.triangles = grid_triangles(layout.cells, false);
    return;
  }
  model.particles = cells * static_cast<int>(layout.names.size());
  model.grid = {0, 0, 0};
  int first = 0;
  for (const std::string& name : layout.names) {
    ModelFamily& family = model.families.emplace_back(ModelFamily{.name = name, .rods = true});
    for (int i = 0; i + 1 < cells; ++i) family.ends.push_back({first + i, first + i + 1});
    family.rest.resize(family.ends.size());
    family.stiffness.resize(family.ends.size());
    family.sense.resize(family.ends.size(), SpringSense::kBoth);
    first += cells;
  }
}

// Places the points of a lattice in the picture.
void place_lattice(const Simulation& system, const FieldLayout& layout, Frame& frame) {
  const auto& n = layout.cells;
  const std::size_t names = layout.names.size();
  const int cells = n[0] * n[1] * n[2];
  if (directions_of(layout) > 1) {
    for (int i = 0; i < n[0]; ++i)
      for (int j = 0; j < n[1]; ++j)
        for (int k = 0; k < n[2]; ++k)
          frame.x.insert(frame.x.end(), {double(i), double(j), double(k)});
    return;
  }
  const double scale = height_of(system);
  for (std::size_t name = 0; name < names; ++name)
    for (int i = 0; i < cells; ++i) {
      const double value = frame.components[static_cast<std::size_t>(i) * names + name];
      frame.x.insert(frame.x.end(), {double(i) / (cells - 1), scale * value, 0});
    }
}

}  // namespace

std::vector<bool> Model::in_triangles() const {
  std::vector<bool> in(static_cast<std::size_t>(particles));
  for (const auto& triangle : triangles)
    for (const int i : triangle) in[static_cast<std::size_t>(i)] = true;
  for (const int i : in_bodies) in[static_cast<std::size_t>(i)] = true;
  if (curves()) in.assign(in.size(), true);
  // The interior of a block is hidden by its skin.
  if (!triangles.empty() && std::ranges::min(grid) > 1)
    std::fill_n(in.begin(), grid[0] * grid[1] * grid[2], true);
  return in;
}

Model make_model(const SystemSpec& spec, Simulation& system) {
  Model model;
  model.name = system.name();
  model.method = system.method().label();
  model.h = system.h();
  model.second_order = system.second_order();
  model.flat = system.flat();
  model.particles = model.flat ? 1 : system.particles();
  if (const FieldLayout layout = layout_of(system); !layout.names.empty())
    add_lattice(layout, model);
  if (!spec.particles) return model;
  for (int i = 0; i < model.particles; ++i) {
    model.mass.push_back(spec.particles->at(i).mass);
    if (system.pinned(i)) model.pinned.push_back(i);
  }
  for (const RigidSpec& body : spec.bodies)
    for (int p = 0; p < RigidBody::kParticles; ++p) model.in_bodies.push_back(body.first + p);
  model.families = families_of(system);
  add_rods(system, model.in_bodies, model.families);
  model.ties = ties_of(spec, system);
  const bool tied =
      !model.families.empty() ||
      std::ranges::any_of(spec.forces, [](const PartSpec& part) { return !part.elements.empty(); });
  model.triangles = triangles_of(spec, tied);
  if (spec.particles->grid) model.grid = spec.particles->grid->size;
  model.up = up_of(spec);
  const auto& particles = dynamic_cast<const Particles&>(system.ode());
  const Motion& motion = particles.motion();
  model.gravity = {motion.gravity[0], motion.gravity[1], motion.gravity[2]};
  model.drag = motion.damping;
  model.others = others_of(spec, particles, system.settings().off);
  return model;
}

Frame take_frame(const Simulation& system) {
  Frame frame;
  frame.step = system.step_count();
  frame.t = system.t();
  if (system.flat()) {
    const int n = system.components();
    for (int i = 0; i < n; ++i) frame.components.push_back(system.component(i));
    if (const FieldLayout layout = layout_of(system); !layout.names.empty()) {
      place_lattice(system, layout, frame);
      return frame;
    }
    // Its first two or three components as a point; a single one goes up over the time.
    frame.x = n == 1 ? std::vector<double>{system.t(), system.component(0), 0}
                     : std::vector<double>{system.component(0), system.component(1),
                                           n > 2 ? system.component(2) : 0};
    return frame;
  }
  const auto n = static_cast<std::size_t>(system.particles());
  const auto copy = [&](const char* name, std::vector<double>& out) {
    const StatePart* part = system.shape().find(name);
    if (part == nullptr) return;
    out.resize(3 * n);
    for (std::size_t i = 0; i < n; ++i)
      for (std::size_t c = 0; c < 3; ++c) out[3 * i + c] = system.state()[part->at(i, c)];
  };
  copy("position", frame.x);
  copy("velocity", frame.v);
  frame.solids = system.shapes();
  frame.torn.assign(system.torn().begin(), system.torn().end());
  return frame;
}

bool torn(const Frame& frame, int a, int b) { return torn_edge(frame.torn, a, b); }
bool torn(const Frame& frame, const std::array<int, 3>& t) { return torn_face(frame.torn, t); }

double strain(const Model& model, const Frame& frame, int family, std::size_t spring) {
  const ModelFamily& springs = model.families[static_cast<std::size_t>(family)];
  const auto [a, b] = springs.ends[spring];
  const double rest = springs.rest[spring];
  if (!(rest > 0) || torn(frame, a, b)) return std::nan("");
  return (frame.at(b) - frame.at(a)).norm() / rest - 1;
}

}  // namespace sim
