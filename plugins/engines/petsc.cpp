// sim-petsc, a program of this tree that is built where PETSc is, as an engine.
#include <dlfcn.h>
#include <unistd.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numeric>

#include "core/base/error.h"
#include "core/base/layout.h"
#include "core/base/text.h"
#include "core/engine/engine.h"
#include "core/output/bytes.h"
#include "core/output/output.h"
#include "core/plugin/plugin.h"
#include "plugins/engines/petsc_files.h"

namespace sim::engine {
namespace {

// The particles along a curve that keeps near what is near (Morton 1966), so that a rank has a
// place of its own: ids by their place in the file.
std::vector<int> by_places(const Exchange& scene) {
  constexpr int kBits = 20;
  const int n = scene.particles();
  Vec3 low = scene.position(0), high = low;
  for (int i = 1; i < n; ++i)
    for (int axis = 0; axis < 3; ++axis) {
      low[axis] = std::min(low[axis], scene.position(i)[axis]);
      high[axis] = std::max(high[axis], scene.position(i)[axis]);
    }
  const Vec3 size = high - low;
  const double side = std::max({size.x(), size.y(), size.z()});
  std::vector<std::pair<std::uint64_t, int>> keys;
  keys.reserve(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) {
    std::uint64_t key = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double part = side > 0 ? (scene.position(i)[axis] - low[axis]) / side : 0;
      const auto cell = static_cast<std::uint64_t>(std::clamp(part, 0.0, 1.0) * ((1 << kBits) - 1));
      for (int bit = 0; bit < kBits; ++bit) key |= (cell >> bit & 1) << (3 * bit + axis);
    }
    keys.emplace_back(key, i);
  }
  std::ranges::sort(keys);
  std::vector<int> ids;
  ids.reserve(keys.size());
  for (const auto& [key, id] : keys) ids.push_back(id);
  return ids;
}

PetscMethod method_there(Method method) {
  switch (method) {
    case Method::kImplicitEuler:
      return PetscMethod::kImplicitEuler;
    case Method::kImplicitMidpoint:
      return PetscMethod::kImplicitMidpoint;
    case Method::kTrBdf2:
      return PetscMethod::kTrBdf2;
    default:
      return PetscMethod::kRk4;
  }
}

// The springs at each particle, each at both its ends.
struct Ends {
  std::vector<std::int64_t> first, other;
  std::vector<double> k, rest;

  Ends(const Exchange& scene, const std::vector<int>& place) {
    const auto moves = [&](int a, int b) { return scene.free(a) || scene.free(b); };
    first.resize(place.size() + 1);
    scene.each_spring([&](int a, int b, double, double) {
      if (!moves(a, b)) return;
      for (const int end : {a, b})
        ++first[static_cast<std::size_t>(place[static_cast<std::size_t>(end)]) + 1];
    });
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<std::int64_t> next = first;
    const auto count = static_cast<std::size_t>(first.back());
    other.resize(count);
    k.resize(count);
    rest.resize(count);
    scene.each_spring([&](int a, int b, double stiffness, double length) {
      if (!moves(a, b)) return;
      for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, a}}) {
        const auto at = static_cast<std::size_t>(
            next[static_cast<std::size_t>(place[static_cast<std::size_t>(from)])]++);
        const int there = place[static_cast<std::size_t>(to)];
        other[at] = scene.free(to) ? there : -1 - there;
        k[at] = stiffness;
        rest[at] = length;
      }
    });
  }
};

class PetscFrames final : public Frames {
 public:
  PetscFrames(const std::string& folder, const Exchange& scene, Simulation& system)
      : file_(folder + "/" + kPetscFrames),
        scene_(&scene),
        system_(&system),
        ids_(by_places(scene)),
        layout_(scene.particles()),
        state_(system.snapshot()),
        rows_(ids_.size() * kPetscColumns),
        step_(system.step_count()) {}

  std::int64_t step() const override { return step_; }

  Next next(std::int64_t last) override {
    if (!stream_.is_open()) stream_.open(file_, std::ios::binary);
    // Half a frame is not tried: its end is written when the rest is there.
    const auto size = static_cast<std::streamoff>(rows_.size() * sizeof(double) + sizeof(step_));
    std::error_code failed;
    const auto there = static_cast<std::streamoff>(std::filesystem::file_size(file_, failed));
    if (!stream_.is_open() || failed || there < at_ + size || step_ >= last) return Next::kNone;
    stream_.clear();
    stream_.seekg(at_);
    std::int64_t step = 0;
    stream_.read(reinterpret_cast<char*>(rows_.data()),
                 static_cast<std::streamsize>(rows_.size() * sizeof(double)));
    stream_.read(reinterpret_cast<char*>(&step), sizeof step);
    if (!stream_ || step <= step_)
      throw Error(ErrorKind::kCheckpoint, {"cannot read results", file_, "it is damaged",
                                           "check the space and the disk there"});
    at_ += size;
    step_ = step;
    if (!std::ranges::all_of(rows_, [](double each) { return std::isfinite(each); }))
      return Next::kNotFinite;
    for (std::size_t place = 0; place < ids_.size(); ++place) {
      const int i = ids_[place];
      if (!scene_->free(i)) continue;
      for (int column = 0; column < kPetscColumns; ++column)
        layout_.block(state_.x.data(), column)[i] =
            rows_[place * kPetscColumns + static_cast<std::size_t>(column)];
    }
    state_.step = step_;
    system_->restore(state_);
    return Next::kState;
  }

 private:
  std::string file_;
  std::ifstream stream_;
  const Exchange* scene_;
  Simulation* system_;
  std::vector<int> ids_;
  Layout layout_;
  Snapshot state_;
  std::vector<double> rows_;
  std::streamoff at_ = 0;  // the offset of the next one
  std::int64_t step_;
};

class Petsc final : public Engine {
 public:
  std::string name() const override { return "petsc"; }
  std::span<const EngineMethod> methods() const override;
  EngineFiles files() const override;
  std::vector<std::string> programs() const override;
  std::string needs() const override;
  bool solves() const override { return true; }
  std::vector<std::string> command(const Launch& launch) const override;
  void write(const Exchange& scene, std::span<const std::int64_t> moments,
             const std::string& folder) const override;
  std::unique_ptr<Process> start(std::vector<std::string> command,
                                 const std::string& folder) const override;
  std::unique_ptr<Frames> frames(const std::string& folder, const Exchange& scene,
                                 Simulation& system) const override;
  EngineLog log(const std::string& folder) const override;
};

// Below which lib/ lies, with this plugin somewhere in it; "" where that is part of a program.
std::filesystem::path prefix_of_plugin() {
  std::error_code failed;
  Dl_info info{};
  if (dladdr(reinterpret_cast<const void*>(&prefix_of_plugin), &info) == 0 || !info.dli_fname)
    return {};
  std::filesystem::path folder = std::filesystem::absolute(info.dli_fname, failed);
  while (folder.has_relative_path() && !folder.filename().string().starts_with("lib"))
    folder = folder.parent_path();
  return folder.has_relative_path() ? folder.parent_path() : std::filesystem::path();
}

// Beside the program, in bin/ of the installation where another program has opened this plugin, or
// in PATH; "" where there is none.
std::string petsc_program() {
  std::error_code failed;
  const std::filesystem::path own = std::filesystem::read_symlink("/proc/self/exe", failed);
  for (const std::filesystem::path& folder : {prefix_of_plugin() / "bin", own.parent_path()})
    if (const std::string file = (folder / "sim-petsc").string();
        folder.is_absolute() && ::access(file.c_str(), X_OK) == 0)
      return file;
  return find_program("sim-petsc");
}

std::span<const EngineMethod> Petsc::methods() const {
  static constexpr EngineMethod kMethods[] = {{"rk4", Method::kRk4},
                                              {"implicit_euler", Method::kImplicitEuler},
                                              {"implicit_midpoint", Method::kImplicitMidpoint},
                                              {"trbdf2", Method::kTrBdf2}};
  return kMethods;
}

EngineFiles Petsc::files() const {
  return {{kPetscScene}, {kPetscFrames, kPetscLog}, kPetscColumns};
}

std::vector<std::string> Petsc::programs() const {
  const std::string found = petsc_program();
  return found.empty() ? std::vector<std::string>{} : std::vector{found};
}

std::string Petsc::needs() const { return "a build with libpetsc-real-dev"; }

std::vector<std::string> Petsc::command(const Launch& launch) const {
  std::vector<std::string> words = launch.words;
  if (!words.empty()) {
    words[0] = program_or_throw(words[0], "--launch", "name one that is there");
    return words;
  }
  const std::string program = petsc_program();
  if (program.empty())
    throw Error(ErrorKind::kIo, {"missing program", "--engine petsc", "this build has no sim-petsc",
                                 "install libpetsc-real-dev and build again"});
  return with_ranks(program, launch.ranks);
}

void Petsc::write(const Exchange& scene, std::span<const std::int64_t> moments,
                  const std::string& folder) const {
  const std::vector<int> ids = by_places(scene);
  std::vector<int> place(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i)
    place[static_cast<std::size_t>(ids[i])] = static_cast<int>(i);
  const Ends ends(scene, place);
  const Vec3 g = scene.gravity();
  PetscHead head{{},
                 static_cast<std::int64_t>(ids.size()),
                 ends.first.back(),
                 static_cast<std::int64_t>(moments.size()),
                 moments.front(),
                 method_there(scene.method()),
                 scene.h(),
                 scene.drag(),
                 {g.x(), g.y(), g.z()},
                 scene.tolerance(),
                 kExactSteps};
  std::memcpy(head.magic, kPetscMagic, sizeof head.magic);

  Output file(folder + "/" + kPetscScene);
  std::string& out = file.buffer();
  const auto put = [&](const auto& values) {
    for (const auto value : values) {
      append_bytes(out, value);
      file.flush_if_full();
    }
  };
  append_bytes(out, head);
  put(ends.first);
  for (const int i : ids) append_bytes(out, scene.free(i) ? scene.mass(i) : 0.0);
  for (const bool velocities : {false, true})
    for (const int i : ids) {
      const Vec3 row = !velocities     ? scene.position(i)
                       : scene.free(i) ? scene.velocity(i)
                                       : Vec3::Zero();
      for (int axis = 0; axis < 3; ++axis) append_bytes(out, row[axis]);
      file.flush_if_full();
    }
  put(ends.k);
  put(ends.rest);
  put(ends.other);
  put(moments);
  file.commit();
}

std::unique_ptr<Process> Petsc::start(std::vector<std::string> command,
                                      const std::string& folder) const {
  return start_in(command, folder);
}

std::unique_ptr<Frames> Petsc::frames(const std::string& folder, const Exchange& scene,
                                      Simulation& system) const {
  return std::make_unique<PetscFrames>(folder, scene, system);
}

// "PETSc 3.18.5, 2 ranks", and then "halted STEP WHY" or "ERROR: ..".
EngineLog Petsc::log(const std::string& folder) const {
  constexpr std::size_t kLongest = 300;
  EngineLog log;
  std::ifstream stream(folder + "/" + kPetscLog);
  for (std::string line; std::getline(stream, line);) {
    line.resize(std::min(line.size(), kLongest));
    if (log.version.empty() && line.starts_with("PETSc ")) log.version = line;
    if (line.starts_with("ERROR")) log.error = line;
    if (!line.starts_with("halted ")) continue;
    const std::string rest = line.substr(7);
    const std::size_t space = std::min(rest.find(' '), rest.size());
    log.halted = parse_integer(rest.substr(0, space));
    log.why = rest.substr(std::min(space + 1, rest.size())) + " in petsc";
  }
  return log;
}

}  // namespace
}  // namespace sim::engine

SIM_PLUGIN(engine::Engine, "petsc") {
  registrar.add(sim::Plugin<sim::engine::Engine>{
      {.name = "petsc",
       .summary = "sim-petsc makes the steps on many processes: springs, gravity and drag, by rk4 "
                  "or an implicit method",
       .formula = "sim SCENE --engine petsc --ranks N",
       .source = "Balay et al. (1997), Modern Software Tools in Scientific Computing, 163-202"},
      [](const sim::Params&) { return std::make_unique<sim::engine::Petsc>(); }});
}
