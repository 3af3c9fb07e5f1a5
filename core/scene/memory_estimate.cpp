#include "core/scene/memory_estimate.h"

#include <algorithm>

#include "core/base/memory.h"
#include "core/geometry/triangle_mesh.h"

namespace sim {
namespace {

// Bytes, nine tenths of the measured use of this program's scenes from 400 x 400 on.
constexpr double kParticle = 240;   // its description, X twice, the memory of a step
constexpr double kStage = 8;        // more for each evaluation of a step
constexpr double kEmbedded = 300;   // the additional memory of an adaptive method
constexpr double kImplicit = 1000;  // vectors of Newton's method and of the linear solver
constexpr double kListed = 56;      // of a particle that is no place of a grid
constexpr double kTie = 40;         // of a listed element: ids, description, place in a run or net
constexpr double kStiffness = 40;   // of an element whose derivatives an implicit method keeps
constexpr double kRod = 1100;       // of a chain, whose matrix has no fill
constexpr double kProducts = 4000;  // of implicit methods on constraints: vectors of GMRES
constexpr double kNumber = 8 * 12;  // of a first-order state: X twice, stages

// The needs of files of frames. A checkpoint is written from the state, and takes nothing.
constexpr double kModelParticle = 27;  // mass, triangles of a grid
constexpr double kModelTie = 22;       // ends, rest length, stiffness
constexpr double kFrames = 200;        // of a particle: the present frame, in all its copies

double elements_of(const SystemSpec& spec, bool listed) {
  double count = 0;
  for (const PartSpec& part : spec.forces) {
    if (part.elements.arity == 0) continue;
    count += static_cast<double>(listed ? part.elements.listed() : part.elements.count());
  }
  return count;
}

double triangles_of(const RigidShape& shape) {
  constexpr double kOfBox = 12;
  double count = 0;
  each_part(shape, [&](const RigidShape& part, const Vec3&, const Mat3&) {
    count += part.is_round()                       ? 1
             : part.form == RigidShape::Form::kBox ? kOfBox
                                                   : static_cast<double>(part.triangles.size());
  });
  return count;
}

}  // namespace

double MemoryEstimate::total() const {
  double sum = 0;
  for (const auto& [what, bytes] : parts) sum += bytes;
  return sum;
}

std::string MemoryEstimate::text() const {
  auto sorted = parts;
  std::ranges::stable_sort(sorted, std::greater{}, &std::pair<std::string, double>::second);
  std::string text;
  for (const auto& [what, bytes] : sorted)
    if (bytes > 0.01 * total()) text += (text.empty() ? "" : ", ") + what + " " + bytes_text(bytes);
  return text;
}

MemoryEstimate memory_estimate(const SystemSpec& spec, const IntegratorInfo& method,
                               Registry& registry) {
  MemoryEstimate needs;
  if (!spec.particles) {
    if (spec.first_order)
      needs.parts.emplace_back("state",
                               kNumber * static_cast<double>(spec.first_order->state.size()));
    return needs;
  }
  const auto n = static_cast<double>(spec.particles->count());
  needs.parts.emplace_back(
      "particles", kParticle * n + kListed * static_cast<double>(spec.particles->list.size()));
  const double stages = method.implicit ? 0 : std::max(0, method.evaluations);
  needs.parts.emplace_back("the method", (stages * kStage + (method.adaptive ? kEmbedded : 0) +
                                          (method.implicit ? kImplicit : 0)) *
                                             n);
  double of_forces = 0;
  for (const PartSpec& part : spec.forces)
    if (part.elements.arity != 0)
      of_forces += registry.get<Force>(part.plugin, part.place).element_bytes *
                   static_cast<double>(part.elements.listed());
  needs.parts.emplace_back("springs and other ties", kTie * elements_of(spec, true) + of_forces);
  if (method.implicit)
    needs.parts.emplace_back("their derivatives", kStiffness * elements_of(spec, false));
  double rods = 0;
  for (const PartSpec& part : spec.constraints)
    if (part.elements.arity != 0) rods += static_cast<double>(part.elements.count());
  needs.parts.emplace_back("constraints", kRod * rods);
  if (method.implicit && !spec.constraints.empty())
    needs.parts.emplace_back("vectors of GMRES", kProducts * n);
  if (!spec.contact) return needs;
  const double each =
      registry.get<StepCorrection>(spec.contact->plugin, spec.contact->place).element_bytes;
  double triangles = 0;
  for (const auto& surface : spec.contact->surfaces)
    triangles += static_cast<double>(surface->triangles().size());
  if (triangles > 0)
    for (const RigidSpec& body : spec.bodies)
      if (body.touches) triangles += triangles_of(*body.shape);
  needs.parts.emplace_back("contact", each * triangles);
  return needs;
}

MemoryEstimate memory_estimate_of_files(const SystemSpec& spec, int files) {
  MemoryEstimate needs;
  if (!spec.particles || files == 0) return needs;
  const auto n = static_cast<double>(spec.particles->count());
  // Each file has a model of the scene, and one more exists while they are made.
  needs.parts.emplace_back(
      "models of the scene",
      (files + 1) * (kModelParticle * n + kModelTie * elements_of(spec, false)));
  needs.parts.emplace_back("frames", kFrames * n);
  return needs;
}

void require_room_for_files(const SystemSpec& spec, int files) {
  const MemoryEstimate needs = memory_estimate_of_files(spec, files);
  require_memory(needs.total(),
                 "the files of '" + spec.name + "' need " + needs.text() + ": in all", spec.place,
                 "write fewer of them in one run");
}

void require_room(const SystemSpec& spec, const IntegratorInfo& method, Registry& registry) {
  const MemoryEstimate needs = memory_estimate(spec, method, registry);
  require_memory(needs.total(), "'" + spec.name + "' needs " + needs.text() + ": in all",
                 spec.place, "make it smaller, or take a method that keeps less, as verlet");
}

}  // namespace sim
