// LAMMPS as a program beside ours.
#pragma once

#include "core/engine/engine.h"

namespace sim::engine {

class Lammps final : public Engine {
 public:
  std::string name() const override { return "lammps"; }
  std::span<const EngineMethod> methods() const override;
  std::vector<std::string> command(const Launch& launch) const override;
  void write(const Exchange& scene, std::span<const std::int64_t> moments,
             const std::string& folder) const override;
  std::unique_ptr<Process> start(std::vector<std::string> command,
                                 const std::string& folder) const override;
  std::unique_ptr<Frames> frames(const std::string& folder, const Exchange& scene,
                                 Simulation& system) const override;
  EngineLog log(const std::string& folder) const override;
};

}  // namespace sim::engine
