// Moments of a run on disk: memory holds one at a time, and of the others only the data that does
// not grow with the number of particles.
#pragma once

#include <vector>

#include "core/output/scratch_file.h"
#include "core/picture/moments.h"

namespace sim {

class StoredMoments final : public MomentStore {
 public:
  explicit StoredMoments(const std::string& result) : file_(result) {}  // see ScratchFile

  void add(const Moment& moment);  // throws Error{kIo}

  std::size_t size() const override { return kept_.size(); }
  Moment get(std::size_t i) const override;
  const Moment& head(std::size_t i) const override { return kept_[i].head; }

 private:
  struct StoredFrame {
    Moment head;
    std::vector<std::size_t> sizes;  // of the arrays of each frame in turn
    std::uint64_t at = 0;
  };

  ScratchFile file_;
  std::vector<StoredFrame> kept_;
};

}  // namespace sim
