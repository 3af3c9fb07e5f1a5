// A folder that a verb starts something in: whole, or not there.
#pragma once

#include <filesystem>
#include <string>

#include "core/base/error.h"
#include "core/output/output.h"

namespace sim::cli {

// Removed again unless all of its files were written.
class NewFolder {
 public:
  // Throws Error{kIo} if it is there already: nothing is overwritten.
  explicit NewFolder(const std::filesystem::path& folder) : folder_(folder) {
    std::error_code failed;
    if (std::filesystem::create_directory(folder, failed)) return;
    throw Error(ErrorKind::kIo,
                {"cannot make the folder", folder.string(),
                 failed ? failed.message() : "it is there already, and nothing is overwritten",
                 "choose another name or another place"});
  }
  ~NewFolder() {
    std::error_code ignored;
    if (!complete_) std::filesystem::remove_all(folder_, ignored);
  }
  NewFolder(const NewFolder&) = delete;
  NewFolder& operator=(const NewFolder&) = delete;

  void write(const std::string& name, const std::string& text) const {
    Output out((folder_ / name).string());
    out.buffer() = text;
    out.commit();
  }
  void keep() { complete_ = true; }

 private:
  std::filesystem::path folder_;
  bool complete_ = false;
};

// True for a legal name of a folder and its contents: lower case letters, digits and _.
bool legal_folder_name(const std::string& name);

}  // namespace sim::cli
