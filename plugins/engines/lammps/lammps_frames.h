// The states that LAMMPS writes: a binary dump, read frame by frame while it grows.
#pragma once

#include <cstdint>
#include <fstream>
#include <string>
#include <vector>

#include "core/base/layout.h"
#include "core/engine/engine.h"

namespace sim::engine {

class LammpsFrames final : public Frames {
 public:
  // The system is where the scene was when it was written; the frames are of the same folder.
  LammpsFrames(const std::string& folder, const Exchange& scene, Simulation& system);

  Next next(std::int64_t last) override;
  std::int64_t step() const override { return step_; }

 private:
  bool read_head();
  bool read_rows();
  void take(const double* row);
  [[noreturn]] void refuse(const std::string& why) const;
  template <class T>
  bool read(T* values, std::size_t count);

  std::string file_;
  std::ifstream stream_;
  const Exchange* scene_;
  Simulation* system_;
  Layout layout_;
  Snapshot state_;
  std::vector<bool> seen_;
  std::vector<double> rows_;
  std::streamoff frame_ = 0;  // the offset of the next one
  std::int64_t first_, step_;
  bool finite_ = true, same_start_ = true;
};

}  // namespace sim::engine
