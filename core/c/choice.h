// Methods and steps that keep an error, for the systems of a scene that was not stepped yet.
#pragma once

#include <string>
#include <vector>

#include "core/c/handles.h"
#include "core/c/watcher.h"

namespace sim::c {

// The scene itself asks for an error, and nothing else asks for a tolerance.
bool asks_for_error(const sim_scene& scene);

// Chooses for each system of which an error is asked, and makes it anew with its choice. Told to
// end, it leaves the scene as it was. Throws Error.
void choose(sim_scene& scene, const ChoiceRequest& request, Watcher& watcher);

// Each choice as JSON, "" for a system without one; empty where none was made.
std::vector<std::string> choice_texts(const sim_scene& scene);

}  // namespace sim::c
