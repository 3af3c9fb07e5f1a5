// sim-petsc, a program of this tree that is built where PETSc is, as an engine.
#pragma once

#include "core/engine/engine.h"

namespace sim::engine {

std::string petsc_program();  // beside ours, or in PATH; "" where there is none

class Petsc final : public Engine {
 public:
  std::string name() const override { return "petsc"; }
  std::span<const EngineMethod> methods() const override;
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

}  // namespace sim::engine
