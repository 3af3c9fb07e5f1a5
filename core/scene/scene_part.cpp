#include "core/scene/scene_part.h"

#include <algorithm>
#include <utility>

namespace sim {
namespace {

using Surface = std::shared_ptr<const TriangleMesh>;

class Selection {
 public:
  Selection(const SystemSpec& whole, std::span<const int> ids)
      : ids_(ids),
        number_(static_cast<std::size_t>(whole.particles->count()) + whole.points.size(), -1) {
    for (std::size_t i = 0; i < ids.size(); ++i)
      number_[static_cast<std::size_t>(ids[i])] = static_cast<int>(i);
    for (std::size_t k = 0; k < whole.points.size(); ++k) {
      const int body = whole.points[k].body;
      if ((*this)(whole.bodies[static_cast<std::size_t>(body)].first) >= 0)
        number_[number_.size() - whole.points.size() + k] = count() + points_++;
    }
  }

  int operator()(int id) const { return number_[static_cast<std::size_t>(id)]; }  // -1: left out
  int count() const { return static_cast<int>(ids_.size()); }

  std::vector<int> of(const std::vector<int>& ids) const {
    std::vector<int> left;
    for (const int id : ids)
      if ((*this)(id) >= 0) left.push_back((*this)(id));
    return left;
  }

  template <class T>
  std::vector<T> values(const std::vector<T>& of_all) const {
    std::vector<T> left;
    if (of_all.empty()) return left;
    for (const int id : ids_) left.push_back(of_all[static_cast<std::size_t>(id)]);
    return left;
  }

  Elements elements(const Elements& all) const {
    Elements left{.arity = all.arity, .cells = all.cells};
    std::vector<GridPairs> in_parts;
    for (const GridPairs& grid : all.grids) {
      if (has_all(grid)) {
        left.grids.push_back(grid);
        left.grids.back().first = (*this)(grid.first);
      } else {
        in_parts.push_back(grid);
      }
    }
    for (const auto& [name, values] : all.values) left.values[name];
    const Elements listed{.arity = all.arity, .grids = std::move(in_parts), .ids = all.ids};
    listed.for_each([&](const Element& element) {
      if ((*this)(element.ids.front()) < 0) return;
      for (const int id : element.ids) left.ids.push_back((*this)(id));
      for (auto& [name, values] : left.values)
        values.push_back(element.index < 0
                             ? std::nan("")
                             : all.values.at(name)[static_cast<std::size_t>(element.index)]);
    });
    return left;
  }

  // Null if none of its triangles is left.
  Surface surface(const Surface& whole) const {
    std::vector<TriangleMesh::Triangle> triangles;
    for (const TriangleMesh::Triangle& all : whole->triangles())
      if ((*this)(all[0]) >= 0)
        triangles.push_back({(*this)(all[0]), (*this)(all[1]), (*this)(all[2])});
    if (triangles.empty()) return nullptr;
    return std::make_shared<const TriangleMesh>(count(), std::move(triangles));
  }

  // False if nothing is left of the part.
  bool keep(PartSpec& part) const {
    if (!part.elements.empty()) {
      part.elements = elements(part.elements);
      if (part.elements.empty()) return false;
    }
    if (part.particles) {
      part.particles = of(*part.particles);
      if (part.particles->empty()) return false;
    }
    for (auto& [name, value] : part.given)
      if (auto* const mesh = std::get_if<Surface>(&value))
        if (*mesh = surface(*mesh); !*mesh) return false;
    return true;
  }

 private:
  bool has_all(const GridPairs& grid) const {
    const int size = grid.size[0] * grid.size[1] * grid.size[2], first = (*this)(grid.first);
    if (first < 0) return false;
    for (int i = 0; i < size; ++i)
      if ((*this)(grid.first + i) != first + i) return false;
    return true;
  }

  std::span<const int> ids_;
  std::vector<int> number_;  // of particles, then of points of bodies
  int points_ = 0;           // of bodies that are kept
};

ParticlesSpec particles_of(const ParticlesSpec& whole, const Selection& selection,
                           std::span<const int> ids) {
  ParticlesSpec part;
  for (const int id : ids) part.list.push_back(whole.at(id));
  part.pinned = selection.of(whole.pinned);
  for (PrescribedSpec prescribed : whole.prescribed) {
    prescribed.particle = selection(prescribed.particle);
    if (prescribed.particle >= 0) part.prescribed.push_back(std::move(prescribed));
  }
  for (const auto& [name, values] : whole.numbers) part.numbers[name] = selection.values(values);
  return part;
}

void add_bodies(const SystemSpec& whole, const Selection& selection, SystemSpec& part) {
  std::vector<int> number;  // of each body of the whole among those of the part
  for (const RigidSpec& body : whole.bodies) {
    const int first = selection(body.first);
    number.push_back(first < 0 ? -1 : static_cast<int>(part.bodies.size()));
    if (first < 0) continue;
    part.bodies.push_back(body);
    part.bodies.back().first = first;
  }
  for (const BodyPoint& point : whole.points)
    if (const int body = number[static_cast<std::size_t>(point.body)]; body >= 0)
      part.points.push_back({body, point.at});
  part.body_contact = whole.body_contact;
}

}  // namespace

SystemSpec scene_part(const SystemSpec& whole, std::span<const int> ids) {
  const Selection selection(whole, ids);
  SystemSpec part;
  part.name = whole.name;
  part.particles = particles_of(*whole.particles, selection, ids);
  for (const auto parts : {&SystemSpec::forces, &SystemSpec::colliders, &SystemSpec::constraints})
    for (PartSpec each : whole.*parts)
      if (selection.keep(each)) (part.*parts).push_back(std::move(each));
  part.accuracy = whole.accuracy;
  add_bodies(whole, selection, part);
  if (whole.contact) {
    part.contact = whole.contact;
    const bool of_bodies = whole.contact->surfaces.empty() && !part.bodies.empty();
    part.contact->surfaces.clear();
    for (const Surface& each : whole.contact->surfaces)
      if (Surface left = selection.surface(each)) part.contact->surfaces.push_back(std::move(left));
    if (part.contact->surfaces.empty() && !of_bodies) part.contact.reset();
  }
  part.loads = selection.values(whole.loads);
  part.integrator = whole.integrator;
  part.dt = whole.dt;
  part.duration = whole.duration;
  part.place = whole.place;
  part.one_thread = whole.one_thread;
  return part;
}

}  // namespace sim
