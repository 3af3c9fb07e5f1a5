// The program as a build makes it that found no library of the optional parts.
#pragma once

#include <filesystem>
#include <string>

namespace sim_test {

// Builds a prefix in the folder with the program and all its plugins but that of HDF5, without
// sim-petsc; returns the path of the program there.
inline std::string bare_program(const std::filesystem::path& folder) {
  namespace fs = std::filesystem;
  const fs::path plugins = folder / "lib/sim/plugins", program = folder / "bin/sim";
  fs::create_directories(program.parent_path());
  fs::copy_file(SIM_BINARY, program);
  fs::create_directories(folder / "share");
  fs::create_symlink(fs::path(SIM_SOURCE_DIR) / "scripts", folder / "share/sim");
  for (const auto& kind : fs::directory_iterator(SIM_PLUGIN_DIR)) {
    const fs::path there = plugins / kind.path().filename();
    fs::create_directories(there);
    for (const auto& each : fs::directory_iterator(kind))
      if (each.path().filename() != "h5md.so")
        fs::create_symlink(each.path(), there / each.path().filename());
  }
  return program.string();
}

}  // namespace sim_test
