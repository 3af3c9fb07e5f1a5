// The output files of a run for other programs and people: pictures, films, pages, tables. Each
// kind is a plugin, found by the ending of the file's name.
#pragma once

#include <functional>
#include <memory>
#include <ostream>
#include <span>
#include <string>
#include <vector>

#include "core/picture/look.h"
#include "core/picture/panels.h"

namespace sim {

struct WriterTask {
  std::string file;  // as the user wrote it, with the ending in `format`
  std::string format;
  std::vector<Model> models;
  bool world = false;  // the systems have names to tell them apart
  Look look;
  Panels panels;               // a picture of each system, or none: all in one
  double fps = 30;             // pictures of a film in one second
  std::function<bool()> stop;  // asked during long work at the end; may be empty

  // Compiled once, in the kernel, not with each writer.
  WriterTask();
  WriterTask(const WriterTask& other);
  WriterTask(WriterTask&& other) noexcept;
  WriterTask& operator=(const WriterTask& other);
  WriterTask& operator=(WriterTask&& other) noexcept;
  ~WriterTask();
};

// The moments of a run that a writer wants by default.
enum class CostEstimate { kLast, kFilm, kSteps };

class Writer {
 public:
  virtual ~Writer() = default;  // without commit(): no file is left

  virtual CostEstimate pace() const = 0;

  // In the order of time; one frame for each model.
  virtual void add(const Moment& moment) = 0;

  // After the last: the files take their names. Throws Error{kIo}, ClosedPipe.
  virtual void commit() = 0;
};

// The extension of a file name, in small letters; "" without one.
std::string ending_of(const std::string& file);

// The names of the files that a writer makes for this file, as FilePlan takes them; series of a
// world have the names of its systems.
std::vector<std::string> written_names(const std::string& file,
                                       const std::vector<std::string>& systems = {});

// Files of H5MD, which some builds lack.
bool is_hdf5(const std::string& ending);

}  // namespace sim
