// The look of pictures of a run, as a command line or a scene gives it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/math/vec3.h"
#include "core/scene/scene_spec.h"

namespace sim {

struct Look {
  std::optional<Vec3> eye, at, up;  // m; the picture finds the missing ones itself
  double fov = 30;                  // degrees, of the height
  std::optional<double> ground;     // m, its height
  bool wireframe = false;
  bool surface = false;         // liquids are drawn as one surface each
  std::string colour = "none";  // one of colours(), or the name of a number of a lattice
  double most = 0;              // of its scale, in its unit; 0: as the run needs
  bool all_springs = false;
  std::vector<std::string> families;  // springs of these names
  std::vector<int> picked;            // springs at these particles
  struct Trail {
    bool body;
    int id;
  };
  std::vector<Trail> trails;       // of particles and of centers of bodies
  bool own_trails = false;         // these alone; else pictures choose one
  int width = 1280, height = 720;  // pixels

  static const std::vector<std::string>& colours();  // none, strain, speed, energy, error, mode
};

// Each reads one option into the look; throws Error{kUsage} naming it.
void read_camera(const std::string& text, Look& look);  // "eye=1,2,3 at=0,0,0 up=0,1,0 fov=40"
// "strain", "speed:2"; `names` are known besides Look::colours().
void read_colour(const std::string& text, Look& look, const std::vector<std::string>& names = {});
void read_springs(const std::string& text, Look& look);  // "12", "all", "shear"
void read_trail(const std::string& text, Look& look);    // "12", "body:0", "none"
void read_size(const std::string& text, Look& look);     // "1280x720"

// The look of the scene, overridden by that of the user. Throws Error{kUsage}. `names`: of the
// numbers of a lattice, which colour too.
Look make_look(const LookSpec& scene, const LookSpec& asked = {},
               const std::vector<std::string>& names = {});

// The names that the field of a system gives to its numbers.
std::vector<std::string> names_of_field(const SystemSpec& system);
std::vector<std::string> names_of_fields(const SceneSpec& scene);  // system by system

}  // namespace sim
