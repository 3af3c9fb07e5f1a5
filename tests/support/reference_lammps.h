// LAMMPS's treatment of the files of an export, as its manual describes it (fix nve, gravity,
// efield, viscous; bond_style harmonic; dump custom, binary revision 2): plain loops that share
// nothing with the kernel.
#pragma once

#include <filesystem>
#include <fstream>
#include <map>
#include <string>
#include <vector>

namespace sim_test {

struct ReferenceLammps {
  struct Bond {
    double k = 0, rest = 0;  // energy k (|d| - rest)^2
    int a = 0, b = 0;        // from 0
  };

  // Reads scene.data, scene.in and moments.txt of the folder.
  explicit ReferenceLammps(const std::filesystem::path& folder);

  // Runs and writes frames.bin, in so many chunks a frame, as ranks do.
  void run(int chunks = 1);

  std::vector<double> x, v, f;       // 3 a particle
  std::vector<double> mass, weight;  // m' and the mass that gravity acts on, where it is given
  std::vector<int> group;            // 1: free
  std::vector<Bond> bonds;
  std::vector<double> gravity;  // of each particle, 3
  double drag = 0, h = 0;
  long first = 0, steps = 0;
  std::vector<long> moments;
  std::map<std::string, std::string> lines;  // of the script, by their first word

 private:
  void read_data();
  void read_script();
  void forces();
  void write_frame(std::ofstream& out, long step, int chunks) const;

  std::filesystem::path folder_;
  std::vector<int> type_;
};

}  // namespace sim_test
