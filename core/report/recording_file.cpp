#include "core/report/recording_file.h"

#include <algorithm>

#include "core/base/error.h"
#include "core/output/stream.h"
#include "core/report/study_words.h"

namespace sim::report {

RecordingFile::RecordingFile(const std::string& file,
                             std::function<void(const std::string&)> failed)
    : name_(file), tell_(std::move(failed)), output_(file) {}

void RecordingFile::append(std::string_view lines) {
  if (failed_) return;
  std::string why = "nobody reads it any more";
  try {
    output_.buffer() += lines;
    output_.write();
    lines_ += std::ranges::count(lines, '\n');
    return;
  } catch (const Error& error) {
    why = error.text().why;
  } catch (const ClosedPipe&) {}
  failed_ = true;
  const std::string first = lines_ == 1 ? "line is" : counted(lines_, "line") + " are";
  const std::string kept = begun_ ? "its first " + first + " kept, and " : "";
  tell_("cannot write: " + name_ + ": " + why + "; " + kept + "nothing more is recorded");
}

void RecordingFile::begin() {
  if (begun_) return;
  if (failed_)
    throw Error(ErrorKind::kIo, {"no recording", name_, "its first lines were not written",
                                 "make room there, or leave out --record"});
  output_.publish();
  begun_ = true;
}

int RecordingFile::finish() const { return failed_ ? static_cast<int>(ErrorKind::kIo) : 0; }

}  // namespace sim::report
