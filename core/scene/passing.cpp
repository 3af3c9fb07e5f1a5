#include "core/scene/passing.h"

#include <algorithm>

#include "core/base/text.h"

namespace sim {
namespace {

constexpr std::size_t kMostNames = 4;

// "particles 0 to 9 and 20", "bodies 0 to 2"; ascending numbers.
std::string listed(const char* one, const char* several, const std::vector<int>& numbers) {
  std::vector<std::string> runs;
  for (std::size_t k = 0, next = 0; k < numbers.size(); k = next) {
    next = k + 1;
    while (next < numbers.size() && numbers[next] == numbers[next - 1] + 1) ++next;
    runs.push_back(std::to_string(numbers[k]));
    if (next - k > 1) runs.back() += " to " + std::to_string(numbers[next - 1]);
  }
  const std::size_t shown = std::min(runs.size(), kMostNames);
  std::string text = numbers.size() == 1 ? one : several;
  for (std::size_t k = 0; k < shown; ++k)
    text += (k == 0 ? " " : k + 1 < runs.size() ? ", " : " and ") + runs[k];
  return shown < runs.size() ? text + " and others" : text;
}

std::string name_of(const PartSpec& part) {
  return "force '" + part.plugin + "'" + (part.place.empty() ? "" : " at " + part.place);
}

}  // namespace

std::string collider_text(const std::string& plugin, const std::map<std::string, Value>& given) {
  std::string text;
  for (const auto& [name, value] : given)
    text += (text.empty() ? "" : ", ") + name + " = " + to_text(value);
  return "sim.collider." + plugin + " { " + text + " }";
}

std::string open_note(const PartSpec& part, const SystemSpec& spec) {
  const auto found = part.given.find("boundary");
  if (found == part.given.end()) return {};
  Colliders boundary;
  if (const auto* const all = std::get_if<Colliders>(&found->second)) boundary = *all;
  if (const auto* const one = std::get_if<Colliders::value_type>(&found->second)) boundary = {*one};
  for (const auto& collider : boundary) {
    const auto same = [&](const PartSpec& other) {
      return collider_text(other.plugin, other.given) == collider->text;
    };
    if (!collider->text.empty() && std::ranges::none_of(spec.colliders, same))
      return name_of(part) + " has " + collider->text +
             " in its boundary, which is none of the scene's colliders: particles may pass it; "
             "name it in both";
  }
  return {};
}

std::string passing_note(const Force& force, const PartSpec& part, const SystemSpec& spec) {
  const auto [unseen, remedy] = force.unseen();
  std::vector<int> particles, bodies;
  for (const int id : unseen) {
    const int behind = spec.bodies.empty() ? -1 : id - spec.bodies.front().first;
    if (behind < 0)
      particles.push_back(id);
    else if (behind % RigidBody::kParticles == 0)
      bodies.push_back(behind / RigidBody::kParticles);
  }
  std::vector<std::string> names;
  if (!particles.empty()) names.push_back(listed("particle", "particles", particles));
  if (!bodies.empty()) names.push_back(listed("body", "bodies", bodies));
  if (names.empty()) return {};
  return name_of(part) + " does not see " + join(names, " and ") + ": it flows through them; " +
         remedy;
}

}  // namespace sim
