// The names of the parts of a scene, for notes of forces to its user.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace sim {

struct SceneNames {
  int first_of_bodies = -1;  // the first particle of rigid bodies, which are the last; -1: none
  std::vector<std::string> colliders = {};  // as the scene wrote them

  // Ascending ids: "particles 0 to 9 and 20 and body 2"; empty if there are none.
  std::string particles(std::span<const int> ids) const;
};

}  // namespace sim
