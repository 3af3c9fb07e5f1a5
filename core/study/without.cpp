#include "core/study/without.h"

#include <algorithm>
#include <vector>

#include "core/base/error.h"
#include "core/base/text.h"

namespace sim::study {
namespace {

// The names by which --without knows a part: its plugin, or the family of springs.
std::vector<std::string> names_of(const PartSpec& part) {
  std::vector<std::string> names{part.plugin};
  if (const auto family = part.given.find("family"); family != part.given.end())
    if (const auto* name = std::get_if<std::string>(&family->second)) names.push_back(*name);
  return names;
}

}  // namespace

void leave_out(const std::string& name, SceneSpec& scene) {
  std::vector<std::string> known;
  bool found = false;
  for (SystemSpec& system : scene.systems) {
    const std::string before = scene.world ? system.name + "." : "";
    const bool one = scene.world && name.starts_with(before);
    const std::string wanted = one ? name.substr(before.size()) : name;
    for (std::vector<PartSpec>* parts : {&system.forces, &system.colliders})
      std::erase_if(*parts, [&](const PartSpec& part) {
        const std::vector<std::string> names = names_of(part);
        for (const std::string& each : names) {
          known.push_back(each);
          if (scene.world) known.push_back(before + each);
        }
        const bool named = std::ranges::count(names, wanted) > 0;
        found = found || named;
        return named;
      });
  }
  if (found) return;
  std::ranges::sort(known);
  known.erase(std::unique(known.begin(), known.end()), known.end());
  throw Error(ErrorKind::kUsage,
              {"nothing to leave out", "--without " + name,
               "the scene has no force, collider or family of that name", suggestion(name, known)});
}

void turn_off(const std::string& name, SceneSpec& scene) {
  bool known = false;
  std::vector<std::string> names;
  for (SystemSpec& system : scene.systems)
    for (std::vector<PartSpec>* parts : {&system.forces, &system.colliders})
      for (PartSpec& part : *parts) {
        if (part.switch_name.empty()) continue;
        names.push_back(part.switch_name);
        if (part.switch_name != name) continue;
        part.on = false;
        known = true;
      }
  if (known) return;
  const std::string remedy = suggestion(name, names);
  throw Error(ErrorKind::kUsage,
              {"no such switch", "--off " + name, "the scene has no switch of this name",
               names.empty() ? "it names them in switches = { NAME = PART }" : remedy});
}

}  // namespace sim::study
