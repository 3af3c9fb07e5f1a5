// The sweep of sim_study(): one scene many times, several at once.
#pragma once

#include <string>

#include "core/c/asked_words.h"
#include "core/c/handles.h"
#include "core/c/watcher.h"

namespace sim::c {

// {"scene","names","observed","rows":[..]}, see report::case_json; a case that fails is a row. As
// many cases run at once as the options have threads. "" where the watcher ended it.
std::string sweep(const std::string& scene, const char* text, const Asked& asked, AskedWords& words,
                  Watcher& watcher);

}  // namespace sim::c
