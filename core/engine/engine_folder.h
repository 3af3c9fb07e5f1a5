// A folder for the files of an engine.
#pragma once

#include <string>

namespace sim::engine {

// Nobody else may read it; removed at the end, or by the next one where the process was killed.
class EngineFolder {
 public:
  EngineFolder();  // throws Error{kIo}
  ~EngineFolder();
  EngineFolder(const EngineFolder&) = delete;
  EngineFolder& operator=(const EngineFolder&) = delete;

  const std::string& path() const { return path_; }

 private:
  std::string path_;
  int held_ = -1;  // the folder, locked: its process is alive
};

}  // namespace sim::engine
