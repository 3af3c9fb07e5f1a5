// Threads where the system may have none to give, as in a container.
#pragma once

#include <system_error>
#include <utility>

namespace sim {

// Says on standard error, once in a process, that the program goes on with fewer threads.
void warn_of_too_few_threads();

// Starts body() on a thread; false where there can be none, which is said. Thread: std::thread or
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
