// LAMMPS: velocity Verlet (fix nve) in one process, of springs (bond_style harmonic) with fix
// gravity and fix viscous, or of a gas (pair_style lj/cut/opt).
// Writes the scene for the program `lmp` and talks to it; times are the loop times that it prints.
#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>

#include "tests/bench/child.h"
#include "tests/bench/peers/peer.h"

namespace {

class Lammps {
 public:
  explicit Lammps(peer::Scene scene) : scene_(std::move(scene)) {
    folder_ = std::filesystem::temp_directory_path() / "lammps_XXXXXX";
    if (!mkdtemp(folder_.data())) std::exit(1);
    write_data(folder_ + "/scene.data");
    reset();
  }
  ~Lammps() {
    program_.reset();
    for (const char* name : {"/scene.data", "/positions"}) std::remove((folder_ + name).c_str());
    std::remove(folder_.c_str());
  }
  Lammps(const Lammps&) = delete;
  Lammps& operator=(const Lammps&) = delete;

  std::string about() const {
    return version_ + (gas() ? ", pair_style lj/cut/opt" : ", bond_style harmonic") + ", fix nve";
  }

  void reset() {
    program_ = std::make_unique<sim_bench::Child>(
        std::vector<std::string>{"stdbuf", "-oL", "lmp", "-echo", "none", "-log", "none"});
    program_->write(gas() ? gas_script() : spring_script());
    loop_time();
  }

  double run(long steps) {
    program_->write("run " + std::to_string(steps) + " pre no post no\n");
    return loop_time();
  }

  std::vector<double> positions() {
    const std::string path = folder_ + "/positions";
    program_->write("write_dump all custom " + path +
                    " x y z modify sort id format float %.17g\nprint done_writing\n");
    for (auto line = program_->read_line(); line && *line != "done_writing";)
      line = program_->read_line();
    std::ifstream in(path);
    std::string line;
    while (std::getline(in, line) && !line.starts_with("ITEM: ATOMS")) {}
    std::vector<double> x(scene_.x.size());
    for (double& value : x) in >> value;
    return x;
  }

 private:
  bool gas() const { return scene_.epsilon > 0; }

  std::string spring_script() const {
    char text[2048];
    const double g = std::hypot(scene_.g[0], scene_.g[1], scene_.g[2]);
    std::snprintf(text, sizeof text,
                  "units si\natom_style bond\nboundary f f f\natom_modify sort 0 0\n"
                  "pair_style none\nbond_style harmonic\nnewton on\ncomm_modify cutoff 1\n"
                  "read_data %s/scene.data\nneigh_modify delay 0 every 1000000000 check no\n"
                  "group free id <= %d\n%s"
                  "fix move free nve\nfix weight free gravity %.17g vector %.17g %.17g %.17g\n"
                  "fix drag free viscous %.17g\ntimestep %.17g\nthermo 1000000000\n"
                  "run 0 post no\n",
                  folder_.c_str(), scene_.n, group_without_pins().c_str(), g, scene_.g[0],
                  scene_.g[1], scene_.g[2], scene_.drag, scene_.h);
    return text;
  }

  std::string gas_script() const {
    char text[2048];
    std::snprintf(text, sizeof text,
                  "units si\natom_style atomic\nboundary s s s\npair_style lj/cut/opt %.17g\n"
                  "read_data %s/scene.data\npair_coeff 1 1 %.17g %.17g\npair_modify shift yes\n"
                  "neighbor %.17g bin\nneigh_modify delay 0 every 1 check yes\n"
                  "fix move all nve\ntimestep %.17g\nthermo 1000000000\nrun 0 post no\n",
                  scene_.cutoff, folder_.c_str(), scene_.epsilon, scene_.sigma, scene_.skin,
                  scene_.h);
    return text;
  }

  std::string group_without_pins() const {
    std::string text = "group pins id";
    for (const int id : scene_.pinned) text += " " + std::to_string(id + 1);
    return scene_.pinned.empty() ? "" : text + "\ngroup free subtract all pins\n";
  }

  // The seconds of "Loop time of T on 1 procs for N steps with M atoms".
  double loop_time() {
    while (const auto line = program_->read_line()) {
      if (line->starts_with("LAMMPS (")) version_ = *line;
      if (line->starts_with("ERROR")) std::fprintf(stderr, "%s\n", line->c_str());
      if (line->starts_with("Loop time of ")) return std::strtod(line->c_str() + 13, nullptr);
    }
    std::fprintf(stderr, "lmp ended early\n");
    std::exit(1);
  }

  void write_data(const std::string& path) const {
    FILE* const out = std::fopen(path.c_str(), "w");
    if (!out) std::exit(1);
    std::map<std::pair<double, double>, int> types;
    for (const peer::Spring& s : scene_.springs)
      types.try_emplace({s.k, s.rest}, static_cast<int>(types.size()) + 1);
    std::fprintf(out, "scene\n\n%d atoms\n1 atom types\n", scene_.n);
    if (!gas())
      std::fprintf(out, "%zu bonds\n%zu bond types\n", scene_.springs.size(), types.size());
    double most = 20;
    for (const double x : scene_.x) most = std::max(most, std::fabs(x) + 1);
    for (const char axis : {'x', 'y', 'z'})
      std::fprintf(out, "%.17g %.17g %clo %chi\n", -most, most, axis, axis);
    std::fprintf(out, "\nMasses\n\n1 %.17g\n", scene_.mass[0]);
    std::fprintf(out, "\nAtoms # %s\n\n", gas() ? "atomic" : "bond");
    for (int i = 0; i < scene_.n; ++i) {
      const double* const x = &scene_.x[3 * static_cast<std::size_t>(i)];
      std::fprintf(out, "%d %s %.17g %.17g %.17g\n", i + 1, gas() ? "1" : "1 1", x[0], x[1], x[2]);
    }
    std::fprintf(out, "\nVelocities\n\n");
    for (int i = 0; i < scene_.n; ++i) {
      const double* const v = &scene_.v[3 * static_cast<std::size_t>(i)];
      std::fprintf(out, "%d %.17g %.17g %.17g\n", i + 1, v[0], v[1], v[2]);
    }
    if (!gas()) write_bonds(out, types);
    std::fclose(out);
  }

  // LAMMPS writes the energy as K (r - r0)^2, so that K is half the stiffness.
  void write_bonds(FILE* out, const std::map<std::pair<double, double>, int>& types) const {
    std::fprintf(out, "\nBond Coeffs\n\n");
    for (const auto& [k_rest, type] : types)
      std::fprintf(out, "%d %.17g %.17g\n", type, k_rest.first / 2, k_rest.second);
    std::fprintf(out, "\nBonds\n\n");
    int id = 0;
    for (const peer::Spring& s : scene_.springs)
      std::fprintf(out, "%d %d %d %d\n", ++id, types.at({s.k, s.rest}), s.a + 1, s.b + 1);
  }

  peer::Scene scene_;
  std::string folder_, version_;
  std::unique_ptr<sim_bench::Child> program_;
};

}  // namespace

int main(int argc, char** argv) { return peer::serve<Lammps>(argc, argv); }
