// The peers, their requirements, and the way they are built.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sim_bench {

// The accuracy with which a peer follows our method at the same step.
enum class Accuracy {
  kSame,        // the same method: rounding only
  kThirdOrder,  // a method of third order instead of fourth
  kOtherDrag,   // the same splitting with the drag in the kick: first order in c h / m
  kOtherSplit,  // exact drag at another place of the splitting
};

struct PeerKind {
  std::string name;    // tests/bench/peers/NAME.cpp
  std::string method;  // ours that it is compared with; "": in contact only
  Accuracy accuracy = Accuracy::kSame;
  bool gas = false;                 // runs scenes/gas.lua, too
  bool fields = false;              // runs first-order systems, and them alone
  int largest = 1024;               // particles a side it is tried with
  std::string header, program;      // what must be there; "" = nothing
  std::string packages;             // of Debian, that bring it
  std::vector<std::string> link{};  // further arguments of the compiler
  std::string simd{};               // the instruction set it is compiled for; "" = the best here
};

std::filesystem::path peer_folder();
std::filesystem::path peer_binary(const PeerKind& kind);
std::filesystem::path peer_log(const PeerKind& kind);

enum class PeersOf { kParticles, kContact, kFields };

// Builds those whose libraries are here, for an instruction set of SIM_SIMD; libraries keep their
// own. Adds a line for each that is missing, with the command
// that installs it, or that does not build, with where the compiler's words are.
std::vector<PeerKind> build_peers(const std::string& simd, std::vector<std::string>& notes,
                                  PeersOf what = PeersOf::kParticles);

}  // namespace sim_bench
