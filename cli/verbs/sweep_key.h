// The key of a row: its request, the program, and the files that were read for it.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "cli/run/environment.h"
#include "cli/verbs/sweep_run.h"
#include "core/base/input_file.h"

namespace sim::cli {

// The program, by its version and content, and the folders where it searches files.
std::uint64_t program_key(const Environment& environment);

// The request of a case; `scene` is the file that was found.
std::uint64_t request_key(CaseRun run, const std::string& scene);

// Contents of files, each read once.
class FileContents {
 public:
  // The first of the files that has changed; null: none.
  const InputFile* changed(const std::vector<InputFile>& files);

 private:
  std::map<std::string, std::uint64_t> known_;  // by path
};

}  // namespace sim::cli
