#include "core/scene/foreign.h"

#include <cstdlib>

namespace sim {

void rethrow_foreign(const std::string& who, const Place& place, const std::string& what) {
  const auto fail = [&](const std::string& why) {
    throw Error(ErrorKind::kPlugin, {"a plugin failed: " + who, place, why + " (" + what + ")",
                                     "mend it, or ask its author; sim test FILE.so looks at it"});
  };
  try {
    throw;
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    fail(error.what());
  } catch (...) {
    fail("it threw something that is no exception");
  }
  std::abort();  // all of them throw
}

}  // namespace sim
