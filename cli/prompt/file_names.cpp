#include "cli/prompt/file_names.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

namespace sim::cli {

std::vector<std::string> file_names(const std::string& word) {
  namespace fs = std::filesystem;
  const std::size_t slash = word.rfind('/');
  const std::string folder = slash == std::string::npos ? "" : word.substr(0, slash + 1);
  const std::string begun = word.substr(folder.size());
  std::string place = folder.empty() ? "." : folder;
  if (const char* home = std::getenv("HOME"); home && place.starts_with("~/"))
    place = home + place.substr(1);
  std::vector<std::string> names;
  std::error_code failed;
  for (fs::directory_iterator entry(place, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    const std::string name = entry->path().filename().string();
    if (!name.starts_with(begun) || (begun.empty() && name.starts_with('.'))) continue;
    std::error_code unknown;
    names.push_back(folder + name + (entry->is_directory(unknown) ? "/" : ""));
  }
  std::sort(names.begin(), names.end());
  return names;
}

}  // namespace sim::cli
