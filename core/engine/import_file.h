// Files of other programs become scenes that can be edited.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace sim::engine {

struct ImportTask {
  std::string file;                 // .obj or .ply, or .h5
  std::filesystem::path read_h5md;  // the program that reads .h5; it need not be there
  std::function<void(std::string_view block)> write;  // receives the scene, in Lua
  std::function<void(const std::string& note)> tell;  // of what a scene cannot express
};

// A mesh becomes particles at its points, springs along its edges and across them, its surface,
// gravity and drag; the highest particle is pinned. H5MD becomes its last state and masses, with
// ties as springs; a file that a writer of ours made keeps also springs, gravity, drag, pins,
// method and step. Throws Error{kUsage}, Error{kIo}.
void import_file(const ImportTask& task);

}  // namespace sim::engine
