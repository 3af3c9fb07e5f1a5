// Starts threads on systems that may have none to give, such as containers.
#pragma once

#include <system_error>
#include <utility>

namespace sim {

// Reports on standard error, once in a process, that the program continues with fewer threads.
void warn_of_too_few_threads();

// Starts body() on a thread; false, with a report, if there can be none. Thread: std::thread or
// std::jthread.
template <class Thread, class Body>
bool start_thread(Thread& thread, Body body) {
  try {
    thread = Thread(std::move(body));
  } catch (const std::system_error&) {
    warn_of_too_few_threads();
    return false;
  }
  return true;
}

}  // namespace sim
