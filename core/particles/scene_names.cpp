#include "core/particles/scene_names.h"

#include <algorithm>

#include "core/base/text.h"
#include "core/particles/rigid/rigid_body.h"

namespace sim {
namespace {

constexpr std::size_t kMostNames = 4;

// Lists ascending numbers as "particles 0 to 9 and 20" or "bodies 0 to 2".
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

}  // namespace

std::string SceneNames::particles(std::span<const int> ids) const {
  std::vector<int> single, bodies;
  for (const int id : ids) {
    const int behind = first_of_bodies < 0 ? -1 : id - first_of_bodies;
    if (behind < 0)
      single.push_back(id);
    else if (behind % RigidBody::kParticles == 0)
      bodies.push_back(behind / RigidBody::kParticles);
  }
  std::vector<std::string> names;
  if (!single.empty()) names.push_back(listed("particle", "particles", single));
  if (!bodies.empty()) names.push_back(listed("body", "bodies", bodies));
  return join(names, " and ");
}

}  // namespace sim
