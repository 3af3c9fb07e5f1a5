// The stored results of a sweep: one file a case, so that an interrupted sweep resumes where it
// stopped, in one process or in many.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "cli/verbs/sweep_run.h"

namespace sim::cli {

struct StoredCase {
  enum class State { kNone, kDamaged, kWhole };

  State state = State::kNone;  // none, too, where the row was made with another key
  CaseResult result = {};
};

class SweepStore {
 public:
  // OUT.cases beside the table; it is made when the first case is put into it.
  explicit SweepStore(const std::string& table);

  std::string names() const;  // of its files, as FilePlan takes them

  // A stored case, verified by its checksum.
  StoredCase get(std::size_t index, std::uint64_t key) const;

  // Stored whole or not at all. Throws Error{kIo}.
  void put(std::size_t index, std::uint64_t key, const CaseResult& result) const;

  std::filesystem::path file_of(std::size_t index) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace sim::cli
