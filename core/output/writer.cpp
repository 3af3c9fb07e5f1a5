#include "core/output/writer.h"

#include <cctype>
#include <filesystem>

namespace sim {

WriterTask::WriterTask() = default;
WriterTask::WriterTask(const WriterTask& other) = default;
WriterTask::WriterTask(WriterTask&& other) noexcept = default;
WriterTask& WriterTask::operator=(const WriterTask& other) = default;
WriterTask& WriterTask::operator=(WriterTask&& other) noexcept = default;
WriterTask::~WriterTask() = default;

std::string ending_of(const std::string& file) {
  std::string ending = std::filesystem::path(file).extension().string();
  if (!ending.empty()) ending.erase(0, 1);
  for (char& c : ending) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return ending;
}

bool is_hdf5(const std::string& ending) {
  return ending == "h5" || ending == "h5md" || ending == "hdf5";
}

}  // namespace sim
