#include "core/scene/plugin_guard.h"

#include "core/base/thrown.h"

namespace sim {

void rethrow_from_plugin(const std::string& who, const SourceLocation& place,
                         const std::string& what) {
  const std::string why = thrown_by_others().value_or("it threw something that is no exception");
  throw Error(ErrorKind::kPlugin, {"a plugin failed: " + who, place, why + " (" + what + ")",
                                   "mend it, or ask its author; sim test FILE.so looks at it"});
}

}  // namespace sim
