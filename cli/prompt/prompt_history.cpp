#include "cli/prompt/prompt_history.h"

#include <fcntl.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <utility>

namespace sim::cli {
namespace {

namespace fs = std::filesystem;

bool is_time(const std::string& line) {
  return line.size() > 1 && line[0] == '#' &&
         line.find_first_not_of("0123456789", 1) == std::string::npos;
}

std::string as_stored(const std::string& text) {
  return '#' + std::to_string(std::time(nullptr)) + '\n' + text + '\n';
}

std::vector<std::string> read_entries(const std::string& file) {
  std::vector<std::string> entries;
  std::ifstream in(file);
  bool timed = false, begun = false;
  for (std::string line; std::getline(in, line);) {
    if (is_time(line)) {
      timed = true;
      begun = false;
    } else if (timed && begun) {
      entries.back() += '\n' + line;
    } else {
      entries.push_back(std::move(line));
      begun = true;
    }
  }
  if (entries.size() > PromptHistory::kMostEntries)
    entries.erase(entries.begin(), entries.end() - PromptHistory::kMostEntries);
  return entries;
}

}  // namespace

std::string history_file() {
  const char* state = std::getenv("XDG_STATE_HOME");
  const char* home = std::getenv("HOME");
  fs::path folder;
  if (state && *state == '/')
    folder = state;
  else if (home && *home == '/')
    folder = fs::path(home) / ".local/state";
  else
    return "";
  folder /= "sim";
  std::error_code failed;
  fs::create_directories(folder, failed);
  return failed ? "" : (folder / "history").string();
}

PromptHistory::PromptHistory(std::string file) : file_(std::move(file)) {
  if (file_.empty()) return;
  const int made = ::open(file_.c_str(), O_CREAT | O_APPEND | O_WRONLY | O_CLOEXEC, 0600);
  if (made < 0) {
    file_.clear();
    return;
  }
  ::close(made);
  entries_ = read_entries(file_);
}

PromptHistory::~PromptHistory() {
  if (file_.empty() || entries_.size() <= kMostEntries) return;
  const std::string shorter = file_ + ".new";
  std::error_code failed;
  {
    std::ofstream out(shorter);
    // Another session may have added entries of its own.
    for (const std::string& entry : read_entries(file_)) out << as_stored(entry);
    if (!out.flush()) failed = std::make_error_code(std::errc::io_error);
  }
  fs::permissions(shorter, fs::perms::owner_read | fs::perms::owner_write, failed);
  if (!failed) fs::rename(shorter, file_, failed);
  if (failed) fs::remove(shorter, failed);
}

void PromptHistory::add(const std::string& text) {
  entries_.push_back(text);
  if (file_.empty()) return;
  const int file = ::open(file_.c_str(), O_CREAT | O_APPEND | O_WRONLY | O_CLOEXEC, 0600);
  if (file < 0) return;
  const std::string entry = as_stored(text);
  if (::write(file, entry.data(), entry.size()) < 0) file_.clear();
  ::close(file);
}

}  // namespace sim::cli
