// The options of `sim` before they are parsed.
#pragma once

#include <string>
#include <vector>

#include "cli/command_line/engine_options.h"
#include "cli/command_line/out_options.h"
#include "cli/command_line/view_options.h"
#include "cli/verbs/plot_table.h"

namespace sim::cli {

// Everything as text, as CLI11 found it.
struct Texts {
  std::string scene, integrator_word, dt_word;
  std::vector<std::string> integrator, dt;  // several to compare
  std::string tol, precision, time, verify_time, steps, seed, threads, debug_particle, energy, dump,
      observe, tension, every;
  std::string snap, snap_every, resume, replay, check, lua_budget, error;
  std::string progress = "auto";
  std::vector<std::string> set, off, plugin_path, load;
  OutTexts out;
  ViewTexts view;
  bool fixed_step = false, json = false, quiet = false, version = false, luacats = false,
       verify = false, no_verify = false, from_rest = false, man = false, safe = false,
       probe = false, names = false, markdown = false, until_horizon = false;
  std::string completion;
  std::string adjacency_scene, adjacency_particle, list_what, describe_name, rest_scene, explained;
  std::string test_library;
  std::vector<std::string> plugin_words = std::vector<std::string>(3);
  std::vector<std::string> scene_words = std::vector<std::string>(2);
  PlotRequest plot;
  EngineTexts engine;
  std::vector<std::string> without, of;
};

}  // namespace sim::cli
