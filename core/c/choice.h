// Methods and steps that keep an error, for the systems of a scene that was not stepped yet.
#pragma once

#include <string>
#include <vector>

#include "core/c/handles.h"
#include "core/c/watcher.h"

namespace sim::c {

// True if the scene itself requires an error, and nothing else requires a tolerance; with
// `or_method` also if its method chooses among others and would keep one.
bool asks_for_error(const sim_scene& scene, bool or_method);

// Chooses for each system with a required error, and makes it anew with its choice. Told to end, it
// leaves the scene as it was. Throws Error.
void choose(sim_scene& scene, const ChoiceRequest& request, Watcher& watcher);

// Each choice as JSON, "" for a system without one; empty if none was made.
std::vector<std::string> choice_texts(const sim_scene& scene);

}  // namespace sim::c
