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

std::vector<std::string> written_names(const std::string& file,
                                       const std::vector<std::string>& systems) {
  namespace fs = std::filesystem;
  const std::string ending = ending_of(file);
  std::vector<std::string> names{file};
  if (is_hdf5(ending)) names.push_back(fs::path(file).replace_extension(".xmf").string());
  if (ending == "pc2") names.push_back(fs::path(file).replace_extension(".obj").string());
  if (ending != "pvd") return names;
  const fs::path folder = fs::path(file).replace_extension();
  names.push_back((folder / (folder.filename().string() + "_%05d.vtp")).string());
  for (const std::string& system : systems)
    names.push_back((folder / (system + "_%05d.vtp")).string());
  return names;
}

bool is_hdf5(const std::string& ending) {
  return ending == "h5" || ending == "h5md" || ending == "hdf5";
}

}  // namespace sim
