// Differences between two readings of a scene.
#include <algorithm>

#include "cli/prompt/repl_scene.h"
#include "core/output/format.h"

namespace sim::cli {
namespace {

void note(std::vector<Change>& changes, const std::string& what, const std::string& before,
          const std::string& after) {
  if (before != after) changes.push_back({what, before, after});
}

std::string size_of(const Simulation& system) {
  return std::to_string(system.flat() ? system.components() : system.particles());
}

void note_state(std::vector<Change>& changes, const std::string& prefix, const Simulation& before,
                const Simulation& after) {
  if (before.second_order() != after.second_order() || size_of(before) != size_of(after)) return;
  const auto largest = largest_difference(before, after);
  if (!largest) return;
  const std::string id = std::to_string(largest->id);
  const std::string of = (largest->item == "point" ? "particle" : largest->item) + " " + id;
  const std::string what = largest->item == "component" ? of : largest->quantity + " of " + of;
  changes.push_back({prefix + "most changed: " + what, brief(largest->a), brief(largest->b)});
}

void note_system(std::vector<Change>& changes, const std::string& prefix, const Simulation& before,
                 const Simulation& after) {
  note(changes, prefix + (after.flat() ? "components" : "particles"), size_of(before),
       size_of(after));
  note(changes, prefix + "pinned", std::to_string(before.pinned_count()),
       std::to_string(after.pinned_count()));
  note(changes, prefix + "springs", std::to_string(spring_count(before)),
       std::to_string(spring_count(after)));
  note(changes, prefix + "integrator", before.method().name(), after.method().name());
  note(changes, prefix + "dt", brief(before.h()) + " s", brief(after.h()) + " s");
  note(changes, prefix + "t", brief(before.t()) + " s", brief(after.t()) + " s");
  if (before.second_order() && after.second_order())
    note(changes, prefix + "energy", brief(before.energy().total()) + " J",
         brief(after.energy().total()) + " J");
  note_state(changes, prefix, before, after);
}

}  // namespace

std::vector<Change> differences(const LoadedScene& before, const LoadedScene& after) {
  std::vector<Change> changes;
  const auto& old = before.spec.args;
  for (const SceneArg& arg : after.spec.args) {
    const auto same = std::find_if(old.begin(), old.end(),
                                   [&](const SceneArg& each) { return each.name == arg.name; });
    note(changes, arg.name, same == old.end() ? "none" : to_text(same->value), to_text(arg.value));
  }
  note(changes, "systems", join(before.names(), " "), join(after.names(), " "));
  for (const Simulation& system : after.systems)
    for (const Simulation& each : before.systems)
      if (each.name() == system.name() || (!before.spec.world && !after.spec.world))
        note_system(changes, after.spec.world ? system.name() + ": " : "", each, system);
  return changes;
}

}  // namespace sim::cli
