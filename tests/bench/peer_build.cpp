#include "tests/bench/peer_build.h"

#include <cstdlib>
#include <iostream>

#include "tests/bench/child.h"

namespace sim_bench {
namespace {

namespace fs = std::filesystem;

std::vector<PeerKind> known_peers() {
  const std::string child = SIM_BENCH_SOURCE "/tests/bench/child.cpp";
  const std::string springs = SIM_BENCH_SOURCE "/tests/bench/peers/springs.cpp";
  const std::string error = SIM_BENCH_SOURCE "/core/base/error.cpp";
  const std::vector<std::string> bullet = {"-isystem",          "/usr/include/bullet",
                                           "-lBulletSoftBody",  "-lBulletDynamics",
                                           "-lBulletCollision", "-lLinearMath"};
  return {
      {.name = "odeint",
       .method = "rk4",
       .header = "boost/numeric/odeint.hpp",
       .program = "",
       .packages = "libboost-dev",
       .link = {springs}},
      {.name = "naive", .method = "rk4", .header = "", .program = "", .packages = ""},
      {.name = "sundials",
       .method = "rk4",
       .accuracy = Accuracy::kThirdOrder,
       .header = "arkode/arkode_erkstep.h",
       .program = "",
       .packages = "libsundials-dev",
       .link = {springs, "-lsundials_arkode", "-lsundials_nvecserial"}},
      {.name = "lammps",
       .method = "verlet",
       .accuracy = Accuracy::kOtherDrag,
       .gas = true,
       .largest = 512,
       .header = "",
       .program = "lmp",
       .packages = "lammps",
       .link = {child, error}},
      {.name = "openmm",
       .method = "verlet",
       .accuracy = Accuracy::kOtherSplit,
       .largest = 512,
       .header = "OpenMM.h",
       .program = "",
       .packages = "libopenmm-dev libopenmm-plugins",
       .link = {"-lOpenMM"}},
      {.name = "bullet",
       .method = "",
       .header = "bullet/btBulletDynamicsCommon.h",
       .program = "",
       .packages = "libbullet-dev",
       .link = bullet},
      {.name = "bullet_deformable",
       .method = "",
       .header = "bullet/BulletSoftBody/btDeformableMultiBodyDynamicsWorld.h",
       .program = "",
       .packages = "libbullet-dev",
       .link = bullet},
      {.name = "fields_sundials",
       .method = "",
       .fields = true,
       .header = "cvode/cvode.h",
       .program = "",
       .packages = "libsundials-dev",
       .link = {"-lsundials_cvode", "-lsundials_arkode", "-lsundials_nvecserial",
                "-lsundials_sunlinsoldense", "-lsundials_sunlinsolband",
                "-lsundials_sunlinsolspgmr", "-lsundials_sunmatrixdense",
                "-lsundials_sunmatrixband", "-lsundials_sunnonlinsolfixedpoint"}},
      // Its matrices need what C++20 took out of std::allocator.
      {.name = "fields_odeint",
       .method = "",
       .fields = true,
       .header = "boost/numeric/odeint.hpp",
       .program = "",
       .packages = "libboost-dev",
       .link = {"-std=c++17"}},
  };
}

fs::path source_of(const PeerKind& kind) {
  return fs::path(SIM_BENCH_SOURCE) / "tests/bench/peers" / (kind.name + ".cpp");
}

bool has_header(const std::string& header) {
  Child compiler({SIM_BENCH_CXX, "-std=c++20", "-x", "c++", "-E", "-o", "/dev/null", "-"});
  compiler.write("#if !__has_include(<" + header + ">)\n#error\n#endif\n");
  return compiler.wait() == 0;
}

bool has_program(const std::string& program) {
  const char* const path = std::getenv("PATH");
  std::string rest = path ? path : "";
  while (!rest.empty()) {
    const auto colon = rest.find(':');
    std::error_code error;
    if (fs::exists(fs::path(rest.substr(0, colon)) / program, error)) return true;
    rest = colon == std::string::npos ? "" : rest.substr(colon + 1);
  }
  return false;
}

// Built already, from the present sources.
bool is_fresh(const PeerKind& kind) {
  std::error_code error;
  const auto built = fs::last_write_time(peer_binary(kind), error);
  if (error) return false;
  for (const auto& entry : fs::directory_iterator(source_of(kind).parent_path()))
    if (entry.last_write_time() > built) return false;
  return true;
}

std::vector<std::string> flags_of(const std::string& simd) {
  if (simd == "sse2") return {"-march=x86-64", "-mtune=native"};
  if (simd == "fma") return {"-march=x86-64-v2", "-mavx", "-mfma", "-mprefer-vector-width=128"};
  if (simd == "avx2") return {"-march=x86-64-v3", "-mtune=native"};
  if (simd == "avx512") return {"-march=x86-64-v4", "-mtune=native"};
  return {"-march=native"};
}

bool compile(const PeerKind& kind) {
  std::vector<std::string> command = {SIM_BENCH_CXX,
                                      "-std=c++20",
                                      "-O3",
                                      "-fno-math-errno",
                                      "-fno-trapping-math",
                                      "-DNDEBUG",
                                      "-I" SIM_BENCH_SOURCE,
                                      "-isystem",
                                      SIM_BENCH_EIGEN,
                                      source_of(kind).string(),
                                      "-o",
                                      peer_binary(kind).string()};
  for (const std::string& flag : flags_of(kind.simd)) command.push_back(flag);
  command.insert(command.end(), kind.link.begin(), kind.link.end());
  Child compiler(command, peer_log(kind).string());
  return compiler.wait() == 0;
}

}  // namespace

fs::path peer_folder() { return SIM_BENCH_PEERS; }
fs::path peer_binary(const PeerKind& kind) {
  return peer_folder() / (kind.simd.empty() ? kind.name : kind.name + "-" + kind.simd);
}
fs::path peer_log(const PeerKind& kind) { return peer_binary(kind).string() + ".log"; }

std::vector<PeerKind> build_peers(const std::string& simd, std::vector<std::string>& notes,
                                  PeersOf what) {
  fs::create_directories(peer_folder());
  std::vector<PeerKind> ready;
  for (PeerKind& kind : known_peers()) {
    if (kind.fields != (what == PeersOf::kFields)) continue;
    if (what == PeersOf::kContact && !kind.method.empty()) continue;
    kind.simd = simd;
    if ((!kind.header.empty() && !has_header(kind.header)) ||
        (!kind.program.empty() && !has_program(kind.program))) {
      notes.push_back(kind.name + " is missing: apt-get install --no-install-recommends " +
                      kind.packages);
      continue;
    }
    if (!is_fresh(kind)) {
      std::cerr << "bench: building the peer " << kind.name << "\n";
      if (!compile(kind)) {
        notes.push_back(kind.name + " does not build: see " + peer_log(kind).string());
        continue;
      }
    }
    ready.push_back(kind);
  }
  return ready;
}

}  // namespace sim_bench
