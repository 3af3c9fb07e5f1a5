// Quantities that a session records on its runs.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/lua/prompt/prompt.h"
#include "core/output/plot.h"

namespace sim::cli {

// After going back in time, the rest is recorded anew.
class Records {
 public:
  struct Record {
    TimeSeries series;
    std::string code;  // as it was written
    std::int64_t every = 1;
    DataFunction quantity;  // nothing: it has ended
  };

  // Replaces a record of that name.
  void start(Record record);
  bool remove(const std::string& name);
  const std::vector<Record>& all() const { return records_; }
  const Record* find(const std::string& name) const;

  // The value at t; throws Error{kUsage} if it is no number, and the errors of Lua.
  void take(const std::string& name, Prompt& lua, double t);
  void end(const std::string& name);  // writes the record so far, and takes no more

 private:
  std::vector<Record> records_;
};

}  // namespace sim::cli
