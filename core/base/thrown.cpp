#include "core/base/thrown.h"

#include <new>

#include "core/base/error.h"

namespace sim {

std::optional<std::string> thrown_by_others() {
  try {
    throw;
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& error) {
    return error.what();
  } catch (...) {
    return {};
  }
}

}  // namespace sim
