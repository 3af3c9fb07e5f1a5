// Files of one result that take their names together, once all of them are complete.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace sim {

// Until commit() the files are in a folder inside their destination. Without commit() none of them
// is left, and files of an earlier result are unchanged.
class StagingFolder {
 public:
  // Makes `folder` if it is missing. Throws Error{kIo}.
  explicit StagingFolder(const std::filesystem::path& folder);
  ~StagingFolder();
  StagingFolder(const StagingFolder&) = delete;
  StagingFolder& operator=(const StagingFolder&) = delete;

  const std::filesystem::path& folder() const { return folder_; }
  const std::filesystem::path& temporary() const { return temporary_; }  // files are written here

  // The files in temporary(), and in folders there, take their names: all, or after an error none.
  // Throws Error{kIo}.
  void commit();

 private:
  void make_folder(const std::filesystem::path& folder);
  bool place(const std::filesystem::path& name) const;
  void take_back(const std::filesystem::path& name) const;

  std::filesystem::path folder_, temporary_;
  std::vector<std::filesystem::path> made_;  // folders that were missing
  int lock_ = -1;                            // on the temporary folder: its owner is alive
};

// Removes the files name(first), name(first + 1), .. up to the first that is missing: remains of a
// longer series.
template <class Name>
void remove_later_files(std::size_t first, const Name& name) {
  std::error_code failed;
  while (std::filesystem::remove(name(first), failed)) ++first;
}

}  // namespace sim
