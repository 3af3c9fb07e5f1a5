#include "tests/bench/peer.h"

#include <fstream>

#include "core/base/error.h"
#include "core/base/text.h"

namespace sim_bench {

namespace fs = std::filesystem;

Peer::Peer(const PeerKind& kind, const fs::path& scene)
    : kind_(kind), child_({peer_binary(kind).string(), scene.string()}, peer_log(kind).string()) {
  about_ = answer("its first line");
}

double Peer::run(long count) {
  const std::string text = ask("run " + std::to_string(count));
  const auto seconds = sim::parse_number(text);
  if (!seconds) fail("it said '" + text + "' instead of a time");
  return *seconds;
}

std::vector<double> Peer::positions_after(long count, std::size_t size) {
  const fs::path file = peer_folder() / (kind_.name + ".positions");
  ask("reset");
  run(count);
  ask("positions " + file.string());
  std::vector<double> x(size);
  std::ifstream in(file, std::ios::binary);
  in.read(reinterpret_cast<char*>(x.data()), static_cast<std::streamsize>(size * sizeof(double)));
  if (!in) fail("its positions cannot be read");
  in.close();
  fs::remove(file);
  return x;
}

void Peer::fail(const std::string& why) const {
  throw sim::Error(sim::ErrorKind::kIo, {"peer " + kind_.name, peer_log(kind_).string(), why,
                                         "see what it wrote there"});
}
std::string Peer::answer(const std::string& what) {
  const auto line = child_.read_line();
  if (!line) fail("it ended before " + what);
  return *line;
}
std::string Peer::ask(const std::string& command) {
  if (!child_.write(command + "\n")) fail("it ended before '" + command + "'");
  return answer("the answer to '" + command + "'");
}

std::vector<double> positions_of(const sim::Simulation& simulation) {
  std::vector<double> x;
  for (int i = 0; i < simulation.particles(); ++i) {
    const sim::Vec3 p = simulation.position(i);
    x.insert(x.end(), {p[0], p[1], p[2]});
  }
  return x;
}

}  // namespace sim_bench
