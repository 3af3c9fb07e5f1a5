// The file of a recording, which grows while a session goes on.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "core/output/output.h"

namespace sim::report {

class RecordingFile {
 public:
  // Until begin() an older file of that name stays as it is. A later write error is told to
  // `failed`, once. Throws Error{kIo}.
  RecordingFile(const std::string& file, std::function<void(const std::string& why)> failed);

  // Whole lines. After a failure the file keeps those before it and takes no more.
  void append(std::string_view lines);

  void begin();        // the session has started: the file takes its name; throws Error{kIo}
  int finish() const;  // the exit code: 5 where lines are missing

 private:
  std::string name_;
  std::function<void(const std::string&)> tell_;
  Output output_;
  long lines_ = 0;
  bool begun_ = false, failed_ = false;
};

}  // namespace sim::report
