// A peer that runs. Every command has an answer of one line.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/scene/simulation.h"
#include "tests/bench/child.h"
#include "tests/bench/peer_build.h"

namespace sim_bench {

class Peer {
 public:
  Peer(const PeerKind& kind, const std::filesystem::path& scene);
  ~Peer() { child_.wait(); }  // it ends by itself, so that it can clear up
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  const PeerKind& kind() const { return kind_; }
  const std::string& about() const { return about_; }

  double run(long count);  // s, that so many steps took
  // x0 y0 z0 x1 ... in m, `size` numbers, so many steps after the start.
  std::vector<double> positions_after(long count, std::size_t size);

 private:
  [[noreturn]] void fail(const std::string& why) const;
  std::string answer(const std::string& what);
  std::string ask(const std::string& command);

  const PeerKind& kind_;
  Child child_;
  std::string about_;
};

// The same of ours, as it is.
std::vector<double> positions_of(const sim::Simulation& simulation);

}  // namespace sim_bench
