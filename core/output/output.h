// The file (or stream) of a table. A regular file is replaced as a whole at the end: the rows go to
// a new file in its folder first, so that a run that fails leaves the old one as it was. That file
// has no name until then, if the system supports it, so that a killed process leaves nothing;
// otherwise the next file in that folder removes the files of dead processes.
#pragma once

#include <filesystem>
#include <ostream>
#include <string>
#include <string_view>

namespace sim {

enum class TableFormat { kCsv, kJsonLines, kSvg };

// The destination of a table, as the command line gives it.
struct Target {
  std::string file = "-";  // "-" = standard output
  TableFormat format = TableFormat::kCsv;

  bool standard_output() const { return file == "-"; }
};

// `text` is a file name that ends in .csv or .jsonl (with `plots` also .svg), "-", or something
// that is not a regular file (/dev/null, a named pipe), which gets CSV. Throws Error{kUsage} naming
// `option`. Opens nothing.
Target parse_target(std::string_view option, const std::string& text, bool plots = false);

// Opened as is, never replaced: devices, named pipes, and the targets of /dev/fd/N.
bool is_stream(const std::string& name);

// A name for a new file in a folder, which no other has: the open file, and its path; -1 and errno
// if there can be none. The file is locked as long as it is open: its writer is alive.
int open_temporary(const std::filesystem::path& folder, const std::string& ending,
                   std::filesystem::path& path);

// Removes files of open_temporary in a folder that nobody has open.
void collect_leftovers(const std::filesystem::path& folder);

class Output {
 public:
  // Throws Error{kIo}: no such folder, a folder of that name, no permission, ...
  Output(const Target& target, std::ostream& standard_output);
  explicit Output(const std::string& file);                  // whatever its name
  Output(const std::string& file, const std::string& name);  // as errors call it
  ~Output();  // without commit(): the new file is removed, the old one stays
  Output(const Output&) = delete;
  Output& operator=(const Output&) = delete;

  // Rows are appended here; flush_if_full() writes large blocks when due.
  std::string& buffer() { return buffer_; }
  void flush_if_full() {
    if (buffer_.size() >= kChunk) write();
  }
  void write();          // throws Error{kIo} or ClosedPipe; of a regular file all of it or nothing
  void publish();        // the file takes its name now; later output is appended
  void commit();         // the rest of the rows, then the new file takes its name
  void commit_safely();  // the same; and it is there even if the machine stops right after

 private:
  static constexpr std::size_t kChunk = std::size_t{1} << 20, kRoom = kChunk + 4096;

  void open(const std::string& file);
  void create_beside(const std::filesystem::path& file);
  void take_name(bool durable, bool stays_open = false);
  void name_unnamed(const std::filesystem::path& folder);
  void copy_unnamed(const std::filesystem::path& folder);
  [[noreturn]] void fail(int error) const;

  std::string name_;  // as the user wrote it
  std::ostream* stream_ = nullptr;
  int descriptor_ = -1;
  std::filesystem::path final_, temporary_;  // empty unless a regular file is replaced
  bool replaces_ = false;                    // a regular file
  std::string buffer_;
};

}  // namespace sim
