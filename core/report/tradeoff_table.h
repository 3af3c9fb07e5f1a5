// Every run of a study of speed against accuracy, as .csv or .jsonl.
#pragma once

#include <ostream>

#include "core/output/output.h"
#include "core/study/accuracy/work_precision.h"

namespace sim::report {

class TradeoffTable {
 public:
  // Throws Error{kIo}.
  TradeoffTable(const Target& target, std::ostream& standard_output);

  void add(const study::WorkPrecision& study);
  void commit() { output_.commit(); }

 private:
  void row(const study::WorkPrecision& study, study::Place place);

  Output output_;
  TableFormat format_;
};

}  // namespace sim::report
