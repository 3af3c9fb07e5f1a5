// A study, `sim NAME SCENE`: runs a scene as often as needed and reports its findings. A plugin.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/plugin/plugin_info.h"
#include "core/scene/simulation.h"
#include "core/study/problem.h"

namespace sim {

// The options of a scene on a command line, which a study may change.
struct SceneVariant {
  std::map<std::string, std::string> settings = {};  // --set
  std::vector<std::string> off = {};                 // --off: switches
  std::vector<std::string> without = {};             // --without: forces, colliders, families
  MethodChoice integrator = {};  // without a name: the scene's own, with these values
  double dt = 0;                 // s; 0 = the scene's own
};

struct StudiedScene {
  SceneSpec spec;
  std::vector<Simulation> systems;  // in the order of spec.systems
};

// The scene of a study, in any variant that the study asks for.
class SceneSource {
 public:
  virtual ~SceneSource() = default;

  virtual std::string name() const = 0;  // its file, as it was asked for
  // Throws Error for a scene that cannot be made, or that lacks a part named by the variant.
  virtual StudiedScene load(const SceneVariant& variant) = 0;
  // The options of a run of one of its systems, for study::Problem. Throws Error{kUsage}.
  virtual RunOptions options(const SceneVariant& variant, const SystemSpec& system) = 0;
  // The words that run the variant, except for method and step: "sim SCENE -s n=3 --without drag".
  virtual std::string command(const SceneVariant& variant) const = 0;
};

// The task of a study; it outlives the study.
struct StudyTask {
  SceneSource* scene = nullptr;  // null for a study that takes no scene
  Registry* registry = nullptr;
  SceneVariant variant = {};                   // as the command line asks for it
  std::optional<double> time = {};             // s, --time
  std::string of = {};                         // --of, as study::Quantity; empty: positions
  std::vector<MethodChoice> integrators = {};  // --integrators; empty: all that fit
  bool json = false;                           // one JSON object is asked for, not words
  study::Watch watch = {};                     // progress; false: end now, with the results so far
  std::function<void(double)> announce = {};   // how many seconds the study will take about
};

class Study {
 public:
  virtual ~Study() = default;
  // Returns its findings, which go to standard output; "" if it was ended before it had any. Throws
  // Error.
  virtual std::string run(const StudyTask& task) = 0;
};

// The parameters of a study are options of its verb: `max_step` is --max-step.
template <>
struct Plugin<Study> : PluginInfo {
  Kind<Study>::Make make;
  bool takes_scene = true;
  // Options of `sim` that it takes, of --integrator, --dt, --time, --of and --integrators.
  std::vector<std::string> takes = {};
  std::string help = {};  // the text below its options: the keys of --json, examples
};

}  // namespace sim
