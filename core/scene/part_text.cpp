#include "core/scene/part_text.h"

namespace sim {

SceneNames names_of(const SystemSpec& spec) {
  SceneNames names;
  if (!spec.bodies.empty()) names.first_of_bodies = spec.bodies.front().first;
  for (const PartSpec& part : spec.colliders)
    names.colliders.push_back(collider_text(part.plugin, part.given));
  return names;
}

std::vector<std::string> notes_of(const Force& force, const PartSpec& part,
                                  const SceneNames& names) {
  std::vector<std::string> notes = force.notes(names);
  for (std::string& note : notes)
    note = "force '" + part.plugin + "'" + (part.place.empty() ? "" : " at " + part.place) + " " +
           note;
  return notes;
}

std::string collider_text(const std::string& plugin, const std::map<std::string, Value>& given) {
  std::string text;
  for (const auto& [name, value] : given)
    text += (text.empty() ? "" : ", ") + name + " = " + to_text(value);
  return "sim.collider." + plugin + " { " + text + " }";
}

}  // namespace sim
