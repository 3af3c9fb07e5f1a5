// What is known of the cases of a sweep: one file a case, so that a sweep that was ended goes on
// where it was, in one process or in many.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace sim::cli {

class SweepStore {
 public:
  // OUT.cases beside the table; it is made when the first case is put into it.
  explicit SweepStore(const std::string& table);

  std::string names() const;  // of its files, as FilePlan takes them

  // The fields of a case as they were put; nothing where there is none with this key: it belongs to
  // another scene, program or question, or the file is damaged.
  std::optional<std::vector<std::string>> get(std::size_t index, std::uint64_t key) const;

  // Whole or not at all. Throws Error{kIo}.
  void put(std::size_t index, std::uint64_t key, const std::vector<std::string>& fields) const;

 private:
  std::filesystem::path file_of(std::size_t index) const;

  std::filesystem::path folder_;
};

}  // namespace sim::cli
